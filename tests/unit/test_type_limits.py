"""Limits of one train type, on chains and in networks: read, kept, judged and refused."""

from dataclasses import replace as changed
from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.line import SpeedLimit
from kankaku.railway.plan.met import line_met
from kankaku.railway.plan.profile import build_profile
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.testing.example_lines import (
    commuter_train,
    straight_line,
    two_station_scenario,
    world_of,
)
from tests.networks import LOOP, mistakes_of, network
from tests.property.runs import controller_of, run
from tests.unit.scenario_folder import replace, write_scenario
from tests.unit.test_monitor import Altered, kinds

SLOW_MPS = 12.0
LIMITS = (SpeedLimit(0.0, 1800.0, 25.0), SpeedLimit(600.0, 900.0, SLOW_MPS, train_type="freight"))


def with_freight(**options: object) -> Scenario:
    """Two trains, the second one of a type of its own."""
    scenario = two_station_scenario(2, 300.0, limits=LIMITS)
    first, second = scenario.timetable.services
    services = (first, changed(second, train_type="freight"))
    freight = changed(commuter_train(), id="freight", **options)  # type: ignore[arg-type]
    return changed(
        scenario,
        train_types={**scenario.train_types, "freight": freight},
        timetable=changed(scenario.timetable, services=services),
    )


def test_only_the_type_that_a_limit_is_for_meets_it() -> None:
    line = straight_line({"west": 300.0}, 2000.0, limits=LIMITS)
    kinds_of = [changed(commuter_train(), id=name) for name in ("commuter", "freight")]
    ceilings = build_profile(line, kinds_of).ceiling_at_m2ps2
    middle_m = np.array([750.0])
    assert np.sqrt(2.0 * ceilings(0, middle_m)) == pytest.approx(25.0)
    assert np.sqrt(2.0 * ceilings(1, middle_m)) == pytest.approx(SLOW_MPS)


def test_in_a_run_either_type_keeps_its_own_limits_and_nobody_is_accused() -> None:
    scenario = with_freight()
    record, engine = run(scenario)
    assert record.violations == ()
    at_m = engine.front_m[:-1]
    within = (at_m > 610.0) & (at_m < 890.0)
    fastest = [engine.speed_mps[:-1, row][within[:, row]].max() for row in (0, 1)]
    assert fastest[0] > 20.0
    assert fastest[1] <= SLOW_MPS + 1e-6


def test_a_protection_that_knows_no_types_is_accused_for_the_one_type_only() -> None:
    scenario = with_freight()
    honest = controller_of(world_of(scenario))
    blind = changed(honest, protection=Altered(honest.protection, ceiling_mps=25.0))
    assert {kind for kind in kinds(run(scenario, controller=blind)[0]) if kind[0] == "limit"} == {
        ("limit", "T2")
    }


def test_the_column_may_be_absent_empty_or_name_a_type(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    rows = "start_km,end_km,limit_kmh,train_type\n-0.3,1.0,90,\n0.5,0.8,3,unit\n1.0,2.0,75,\n"
    (folder / "limits.csv").write_text(rows, encoding="utf-8")
    limits = load(folder).line.limits
    assert limits[1] == SpeedLimit(500.0, 800.0, 3.0 / 3.6, train_type="unit")
    assert [limit.train_type for limit in limits] == ["", "unit", ""]


def test_an_unknown_type_is_refused_with_its_row(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    replace(
        folder,
        "limits.csv",
        "limit_kmh\n-0.3,1.0,90\n1.0,2.0,75",
        "limit_kmh,train_type\n-0.3,1.0,90,\n1.0,2.0,75,unti",
    )
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("limits.csv", "row 3, column train_type")
    assert "unknown train type 'unti'" in mistake.problem
    assert "'unit'" in mistake.allowed


def test_limits_of_one_type_follow_each_other(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    rows = "start_km,end_km,limit_kmh,train_type\n0.0,1.0,90,\n0.2,0.8,30,unit\n0.7,0.9,40,unit\n"
    (folder / "limits.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert mistake.where == "row 4, column start_km"
    assert "overlaps the one of row 3" in mistake.problem


def test_in_a_network_a_limit_may_be_that_of_a_track_and_a_type(tmp_path: Path) -> None:
    limits = "start_km,end_km,limit_kmh,track,train_type\n0.2,0.6,54,,\n0.8,1.1,36,up,unit\n"
    scenario = network(tmp_path / "known", limits=limits)
    met = line_met(scenario.line, scenario.timetable.services[0].route)
    assert met.limits[1] == SpeedLimit(800.0, 1100.0, 10.0, "up", "unit")
    unknown = limits.replace("up,unit", "up,fright")
    (mistake,) = mistakes_of(tmp_path / "unknown", LOOP, limits=unknown)
    assert (mistake.file, mistake.where) == ("limits.csv", "row 3, column train_type")
