"""What protections promise beyond bare safety: broken, it is named; kept exactly, it is not."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.plan.line import Crossing
from kankaku.railway.plan.radio_spec import LOSSLESS, Outage, RadioSpec
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.control import Command, Controller, Drive, Protection
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from tests.property.runs import READY_S, run


@dataclass
class Shifted:
    """A protection whose limits are further on than it says."""

    honest: Protection[Any]
    extra_m: float
    rows: IntArray

    def initial(self) -> Any:  # noqa: ANN401 - whatever the honest one keeps
        return self.honest.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        authority, memory = self.honest.authorise(state, memory)
        eoa_m = authority.eoa_m.copy()
        eoa_m[self.rows] = np.minimum(eoa_m[self.rows] + self.extra_m, 3000.0)
        return authority._replace(eoa_m=eoa_m), memory


def built(
    scenario: Scenario,
    protection: str = "moving_block",
    radio: RadioSpec | None = None,
    **options: Any,  # noqa: ANN401 - what the protection takes
) -> Controller:
    spec = ControllerSpec("x", protection, "close_up", options, {}, radio=radio is not None)
    return build(spec, world_of(scenario), radio or LOSSLESS)


def shifted(controller: Controller, extra_m: float, rows: Iterable[int] = (1,)) -> Controller:
    protection = Shifted(controller.protection, extra_m, np.array(list(rows)))
    return replace(controller, protection=protection)


def worst(record: RunRecord) -> dict[str, float]:
    """Return the greatest excess by kind."""
    found: dict[str, float] = {}
    for violation in record.violations:
        found[violation.kind] = max(found.get(violation.kind, 0.0), violation.excess)
    return found


def overstay(seconds: float) -> FloatArray:
    delay_s = np.zeros((2, 2))
    delay_s[0, 1] = seconds
    return delay_s


@pytest.mark.parametrize("protection", ["moving_block", "relative_braking"])
def test_a_limit_inside_the_margin_is_named_by_its_depth(protection: str) -> None:
    scenario = two_station_scenario(2, 90.0)
    honest = built(scenario, protection, margin_m=20.0)
    assert run(scenario, controller=honest, delay_s=overstay(60.0))[0].violations == ()
    record, _ = run(scenario, controller=shifted(honest, 4.0), delay_s=overstay(60.0))
    assert worst(record) == {"margin": pytest.approx(4.0, abs=0.05)}
    assert record.violations[0].message.startswith("T2 was permitted 4.00 m into the margin")
    # A protection that never promised so much is not held to it.
    modest = replace(shifted(honest, 4.0), promises=Promises(16.0))
    assert run(scenario, controller=modest, delay_s=overstay(60.0))[0].violations == ()


def test_a_rear_without_its_buffer_is_named() -> None:
    """Buffers are longest when the leader leaves the line at 1800 m, 1500 m from its balise."""
    scenario = two_station_scenario(2, 90.0)
    scenario = replace(scenario, line=replace(scenario.line, balises_m=(300.0,)))
    exact = built(scenario)
    honest = built(scenario, position_error_percent=1.0, position_resolution_m=3.0)
    assert run(scenario, controller=honest, delay_s=overstay(60.0))[0].violations == ()
    blind = replace(honest, protection=exact.protection)
    record, _ = run(scenario, controller=blind, delay_s=overstay(60.0))
    eoa_m = 1800.0 - 200.0 - 25.0
    buffers_m = 0.01 * 1500.0 + 3.0 + 0.01 * (eoa_m - 300.0) + 3.0
    # It was last seen up to a step before.
    assert worst(record)["margin"] == pytest.approx(buffers_m, abs=0.02 * 30.0 * 0.5)


def test_points_and_crossings_are_not_granted_before_they_can_be_proven() -> None:
    """T2 is let 10 m too far while T1 has not left the points; then T1 before the crossing."""
    scenario = merge_scenario(2, 20.0)
    honest = built(scenario)
    assert run(scenario, controller=honest)[0].violations == ()
    record, _ = run(scenario, controller=shifted(honest, 10.0))
    assert worst(record)["grant"] == pytest.approx(10.0, abs=0.01)
    road = Crossing("road", 900.0, 910.0, 420.0, 25.0)
    crossed = replace(scenario, line=replace(scenario.line, crossings=(road,)))
    assert run(crossed, controller=built(crossed))[0].violations == ()
    record, _ = run(crossed, controller=shifted(built(crossed), 10.0, (0,)))
    assert worst(record) == {"grant": pytest.approx(10.0, abs=0.01)}


@pytest.mark.parametrize("protection", ["multi_step_atc", "atd", "digital_atc"])
def test_a_circuit_counts_as_occupied_until_its_release(protection: str) -> None:
    scenario = two_station_scenario(2, 90.0, block_m=250.0)
    slow = replace(scenario, line=replace(scenario.line, release_delay_s=4.0))
    honest = built(slow, protection)
    assert run(slow, controller=honest, delay_s=overstay(60.0))[0].violations == ()
    # Its circuits are free as soon as the tail is out, on a line where they take four seconds.
    early = replace(honest, protection=built(scenario, protection).protection)
    record, _ = run(slow, controller=early, delay_s=overstay(60.0))
    assert set(worst(record)) == {"release"}
    # The blocks are 250 m long, so the next one is promised too early.
    assert worst(record)["release"] >= 250.0
    # In the very step of its release it may count as free.
    assert record.violations[0].message.endswith("(for 3.5 s)")


def test_a_platform_section_is_for_one_train() -> None:
    """Both stop at 1300 m, in the section that begins at 1090 m."""
    scenario = two_station_scenario(2, 90.0)
    honest = built(scenario, exclusive_platform=True, margin_m=0.0)
    assert run(scenario, controller=honest, delay_s=overstay(60.0))[0].violations == ()
    shares = replace(honest, protection=built(scenario, margin_m=0.0).protection)
    record, _ = run(scenario, controller=shares, delay_s=overstay(60.0))
    found = worst(record)
    assert set(found) == {"platform"}
    # T1's tail is at 1100 m.
    assert found["platform"] == pytest.approx(10.0, abs=0.1)


@dataclass
class Unhurried:
    """A protection that never lets a train brake in emergency."""

    honest: Protection[Any]

    def initial(self) -> Any:  # noqa: ANN401 - whatever the honest one keeps
        return self.honest.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        authority, memory = self.honest.authorise(state, memory)
        assert authority.permission is not None
        calm = authority.permission._replace(
            emergency=np.zeros_like(authority.permission.emergency)
        )
        return authority._replace(permission=calm), memory


def test_commands_that_are_too_old_ask_for_the_emergency_brake() -> None:
    from_s = READY_S + 45.0
    outage = Outage((), up=False, down=True, from_s=from_s, until_s=from_s + 12.0)
    radio = replace(LOSSLESS, outages=(outage,))
    scenario = replace(two_station_scenario(1), step_s=0.1)
    honest = built(scenario, radio=radio)
    assert run(scenario, controller=honest, radio=radio)[0].violations == ()
    runs_on = replace(honest, protection=Unhurried(honest.protection))
    record, _ = run(scenario, controller=runs_on, radio=radio)
    (found,) = record.violations
    # The last commands before the outage were sent at 44.5 s, and hold for 5 s.
    assert found.kind == "validity"
    assert found.time_s == pytest.approx(from_s + 4.6, abs=0.11)
    # It accelerates or keeps its speed instead of braking at 1.3 m/s2.
    assert found.excess >= 1.3 - 0.02


@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_an_emergency_brake_may_take_its_time_to_build_up(step_s: float) -> None:
    """Without commands from 44.5 s on; the brake that is not there in the first second is due."""
    from_s = READY_S + 45.0
    outage = Outage((), up=False, down=True, from_s=from_s, until_s=from_s + 12.0)
    radio = replace(LOSSLESS, outages=(outage,))
    scenario = replace(two_station_scenario(1), step_s=step_s)
    gradual = {
        name: replace(kind, brake_build_up_s=1.0, jerk_mps3=0.8)
        for name, kind in scenario.train_types.items()
    }
    scenario = replace(scenario, train_types=gradual)
    honest = built(scenario, radio=radio)
    assert run(scenario, controller=honest, radio=radio)[0].violations == ()
    runs_on = replace(honest, protection=Unhurried(honest.protection))
    (found,) = run(scenario, controller=runs_on, radio=radio)[0].violations
    assert found.kind == "validity"
    assert found.excess >= 1.3 - 0.02


@dataclass
class Brusque:
    """A drive with one deceleration for whatever it is to brake for."""

    honest: Drive
    brake_mps2: float
    step_s: float

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        command = self.honest.command(state, authority, advice)
        brakes = state.speed_mps - command.speed_mps > 0.5 * self.step_s
        braked_mps = np.maximum(state.speed_mps - self.brake_mps2 * self.step_s, 0.0)
        speed_mps = np.where(brakes, np.minimum(braked_mps, command.speed_mps), command.speed_mps)
        return command._replace(speed_mps=speed_mps)


@pytest.mark.parametrize("brake_mps2", [1.0, 1.2])
def test_who_brakes_harder_than_the_service_brake_without_need_is_named(brake_mps2: float) -> None:
    """The service brake is 1.0 m/s2, and that of an emergency 1.3 m/s2."""
    scenario = replace(two_station_scenario(1), step_s=0.1)
    honest = built(scenario)
    brusque = replace(honest, drive=Brusque(honest.drive, brake_mps2, scenario.step_s))
    record, _ = run(scenario, controller=brusque)
    found = worst(record)
    assert set(found) == ({"braking"} if brake_mps2 > 1.0 else set())
    assert found.get("braking", 0.2) == pytest.approx(0.2, abs=0.01)


def test_a_train_under_codes_can_run_on_for_the_idle_time_into_every_block() -> None:
    scenario = two_station_scenario(2, 90.0, block_m=250.0)
    codes = tuple(float(code) for code in range(110, -1, -5))
    honest = built(scenario, "multi_step_atc", codes_kmh=codes, idle_time_s=4.0)
    assert run(scenario, controller=honest, delay_s=overstay(60.0))[0].violations == ()
    quick = built(scenario, "multi_step_atc", codes_kmh=codes, idle_time_s=0.0)
    late = replace(quick, promises=honest.promises)
    record, _ = run(scenario, controller=late, delay_s=overstay(60.0))
    assert set(worst(record)) == {"idle"}


def test_a_train_that_starts_beyond_the_strike_in_is_granted_what_is_closed_at_once() -> None:
    """It stands ready at 300 m; the crossing closes in no time, from a front at 250 m on."""
    scenario = two_station_scenario(1)
    road = Crossing("road", 800.0, 808.0, 250.0, 0.0)
    crossed = replace(scenario, line=replace(scenario.line, crossings=(road,)))
    assert run(crossed, controller=built(crossed))[0].violations == ()
