"""Driving styles: what they make of trains and lines, how files tell them, and who has which."""

from dataclasses import replace as changed
from pathlib import Path

import numpy as np
import pytest

from kankaku.analysis.tables.delay import technical_run_times_s, unhindered_arrivals_s
from kankaku.asking import Check
from kankaku.railway.motion.driving import Driving, trace
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.line import SpeedLimit
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.studies import study
from kankaku.studies.capacity_study import assess_capacity
from kankaku.testing.example_lines import commuter_train, two_station_scenario, world_of
from tests.cli.command import two_controllers
from tests.unit.scenario_folder import replace, write_scenario

KMH = 1.0 / 3.6
GENTLE = """
[driving_styles.normal]
traction_percent = 80.0
station_brake_kmhps = 2.5
below_limit_kmh = 5.0
coasting_band_kmh = 10.0
departure_reaction_s = 2.0
driven_speeds = true
late_after_s = 15.0
"""
NORMAL = DrivingStyle("normal", 0.8, 2.5 * KMH, 5.0 * KMH, 10.0 * KMH, 2.0, True, 15.0)
DRIVEN = "start_km,end_km,speed_kmh\n0.5,0.8,40\n"


def styled(folder: Path, style: str = GENTLE, scenario: str = 'driving = "normal"\n') -> Path:
    """Write a small scenario with a style of its own."""
    write_scenario(folder)
    replace(folder, "scenario.toml", "seed = 7\n", f"seed = 7\n{scenario}")
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write(style)
    (folder / "driven_speeds.csv").write_text(DRIVEN, encoding="utf-8")
    return folder


def test_a_style_uses_less_of_a_train() -> None:
    train = commuter_train()
    driven = NORMAL.train(train)
    speeds_mps = np.array([0.0, 5.0, 15.0, 25.0])
    forces_n = 0.8 * train.traction.force_n(speeds_mps)
    assert driven.traction.force_n(speeds_mps) == pytest.approx(forces_n)
    assert driven.service_brake_mps2 == pytest.approx(2.5 / 3.6)
    assert driven.maximum_speed_mps == pytest.approx(105.0 / 3.6)
    assert driven.emergency_brake_mps2 == train.emergency_brake_mps2
    assert FASTEST.train(train) == train
    assert NORMAL.train(commuter_train(brake_mps2=0.5)).service_brake_mps2 == 0.5


def test_a_style_keeps_below_limits_but_never_below_half_of_them() -> None:
    limits = SpeedLimit(0.0, 500.0, 60.0 * KMH), SpeedLimit(500.0, 600.0, 6.0 * KMH)
    driven = SpeedLimit(100.0, 400.0, 40.0 * KMH)
    line = changed(two_station_scenario(limits=limits).line, driven_speeds=(driven,))
    kept = NORMAL.line(line).limits
    assert [one.limit_mps / KMH for one in kept] == pytest.approx([55.0, 40.0, 3.0])
    hurried = NORMAL.hurried.line(line).limits
    assert [one.limit_mps / KMH for one in hurried] == pytest.approx([55.0, 3.0])
    assert FASTEST.line(line).limits == limits


def test_coasting_alternates_between_a_speed_and_the_band_below_it_and_saves_energy() -> None:
    world = world_of(two_station_scenario(spacing_m=4000.0, limits=[SpeedLimit(0.0, 4800.0, 15.0)]))
    way = way_on(world.profile, 0, world.train_types[0], (300.0, 4300.0))
    held, coasted = (trace(way, Driving.coasting(way, band)) for band in (0.0, 3.0))
    speeds_mps = np.sqrt(2.0 * coasted.energy_m2ps2)
    middle = (way.chainage_m > 700.0) & (way.chainage_m < 3900.0)
    # It speeds up again at the end of a cell.
    assert speeds_mps[middle].min() == pytest.approx(12.0, abs=0.05)
    assert speeds_mps[middle].max() == pytest.approx(15.0, abs=0.01)
    turns = np.sign(np.diff(speeds_mps[middle]))
    assert np.count_nonzero(np.diff(turns[turns != 0.0])) >= 2
    assert coasted.run_time_s > held.run_time_s + 10.0
    assert coasted.work_m2ps2.sum() < held.work_m2ps2.sum()


def test_the_lateness_of_the_unhindered_run_knows_who_hurries() -> None:
    limits = [SpeedLimit(0.0, 3800.0, 15.0)]
    scenario = two_station_scenario(2, 400.0, spacing_m=3000.0, limits=limits)
    scenario = changed(scenario, driving=NORMAL)
    world = world_of(scenario)
    times_s = technical_run_times_s(world)
    assert times_s[0, 0, 1] > times_s[1, 0, 1] + 5.0
    # The minimum dwell is 5 s less than the booked one: 15 s late, and a little more than that.
    delay_s = np.array([[20.0, 0.0], [20.1, 0.0]])
    departure_s = world.booked_departure_s[:, 0] + [15.0, 15.1]
    arrival_s = unhindered_arrivals_s(world, delay_s, times_s)[:, 1]
    assert arrival_s - departure_s == pytest.approx([times_s[0, 0, 1], times_s[1, 1, 1]])


def test_files_tell_styles_and_driven_speeds(tmp_path: Path) -> None:
    scenario = load(styled(tmp_path / "small"))
    assert scenario.driving == NORMAL
    assert scenario.line.driven_speeds == (SpeedLimit(500.0, 800.0, 40.0 * KMH),)
    plain = load(write_scenario(tmp_path / "plain"))
    assert plain.driving == FASTEST
    assert plain.line.driven_speeds == ()


MISTAKES = {
    "style": ("seed = 7\n", 'seed = 7\ndriving = "norml"\n', "driving: unknown style 'norml'"),
    "controller": (
        "[controllers.plain]\n",
        '[controllers.plain]\ndriving = "slow"\n',
        "controllers.plain.driving: unknown style 'slow'",
    ),
    "name": (
        "[driving_styles.normal]",
        "[driving_styles.fastest]",
        "driving_styles.fastest: the name of the style without a table",
    ),
    "traction": ("traction_percent = 80.0", "traction_percent = 10.0", "traction_percent"),
    "brake": ("station_brake_kmhps = 2.5", "station_brake_kmhps = 0.0", "station_brake_kmhps"),
    "below": ("below_limit_kmh = 5.0", "below_limit_kmh = 31.0", "below_limit_kmh"),
    "band": ("coasting_band_kmh = 10.0", "coasting_band_kmh = -1.0", "coasting_band_kmh"),
    "reaction": ("reaction_s = 2.0", "reaction_s = 40.0", "departure_reaction_s"),
    "late": ("late_after_s = 15.0", "late_after_s = -1.0", "late_after_s"),
    "key": ("late_after_s = 15.0", "late_after = 15.0", "late_after"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes_of_styles_are_told_with_their_place(case: str, tmp_path: Path) -> None:
    old, new, told = MISTAKES[case]
    folder = styled(tmp_path / "small", scenario="")
    replace(folder, "scenario.toml", old, new)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert "scenario.toml" in str(caught.value)
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("0.5,4.8,40", "driven_speeds.csv: row 2, column end_km"),
        ("0.5,0.4,40", "driven_speeds.csv: row 2, column end_km"),
        ("0.5,0.8,3", "driven_speeds.csv: row 2, column speed_kmh"),
        ("0.5,0.8,40\n0.7,0.9,50", "driven_speeds.csv: row 3, column start_km"),
    ],
)
def test_driven_speeds_that_cannot_be_are_told_with_their_row(
    row: str, told: str, tmp_path: Path
) -> None:
    folder = styled(tmp_path / "small")
    (folder / "driven_speeds.csv").write_text(f"start_km,end_km,speed_kmh\n{row}\n", "utf-8")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert told in str(caught.value)


@pytest.fixture
def own_drivers(tmp_path: Path) -> study.Study:
    """Return a study of two controllers that are alike but for their drivers."""
    folder = two_controllers(tmp_path / "small")
    replace(folder, "scenario.toml", "seed = 7\n", 'seed = 7\ndriving = "normal"\n')
    replace(
        folder,
        "scenario.toml",
        "[controllers.second]\n",
        '[controllers.second]\ndriving = "fastest"\n',
    )
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write(GENTLE.replace("driven_speeds = true\n", ""))
    return study.choose(folder)


def test_a_controller_may_have_drivers_of_its_own(own_drivers: study.Study) -> None:
    records = [
        study.run_once(own_drivers.scenario, spec, 7, own_drivers.step_s)
        for spec in own_drivers.specs
    ]
    assert [record.world.driving.name for record in records] == ["normal", "fastest"]
    runs_s = [record.arrival_s[0, 1] - record.departure_s[0, 0] for record in records]
    assert runs_s[0] > runs_s[1] + 10.0
    assert all(record.violations == () for record in records)


def test_capacity_takes_the_drivers_of_each_controller(own_drivers: study.Study) -> None:
    assessed = assess_capacity(own_drivers, Check.NONE)
    assert assessed.failures == {}
    for found, spec in zip(assessed.assessments, own_drivers.specs, strict=True):
        world = study.world_of(own_drivers.scenario, own_drivers.step_s).driven_as(spec.driving)
        run_s = technical_run_times_s(world)[0, found.journey.row, 1]
        lasted_s = found.journey.arrival_s[1] - found.journey.departure_s[0]
        assert lasted_s == pytest.approx(run_s, abs=0.5)
    normal, fastest = (
        np.array([one.headway_s for one in a.headways]) for a in assessed.assessments
    )
    assert np.all(normal > fastest + 1.0)
