"""SUMO as a witness on a chain: the same tables, and what is planted is seen."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.protection.moving_block import MovingBlock
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.engine_ways import ENGINES, EVERY_STEP, WITNESS
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Authority, LineState
from kankaku.studies.outcomes import StudyError
from kankaku.studies.study import run_once
from kankaku.sumo_net.agreement import EngineDisagreementError
from kankaku.sumo_net.witness_engine import WitnessEngine
from kankaku.testing.example_lines import two_station_scenario

LATE = DwellDelays(overstays=(Overstay("T1", "east", 200.0),))
CLOSE_UP = ControllerSpec("close_up", "moving_block", "close_up", {}, {})
NEARLY = 1e-9


def late_scenario() -> Scenario:
    return two_station_scenario(3, headway_s=90.0, delays=LATE, block_m=200.0)


def run(
    engine: str, wrap: Callable[[str, Any], Any] = lambda _, layer: layer, protection: str = ""
) -> RunRecord:
    spec = replace(CLOSE_UP, protection=protection) if protection else CLOSE_UP
    return run_once(late_scenario(), spec, 1, 0.5, engine=engine, wrap=wrap)


@pytest.mark.parametrize("protection", ["moving_block", "multi_step_atc"])
def test_both_engines_tell_the_same(protection: str) -> None:
    told, seen = (run(engine, protection=protection) for engine in (EVERY_STEP, WITNESS))
    assert np.array_equal(told.arrival_s, seen.arrival_s, equal_nan=True)
    assert np.array_equal(told.departure_s, seen.departure_s, equal_nan=True)
    assert np.array_equal(told.trajectory.reason, seen.trajectory.reason)
    for one, other in (
        (told.trajectory.front_m, seen.trajectory.front_m),
        (told.energy.traction_j, seen.energy.traction_j),
        (told.standstills.duration_s, seen.standstills.duration_s),
    ):
        assert one == pytest.approx(other, rel=NEARLY)


class Blind(MovingBlock):
    """Lets every train run as if there were no other one."""

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        authority, after = super().authorise(state, memory)
        return authority._replace(eoa_m=np.full_like(authority.eoa_m, self._world.far_m)), after


def blind(name: str, layer: Any) -> Any:  # noqa: ANN401 - any layer
    if name == "protection":
        layer.__class__ = Blind
    return layer


@pytest.mark.parametrize("engine", ENGINES)
def test_a_planted_overlap_is_seen(engine: str) -> None:
    kinds = {violation.kind for violation in run(engine, blind).violations}
    assert "collision" in kinds
    assert "spacing" in kinds


def test_a_wrong_place_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = WitnessEngine._move_in_sumo  # noqa: SLF001

    def slipping(
        engine: WitnessEngine, vehicles: list[str], gone_m: list[float], *speeds_mps: list[float]
    ) -> None:
        honest(engine, vehicles, gone_m, *([1.01 * mps for mps in told] for told in speeds_mps))

    monkeypatch.setattr(WitnessEngine, "_move_in_sumo", slipping)
    with pytest.raises(EngineDisagreementError, match="off its commands"):
        run(WITNESS)


class Ahead:
    """Lets every train run 5 m past its stop."""

    def __init__(self, drive: Any) -> None:  # noqa: ANN401 - any drive
        self._drive = drive

    def command(self, state: LineState, *others: Any) -> Any:  # noqa: ANN401 - as the drive
        return self._drive.command(state._replace(stop_m=state.stop_m + 5.0), *others)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_missed_stop_is_seen(engine: str) -> None:
    def wrap(name: str, layer: Any) -> Any:  # noqa: ANN401 - any layer
        return Ahead(layer) if name == "drive" else layer

    scenario = replace(two_station_scenario(1), patience_s=60.0)
    record = run_once(scenario, CLOSE_UP, 1, 0.5, engine=engine, wrap=wrap)
    assert {violation.kind for violation in record.violations} == {"stop"}
    assert not record.completed.any()


def test_an_engine_that_there_is_not_is_refused() -> None:
    with pytest.raises(StudyError, match="--engine: 'witnes'; allowed: 'witness'"):
        run("witnes")
