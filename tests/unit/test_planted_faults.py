"""Defects planted in the control map: the monitor, which shares nothing with it, finds them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.control_map import map_protection
from kankaku.controllers.control_map.map_protection import ControlMap, ControlMapOptions, Memory
from kankaku.controllers.control_map.planned_map import MapPlan
from kankaku.controllers.control_map.wrong_maps import WrongMaps
from kankaku.controllers.registry import build
from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.failures.unit_failures import UnitFailure, Variant
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.radio_spec import LOSSLESS, Outage, RadioSpec
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Authority, LineState
from kankaku.testing.example_lines import world_of
from tests.property.runs import READY_S, run
from tests.unit.test_unit_failures import SPEC, failing, two_trains


def kinds(record: RunRecord) -> set[str]:
    return {violation.kind for violation in record.violations}


def under(
    scenario: Scenario,
    protection: Any,  # noqa: ANN401
    radio: RadioSpec = LOSSLESS,
) -> RunRecord:
    """Run under a control map of one's own; the first train overstays."""
    world = world_of(scenario)
    controller = replace(build(SPEC, world, radio), protection=protection)
    delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    delay_s[0, 1] = 90.0
    record, _ = run(scenario, controller=controller, delay_s=delay_s, radio=radio)
    return record


class ShortBands(ControlMap):
    """Takes every braking distance as a third shorter than it is."""

    def __init__(self, world: Any) -> None:  # noqa: ANN401
        super().__init__(world, ControlMapOptions(early_s=1000.0), LOSSLESS)
        braking = self._trains.braking
        harder = braking._replace(
            braking_v2_m2ps2=1.5 * braking.braking_v2_m2ps2,
            service_mps2=1.5 * braking.service_mps2,
        )
        self._trains = self._trains._replace(braking=harder)


def test_bands_shorter_than_the_braking_distance_are_found() -> None:
    scenario = two_trains(75.0)
    protection = ControlMap(world_of(scenario), ControlMapOptions(early_s=1000.0), LOSSLESS)
    assert under(scenario, protection).violations == ()
    assert kinds(under(scenario, ShortBands(world_of(scenario)))) & {"authority", "spacing"}


class Unchecked(WrongMaps):
    """Sends wrong maps without the exclusion test."""

    def _excludes(
        self, plan: MapPlan, furthest_m: FloatArray, state: LineState, memory: Memory
    ) -> bool:
        del plan, furthest_m, state, memory
        return True


@pytest.mark.parametrize("variant", [Variant.BAND, Variant.LEFT_OUT])
def test_a_wrong_map_that_nobody_tests_is_found(variant: Variant) -> None:
    scenario = two_trains(75.0)
    wrong = UnitFailure(variant, "T1", READY_S + 100.0, READY_S + 160.0, 250.0)
    tested, _, _ = failing(scenario, wrong, overstay_s=90.0)
    assert tested.violations == ()
    options = ControlMapOptions(early_s=1000.0)
    untested = under(scenario, Unchecked(world_of(scenario), options, LOSSLESS, wrong))
    assert "band" in kinds(untested)


class NothingMissing:
    """Counts a telegram as acknowledged when it is sent."""

    def __init__(self, protection: ControlMap) -> None:
        self._protection = protection

    def initial(self) -> Memory:
        return self._protection.initial()

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        authority, memory = self._protection.authorise(state, memory)
        newest = int(memory.sent.sent_s.argmax())
        covered_m = memory.sent.eoa_m[newest].max(axis=1)
        assert authority.permission is not None
        return authority._replace(
            permission=authority.permission._replace(covered_m=covered_m)
        ), memory


def test_a_work_zone_that_does_not_wait_for_acknowledgements_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """
    A train goes on by an old telegram, as far as it had been free then.

    That commands run out hides the defect: a train without any stands before the zone in time.
    """

    def never(latched: BoolArray, *_: object) -> BoolArray:
        return np.zeros_like(latched)

    monkeypatch.setattr(map_protection, "emergency", never)
    scenario = two_trains(300.0)
    # The train is told its way at full speed, and then nothing any more.
    from_s = READY_S + 52.0
    radio = replace(
        LOSSLESS,
        outages=(Outage(("T1",), up=False, down=True, from_s=from_s - 1.0, until_s=from_s + 60.0),),
    )
    zone = Closure("zone", Cause.WORK, ("main",), 950.0, 1000.0, from_s, *(READY_S + 200.0,) * 2)
    scenario = replace(scenario, disruptions=Disruptions((zone,)))
    options = ControlMapOptions(early_s=1000.0, tolerance_m=1000.0)
    patient = ControlMap(world_of(scenario), options, radio)
    # That it goes on without commands is seen, and nothing else.
    assert kinds(under(scenario, patient, radio)) == {"validity"}
    hasty = NothingMissing(ControlMap(world_of(scenario), options, radio))
    assert "obstruction" in kinds(under(scenario, hasty, radio))
