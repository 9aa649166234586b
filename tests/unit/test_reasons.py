"""Why trains are slow: the same words under every protection, and true ones."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.tables.run_tables import run_tables
from kankaku.controllers.registry import build
from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions, Obstacle
from kankaku.railway.plan.line import Crossing, SpeedLimit
from kankaku.railway.plan.radio_spec import LOSSLESS, Outage
from kankaku.railway.plan.scenario import ControllerSpec, Option, Scenario
from kankaku.railway.step.control import Controller
from kankaku.railway.step.reasons import ReasonError
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.property.runs import READY_S, run

CBTC: Mapping[str, Option] = {
    "margin_m": 0.0,
    "position_error_percent": 0.1,
    "position_resolution_m": 2.0,
    "communication_delay_s": 0.5,
    "exclusive_platform": True,
}
CONTROLLERS: Mapping[str, ControllerSpec] = {
    "moving block": ControllerSpec("x", "moving_block", "close_up", {}, {}),
    "cbtc": ControllerSpec("x", "moving_block", "close_up", CBTC, {}),
    "over radio": ControllerSpec("x", "moving_block", "close_up", {}, {}, radio=True),
    "relative braking": ControllerSpec("x", "relative_braking", "close_up", {}, {}),
    "atc": ControllerSpec("x", "multi_step_atc", "close_up", {}, {}),
    "atd": ControllerSpec("x", "atd", "close_up", {}, {}),
    "digital atc": ControllerSpec("x", "digital_atc", "close_up", {}, {}),
    "lineside": ControllerSpec("x", "multi_step_atc", "close_up", {"sighting_time_s": 8.0}, {}),
    "two stage": ControllerSpec("x", "moving_block", "two_stage", {}, {}),
    "control map": ControllerSpec("x", "control_map", "control_map", {}, {}),
}
every_controller = pytest.mark.parametrize("name", CONTROLLERS)
STANDS = {"train_ahead", "obstruction_ahead", "plan"}
"""Why a train may stand that no stop holds."""


def samples_of(
    scenario: Scenario,
    name: str = "moving block",
    *,
    delay_s: FloatArray | None = None,
    controller: Controller | None = None,
    **options: Any,  # noqa: ANN401 - of the run
) -> pd.DataFrame:
    """Run, and return the table ``trajectory``."""
    world = world_of(scenario)
    if delay_s is None:
        delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    chosen = controller or build(CONTROLLERS[name], world, LOSSLESS)
    radio = options.pop("radio", LOSSLESS if chosen.by_radio else None)
    record, _ = run(scenario, controller=chosen, delay_s=delay_s, radio=radio, **options)
    assert record.completed.all()
    return run_tables(record, flat_run_times_s(record)).trajectory


def flat_run_times_s(record: RunRecord) -> FloatArray:
    return np.full_like(record.arrival_s, 60.0)


def waiting(samples: pd.DataFrame) -> BoolArray:
    """Samples of trains that stand and that no stop holds; who moves on next only starts."""
    stands = samples["speed_mps"] == 0.0
    stays = stands.groupby(samples["train"]).shift(-1, fill_value=False)
    found: BoolArray = (stands & stays & (samples["reason"] != "dwelling")).to_numpy()
    return found


def assert_it_waits_for(samples: pd.DataFrame, train: str, reason: str, cause: str) -> None:
    """The train stands for long, and always for the same."""
    waits = samples[waiting(samples) & (samples["train"] == train)]
    assert len(waits) > 20
    assert set(waits["reason"]) <= {reason, "plan"}
    assert set(waits["cause"]) == {cause}


def next_ahead(scenario: Scenario, front_m: Mapping[str, float], train: str) -> str:
    """Return the nearest train further on that is on a track of the train's route."""
    line, services = scenario.line, {s.train: s for s in scenario.timetable.services}
    length_m = scenario.train_types["commuter"].length_m
    nearest_m, nearest = np.inf, ""
    for other, place_m in front_m.items():
        shared = set(services[train].route) & set(services[other].route)
        tracks = [line.track_by_id[track] for track in shared]
        on_way = any(p.start_m < place_m and place_m - length_m < p.end_m for p in tracks)
        if front_m[train] < place_m < nearest_m and on_way:
            nearest_m, nearest = place_m, other
    return nearest


@every_controller
def test_behind_a_standing_train_it_is_that_train(name: str) -> None:
    scenario = two_station_scenario(2, 70.0, block_m=250.0)
    samples = samples_of(scenario, name, delay_s=np.array([[0.0, 200.0], [0.0, 0.0]]))
    assert_it_waits_for(samples, "T2", "train_ahead", "T1")
    assert set(samples.loc[samples["train"] == "T1", "cause"]) == {""}


@every_controller
@pytest.mark.parametrize(
    "make",
    [
        lambda: two_station_scenario(3, 70.0, block_m=250.0),
        lambda: loop_station_scenario(3, 70.0, one_starts_inside=True, block_m=250.0),
    ],
    ids=["one track", "loop station"],
)
def test_the_train_ahead_is_the_next_one_on_the_way(
    name: str, make: Callable[[], Scenario]
) -> None:
    scenario = make()
    world = world_of(scenario)
    delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    delay_s[:2, 1] = 70.0, 40.0
    samples = samples_of(scenario, name, delay_s=delay_s)
    front_m: dict[float, dict[str, float]] = {}
    for time_s, train, place_m in zip(
        samples["time_s"], samples["train"], samples["front_m"], strict=True
    ):
        front_m.setdefault(time_s, {})[train] = place_m
    told = samples[samples["reason"] == "train_ahead"]
    for time_s, train, cause in zip(told["time_s"], told["train"], told["cause"], strict=True):
        assert cause == next_ahead(scenario, front_m[time_s], train)
    assert len(told) + (samples["reason"] == "plan").sum() > 10
    places = {turnout.id for turnout in scenario.line.turnouts}
    assert set(samples.loc[samples["reason"] == "obstruction_ahead", "cause"]) <= places
    assert set(samples.loc[waiting(samples), "reason"]) <= STANDS


@every_controller
def test_a_train_whose_points_are_another_trains_waits_for_the_points(name: str) -> None:
    # T2 is ready at the platform beside T1, which goes first and overstays.
    scenario = merge_scenario(2, 20.0, block_m=200.0)
    samples = samples_of(scenario, name, delay_s=np.array([[120.0, 0.0], [0.0, 0.0]]))
    first_s = samples.loc[(samples["train"] == "T1") & (samples["speed_mps"] > 0.0), "time_s"]
    beside = samples["time_s"] < first_s.min()
    assert_it_waits_for(samples[beside], "T2", "obstruction_ahead", "throat")


def crossing_scenario() -> Scenario:
    """Somebody stands on a level crossing when the train is to come."""
    scenario = two_station_scenario(1, block_m=250.0)
    line = replace(scenario.line, crossings=(Crossing("road", 900.0, 908.0, 320.0, 10.0),))
    blocked = Disruptions(obstacles=(Obstacle("road", READY_S, READY_S + 150.0),))
    return replace(scenario, line=line, disruptions=blocked)


def zone_scenario(cause: Cause) -> Scenario:
    """A stretch of track is closed before the train comes."""
    until_s = READY_S + 180.0
    closure = Closure("zone", cause, ("main",), 900.0, 1000.0, READY_S, until_s, until_s)
    scenario = two_station_scenario(1, block_m=250.0)
    return replace(scenario, disruptions=Disruptions((closure,)))


@every_controller
@pytest.mark.parametrize(
    ("make", "place"),
    [
        (crossing_scenario, "road"),
        (lambda: zone_scenario(Cause.WORK), "zone"),
        (lambda: zone_scenario(Cause.FAILURE), "zone"),
    ],
    ids=["level crossing", "work zone", "fault"],
)
def test_before_what_is_closed_it_is_the_place(
    name: str, make: Callable[[], Scenario], place: str
) -> None:
    samples = samples_of(make(), name)
    if name != "control map":
        assert_it_waits_for(samples, "T1", "obstruction_ahead", place)
        return
    # A centre that knows when it ends lets the train come slower instead.
    slowed = samples[samples["cause"] != ""]
    assert len(slowed) > 20
    assert set(slowed["reason"]) <= {"obstruction_ahead", "plan"}
    assert set(slowed["cause"]) == {place}


@every_controller
def test_alone_on_the_line_nothing_is_ahead(name: str) -> None:
    limit = SpeedLimit(600.0, 900.0, 10.0)
    samples = samples_of(two_station_scenario(1, limits=[limit], block_m=250.0), name)
    assert set(samples["cause"]) == {""}
    assert set(samples["reason"]) - {"plan"} == {
        "traction",
        "line_limit",
        "station_stop",
        "dwelling",
    }
    # The limit holds for the whole train, and it brakes at 1 m/s2 to its stop at 1300 m.
    within = samples["front_m"].between(610.0, 1090.0)
    assert set(samples.loc[within, "reason"]) == {"line_limit"}
    if name != "control map":
        braking = samples["front_m"].between(1270.0, 1299.0)
        assert set(samples.loc[braking, "reason"]) == {"station_stop"}


def test_a_lower_code_names_the_train_in_the_occupied_block() -> None:
    scenario = two_station_scenario(2, 70.0, spacing_m=3000.0, run_s=180.0, block_m=250.0)
    samples = samples_of(scenario, "atc", delay_s=np.array([[0.0, 300.0], [0.0, 0.0]]))
    # The first lower code is shown at 2500 m, and the way ends at 2975 m.
    behind = samples[(samples["train"] == "T2") & samples["front_m"].between(2500.0, 2960.0)]
    behind = behind[behind["time_s"] < READY_S + 300.0]
    assert set(behind["reason"]) == {"train_ahead", "traction"}
    told = behind[behind["reason"] == "train_ahead"]
    assert set(told["cause"]) == {"T1"}
    # Between two codes the brake is released, and the train runs up to the code.
    assert (behind["reason"] == "traction").sum() < 6
    # The idle time of 2 s belongs to the code, too.
    assert told["speed_mps"].iloc[0] == pytest.approx(25.0)


def test_a_train_that_brakes_for_its_platform_does_so_whatever_is_behind_it() -> None:
    # T1 stands 30 m further on than the end of the platform: no hindrance, but near.
    fault = Closure(
        "zone", Cause.FAILURE, ("main",), 1350.0, 1400.0, READY_S, READY_S + 60.0, READY_S + 400.0
    )
    scenario = replace(two_station_scenario(1), disruptions=Disruptions((fault,)))
    samples = samples_of(scenario)
    braking = samples[samples["front_m"].between(1200.0, 1299.0) & (samples["speed_mps"] > 0.0)]
    assert set(braking["reason"]) == {"station_stop"}
    after = samples[waiting(samples)]
    assert set(after["reason"]) == {"obstruction_ahead"}
    assert set(after["cause"]) == {"zone"}


@pytest.mark.parametrize("name", ["over radio", "control map"])
def test_without_commands_a_train_brakes_in_emergency(name: str) -> None:
    from_s = READY_S + 45.0
    silence = Outage((), up=False, down=True, from_s=from_s, until_s=from_s + 30.0)
    samples = samples_of(two_station_scenario(1), name, radio=replace(LOSSLESS, outages=(silence,)))
    # Commands are good for five seconds, and the train stands after some twenty more.
    silent = samples[samples["time_s"].between(from_s + 8.0, from_s + 28.0)]
    assert set(silent["reason"]) == {"emergency"}
    assert set(silent["cause"]) == {""}


@pytest.mark.parametrize(
    ("operation", "words"),
    [("two_stage", {"two_stage"}), ("two_stage_plain", {"two_stage"}), ("eco", {"eco"})],
)
def test_the_plan_of_an_operation_has_its_own_word(operation: str, words: set[str]) -> None:
    spec = ControllerSpec("x", "moving_block", operation, {}, {})
    scenario = two_station_scenario(2, 70.0, run_s=130.0)
    controller = build(spec, world_of(scenario))
    delay_s = np.array([[0.0, 100.0], [0.0, 0.0]])
    samples = samples_of(scenario, controller=controller, delay_s=delay_s)
    planned = samples[samples["reason"] == "plan"]
    assert words <= set(planned["plan"]) <= set(controller.operation.reasons)
    assert set(samples.loc[samples["reason"] != "plan", "plan"]) == {""}
    leaders = {""} if operation == "eco" else {"T1"}
    assert set(planned["cause"]) == leaders


class Strolling:
    """An operation from elsewhere: walks for the sake of the view, or for what it is given."""

    reasons: Any = ("admires_the_view", "strolls")

    def __init__(self, reason: Any, reasons: Any = reasons, since_s: float = 0.0) -> None:  # noqa: ANN401
        self._reason, self.reasons, self._since_s = reason, reasons, since_s

    def initial(self) -> None:
        """Nothing to remember."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        size = authority.eoa_m.size
        reason = self._reason if state.time_s >= self._since_s else 0
        return Advice(np.full(size, 2.0), np.full(size, reason), np.full(size, -1)), memory


class Saying(Strolling):
    """Says the same in every step."""

    def __init__(self, advice: Advice) -> None:
        super().__init__(0)
        self._advice = advice

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        del state, authority
        return self._advice, memory


def strolling(operation: Strolling) -> tuple[Scenario, Controller]:
    scenario = two_station_scenario(1)
    honest = build(CONTROLLERS["moving block"], world_of(scenario))
    return scenario, replace(honest, name="walkers", operation=operation)


def test_an_operation_from_elsewhere_is_told_in_its_own_words() -> None:
    scenario, controller = strolling(Strolling(1))
    samples = samples_of(scenario, controller=controller)
    strolls = samples["front_m"].between(400.0, 1200.0)
    assert set(samples.loc[strolls, "reason"]) == {"plan"}
    assert set(samples.loc[strolls, "plan"]) == {"strolls"}
    assert set(samples.loc[strolls, "cause"]) == {""}


@pytest.mark.parametrize("reason", [2, -2, 0.5, NO_REASON])
def test_a_reason_that_nobody_has_declared_is_refused_with_the_operation(reason: float) -> None:
    # Well after the first sample, and between two of them.
    since_s = READY_S + 60.5
    scenario, controller = strolling(Strolling(reason, since_s=since_s))
    with pytest.raises(ReasonError, match="operation Strolling of controller walkers"):
        run(scenario, controller=controller)


@pytest.mark.parametrize(
    "reasons", [None, "strolls", ["strolls"], ("",), ("on foot",), ("$x",), (3,), ("a", "a")]
)
def test_words_that_are_none_are_refused_before_the_first_step(reasons: Any) -> None:  # noqa: ANN401
    scenario, controller = strolling(Strolling(0, reasons))
    with pytest.raises(ReasonError, match="operation Strolling of controller walkers declares"):
        run(scenario, controller=controller)


@pytest.mark.parametrize("cause", [1, -2])
def test_a_cause_that_is_not_on_the_line_is_refused(cause: int) -> None:
    scenario, controller = strolling(Strolling(0))
    told = Advice(np.array([2.0]), np.array([0]), np.array([cause]))
    with pytest.raises(ReasonError, match="controller walkers names causes"):
        run(scenario, controller=replace(controller, operation=Saying(told)))
