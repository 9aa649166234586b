"""Protection broken on purpose: the monitor says what, who and when."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.line import Crossing, Gradient, SpeedLimit
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Command, Controller, Drive, Protection, Separation
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from tests.property.runs import Observed, controller_of, run

LENGTH_M = 200.0
STOP_M = 1300.0


@dataclass
class Altered:
    """A protection whose word is changed on its way to the train."""

    honest: Protection[Any]
    extra_m: float = 0.0
    sees_leaders: bool = True
    ceiling_mps: float | None = None
    blind_m: float = 3000.0

    def initial(self) -> Any:  # noqa: ANN401 - whatever the honest one keeps
        return self.honest.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        authority, memory = self.honest.authorise(state, memory)
        eoa_m = np.minimum(authority.eoa_m + self.extra_m, 3000.0)
        if not self.sees_leaders:
            eoa_m = np.full_like(eoa_m, self.blind_m)
        ceiling_mps = authority.ceiling_mps
        if self.ceiling_mps is not None:
            ceiling_mps = np.full_like(ceiling_mps, self.ceiling_mps)
        return authority._replace(eoa_m=eoa_m, ceiling_mps=ceiling_mps), memory


@dataclass
class AlteredDrive:
    """A drive that adds something to each speed between two moments."""

    honest: Drive
    extra_mps: float
    since_s: float
    until_s: float

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        command = self.honest.command(state, authority, advice)
        if not self.since_s <= state.time_s < self.until_s:
            return command
        speed_mps = np.maximum(command.speed_mps + self.extra_mps, 0.0)
        return command._replace(speed_mps=speed_mps)


def two_trains(**options: Any) -> tuple[Scenario, World, Controller]:  # noqa: ANN401
    scenario = two_station_scenario(2, 90.0, **options)
    world = world_of(scenario)
    return scenario, world, controller_of(world)


def overstay(seconds: float) -> np.ndarray:
    delay_s = np.zeros((2, 2))
    delay_s[0, 1] = seconds
    return delay_s


def kinds(record: RunRecord) -> set[tuple[str, str]]:
    trains = record.world.timetable.trains
    return {(v.kind, trains[v.row]) for v in record.violations}


def first_spacing_s(engine: Observed) -> float:
    """When the second train's braking distance first exceeds the way to the first one's tail."""
    tail_m = engine.front_m[:, 0] - LENGTH_M
    needs_m = 0.5 * engine.speed_mps[:, 1] ** 2
    moving = engine.speed_mps[:, 1] > 0.0
    return float(engine.time_s[moving & (engine.front_m[:, 1] + needs_m > tail_m + 0.1)][0])


@pytest.mark.parametrize("gradients", [(), (Gradient(500.0, 1200.0, -0.006),)])
def test_a_healthy_run_reports_nothing(gradients: tuple[Gradient, ...]) -> None:
    scenario, _, controller = two_trains(
        gradients=gradients, limits=(SpeedLimit(700.0, 900.0, 12.0),)
    )
    record, _ = run(scenario, controller=controller, delay_s=overstay(60.0))
    assert record.violations == ()


@dataclass
class Blind:
    """Train detection that never sees a train."""

    honest: Protection[Any]

    def initial(self) -> Any:  # noqa: ANN401 - whatever the honest one keeps
        return self.honest.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        alone = state._replace(
            present=np.arange(state.front_m.size) == 1, follows=np.zeros_like(state.follows)
        )
        authority, memory = self.honest.authorise(alone, memory)
        leading = np.full_like(authority.ceiling_mps, 100.0)
        ceiling_mps = np.where(alone.present, authority.ceiling_mps, leading)
        return authority._replace(ceiling_mps=ceiling_mps), memory


@pytest.mark.parametrize("protection", ["multi_step_atc", "atd", "digital_atc"])
def test_detection_that_sees_nobody_is_caught_at_the_boundary(protection: str) -> None:
    scenario = two_station_scenario(2, 90.0, block_m=250.0, limits=(SpeedLimit(0.0, 1800.0, 15.0),))
    world = world_of(scenario)
    honest = build(ControllerSpec("x", protection, "close_up", {}, {}), world)
    controller = replace(honest, protection=Blind(honest.protection))
    record, engine = run(scenario, controller=controller, delay_s=overstay(60.0))
    assert {("block", "T2"), ("spacing", "T2")} <= kinds(record)
    entered = next(v for v in record.violations if v.kind == "block")
    assert entered.message.startswith("T2 entered an occupied block")
    # The leader stands at 1300 m: its tail is in the block from 1000 m on.
    passed_s = engine.time_s[np.flatnonzero(engine.front_m[:, 1] > 1000.0)[0]]
    assert entered.time_s == pytest.approx(passed_s, abs=0.5)


def test_who_counts_on_the_leaders_brakes_is_judged_by_them() -> None:
    """The same run is too close behind a wall, and not behind a train that brakes."""
    scenario = two_station_scenario(2, 90.0)
    world = world_of(scenario)
    spec = ControllerSpec("x", "relative_braking", "close_up", {"margin_m": 5.0}, {})
    honest = build(spec, world)
    assert honest.separation is Separation.BRAKING
    record, _ = run(scenario, controller=honest, delay_s=overstay(60.0))
    assert record.violations == ()
    as_walls = replace(honest, separation=Separation.STANDING)
    record, _ = run(scenario, controller=as_walls, delay_s=overstay(60.0))
    assert kinds(record) == {("spacing", "T2"), ("band", "T2"), ("margin", "T2")}
    too_close = replace(honest, protection=Altered(honest.protection, extra_m=30.0))
    record, _ = run(scenario, controller=too_close, delay_s=overstay(60.0))
    assert kinds(record) == {("spacing", "T2"), ("margin", "T2")}


@pytest.mark.parametrize("broken", [{"sees_leaders": False}, {"extra_m": 100.0}])
def test_a_protection_that_lets_trains_too_close_is_caught_at_once(broken: dict[str, Any]) -> None:
    scenario, _, honest = two_trains()
    controller = replace(honest, protection=Altered(honest.protection, **broken))
    record, engine = run(scenario, controller=controller, delay_s=overstay(60.0))
    assert kinds(record) == {("spacing", "T2"), ("band", "T2"), ("margin", "T2")}
    first = next(violation for violation in record.violations if violation.kind == "spacing")
    assert first.time_s == pytest.approx(first_spacing_s(engine), abs=0.5)
    assert first.message.startswith("T2 could not stop before the train ahead")
    if "extra_m" in broken:
        # 100 m added to a margin of 25 m: it stops 75 m past the tail.
        assert first.excess == pytest.approx(75.0, abs=0.5)


def test_a_protection_without_line_limits_is_caught_where_the_limit_begins() -> None:
    scenario, _, honest = two_trains(limits=(SpeedLimit(700.0, 900.0, 12.0),))
    controller = replace(honest, protection=Altered(honest.protection, ceiling_mps=50.0))
    record, engine = run(scenario, controller=controller)
    assert kinds(record) == {("limit", "T1"), ("limit", "T2")}
    for violation in record.violations:
        assert violation.time_s == pytest.approx(engine.passes_s(violation.row, 700.0), abs=0.5)
        fronts_m = engine.front_m[:, violation.row]
        on_it = (fronts_m > 700.0) & (fronts_m - LENGTH_M < 900.0)
        top_mps = engine.speed_mps[on_it, violation.row].max()
        assert violation.excess == pytest.approx(top_mps - 12.0, abs=0.02)
        assert "above the line limit" in violation.message


@pytest.mark.parametrize("extra_mps", [0.3, -1.0])
def test_a_drive_beyond_traction_or_brake_is_caught(extra_mps: float) -> None:
    scenario, _, honest = two_trains()
    since_s = 25_200.0 + 40.0 if extra_mps > 0.0 else 25_200.0 + 55.0
    drive = AlteredDrive(honest.drive, extra_mps, since_s, since_s + 1.0)
    record, _ = run(scenario, controller=replace(honest, drive=drive))
    assert kinds(record) == {("acceleration", "T1")}
    assert record.violations[0].time_s == pytest.approx(since_s + 0.5, abs=0.51)


def test_a_drive_that_runs_on_is_caught_at_the_end_of_its_authority() -> None:
    scenario, world, honest = two_trains()
    lying = replace(honest, drive=TractionDrive(world))
    # The drive is told 3000 m, the record keeps what protection said.
    told = _ToldFurther(lying.drive)
    record, engine = run(scenario, controller=replace(honest, drive=told), delay_s=overstay(60.0))
    assert ("authority", "T2") in kinds(record)
    first = next(v for v in record.violations if v.kind == "authority")
    spacing = next(v for v in record.violations if v.kind == "spacing")
    assert first.time_s < spacing.time_s
    assert spacing.time_s == pytest.approx(first_spacing_s(engine), abs=0.5)


@dataclass
class _ToldFurther:
    honest: Drive

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        further_m = np.full_like(authority.eoa_m, 3000.0)
        return self.honest.command(state, authority._replace(eoa_m=further_m), advice)


@dataclass
class _ForgetsStops(_ToldFurther):
    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        blind = state._replace(stop_m=np.full_like(state.stop_m, 3000.0))
        return self.honest.command(blind, authority, advice)


def test_a_train_that_runs_past_its_stop_is_named() -> None:
    scenario, _, honest = two_trains()
    scenario = replace(scenario, patience_s=60.0)
    record, _ = run(scenario, controller=replace(honest, drive=_ForgetsStops(honest.drive)))
    missed = [v for v in record.violations if v.kind == "stop"]
    assert {v.row for v in missed} == {0, 1}
    assert missed[0].message.startswith("T1 ran past its stop")


@dataclass
class _IgnoresPoints:
    honest: Protection[Any]

    def initial(self) -> object:
        return self.honest.initial()

    def authorise(self, state: LineState, memory: object) -> tuple[Authority, object]:
        authority, memory = self.honest.authorise(state, memory)
        eoa_m = np.maximum(authority.eoa_m, 398.0)
        return authority._replace(eoa_m=eoa_m), memory


def test_a_train_inside_points_that_another_train_is_passing_is_named() -> None:
    scenario = merge_scenario(2, 60.0)
    delay_s = np.zeros((2, 2))
    delay_s[0, 0] = 100.0
    world = world_of(scenario)
    honest = controller_of(world)
    controller = replace(honest, protection=_IgnoresPoints(honest.protection))
    record, _ = run(scenario, controller=controller, delay_s=delay_s)
    fouling = [v for v in record.violations if v.kind == "fouling"]
    # Whose front is behind is named: first the train that comes, then the one it passes,
    # which stands at 398 m; the fouling section begins at 340 m.
    assert [v.row for v in fouling] == [0, 1]
    assert [v.excess for v in fouling] == pytest.approx([58.0, 58.0], abs=5.0)


@dataclass
class _GrantsEverything:
    """Keeps behind the tails of trains on the same route, and looks at nothing else."""

    honest: Protection[Any]
    world: World

    def initial(self) -> object:
        return self.honest.initial()

    def authorise(self, state: LineState, memory: object) -> tuple[Authority, object]:
        authority, memory = self.honest.authorise(state, memory)
        services = self.world.timetable.services
        eoa_m = np.full(self.world.size, self.world.far_m)
        for row, service in enumerate(services):
            for other, tail_m in enumerate(state.tail_m):
                shared = set(service.route) & set(services[other].route)
                if shared and state.present[other] and state.front_m[other] > state.front_m[row]:
                    eoa_m[row] = min(eoa_m[row], tail_m - 25.0)
        return authority._replace(eoa_m=eoa_m), memory


def run_granted_everything(scenario: Scenario, delay_s: FloatArray) -> RunRecord:
    world = world_of(scenario)
    honest = controller_of(world)
    grants = _GrantsEverything(honest.protection, world)
    # Only bare safety: what was promised is broken from the first step on.
    controller = replace(honest, protection=grants, promises=None)
    return run(scenario, controller=controller, delay_s=delay_s)[0]


def test_a_train_in_points_that_lie_for_another_one_is_named() -> None:
    """T2 goes before T1, which overstays, though the points lie for T1; nobody else is near."""
    delay_s = np.zeros((2, 2))
    delay_s[0, 0] = 400.0
    record = run_granted_everything(merge_scenario(2, 60.0), delay_s)
    (found,) = record.violations
    assert (found.row, found.kind) == (1, "points")
    assert "before they could lie for it" in found.message


@pytest.mark.parametrize("moves_s", [20.0, 60.0])
def test_a_train_in_points_that_are_still_moving_is_named(moves_s: float) -> None:
    """T2 follows T1 from another track; only the time of throw and proof is missing."""
    scenario = merge_scenario(2, 60.0)
    honest, _ = run(scenario, delay_s=np.zeros((2, 2)))
    turnouts = tuple(replace(points, throw_s=moves_s) for points in scenario.line.turnouts)
    moving = replace(scenario, line=replace(scenario.line, turnouts=turnouts))
    record = run_granted_everything(moving, np.zeros((2, 2)))
    assert honest.violations == ()
    assert [v.kind for v in record.violations] == (
        ["obstruction", "points"] if moves_s > 40.0 else []
    )


@pytest.mark.parametrize("closing_s", [20.0, 60.0])
def test_a_train_on_a_crossing_that_is_still_open_is_named(closing_s: float) -> None:
    scenario = two_station_scenario(2, 300.0)
    crossing = Crossing("road", 800.0, 808.0, 400.0, closing_s)
    scenario = replace(scenario, line=replace(scenario.line, crossings=(crossing,)))
    record = run_granted_everything(scenario, np.zeros((2, 2)))
    late = [(v.row, v.kind) for v in record.violations]
    # From strike-in to the crossing it takes about 21 s.
    assert late == ([(0, "crossing"), (1, "crossing")] if closing_s > 40.0 else [])


def test_a_train_that_never_arrives_breaks_no_rule_of_safety() -> None:
    scenario, _, controller = two_trains()
    scenario = replace(scenario, patience_s=300.0)
    delay_s = np.zeros((2, 2))
    delay_s[1, 0] = 5000.0
    record, _ = run(scenario, controller=controller, delay_s=delay_s)
    assert record.violations == ()
    assert record.completed.tolist() == [True, False]


def fault_ahead(at_s: float, start_m: float = 900.0, lasts_s: float = 120.0) -> Disruptions:
    """A fault of the line from 900 m on, in the way of the only train or the first one."""
    until_s = at_s + lasts_s
    return Disruptions(
        (Closure("fault", Cause.FAILURE, ("main",), start_m, 1000.0, at_s, np.inf, until_s),)
    )


@dataclass
class Deaf:
    """A protection that knows of nothing beside the track."""

    honest: Protection[Any]

    def initial(self) -> Any:  # noqa: ANN401 - whatever the honest one keeps
        return self.honest.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        far_m = np.full_like(state.granted_to_m, 2900.0)
        tails_m = state.tail_m[state.leader]
        clear_to_m = np.where(state.follows, tails_m, far_m)
        free = state._replace(granted_to_m=far_m, clear_to_m=clear_to_m)
        return self.honest.authorise(free, memory)


def test_a_protection_that_ignores_obstructions_is_caught_where_they_begin() -> None:
    scenario, _, honest = two_trains()
    closed = replace(scenario, disruptions=fault_ahead(25_200.0, lasts_s=300.0))
    record, _ = run(closed, controller=honest)
    assert record.violations == ()
    record, engine = run(closed, controller=replace(honest, protection=Deaf(honest.protection)))
    found = [(kind, train) for kind in ("obstruction", "grant") for train in ("T1", "T2")]
    assert kinds(record) == set(found)
    entered = [violation for violation in record.violations if violation.kind == "obstruction"]
    for violation in entered:
        assert violation.time_s == pytest.approx(engine.passes_s(violation.row, 900.0), abs=0.5)
        # From the moment it enters until its tail is out again.
        assert violation.excess == pytest.approx(100.0 + LENGTH_M, abs=15.0)


def test_a_train_that_a_fault_comes_too_near_to_is_excused_if_it_brakes() -> None:
    scenario, world, honest = two_trains()
    _, free = run(scenario, controller=honest)
    # At 800 m it runs at some 25 m/s: 100 m are a third of what it needs.
    at_s = float(np.ceil(free.passes_s(0, 800.0)))
    closed = replace(scenario, disruptions=fault_ahead(at_s))
    record, engine = run(closed, controller=honest)
    assert record.violations == ()
    stands = (engine.time_s > at_s) & (engine.speed_mps[:, 0] == 0.0)
    stood_m = engine.front_m[stands, 0].min()
    assert stood_m > 900.0
    since = int(np.searchsorted(engine.time_s, at_s))
    emergency = world.of_type("emergency_brake_mps2")[0]
    needs_m = engine.front_m[since, 0] + 0.5 * engine.speed_mps[since, 0] ** 2 / emergency
    assert stood_m == pytest.approx(needs_m, abs=2.0)
    # It stays where it is until the fault is repaired.
    assert np.all(engine.speed_mps[stands & (engine.time_s < at_s + 120.0), 0] == 0.0)
    deaf = replace(honest, protection=Deaf(honest.protection))
    assert ("obstruction", "T1") in kinds(run(closed, controller=deaf)[0])


def test_nobody_is_excused_who_could_have_stopped() -> None:
    """A brake that is asked for too late, though the fault was far enough away."""
    scenario, _, honest = two_trains()
    _, free = run(scenario, controller=honest)
    at_s = float(np.ceil(free.passes_s(0, 500.0)))
    closed = replace(scenario, disruptions=fault_ahead(at_s, 1000.0 - 50.0))
    assert run(closed, controller=honest)[0].violations == ()
    late = replace(honest, protection=Altered(honest.protection, extra_m=60.0))
    assert ("obstruction", "T1") in kinds(run(closed, controller=late)[0])
