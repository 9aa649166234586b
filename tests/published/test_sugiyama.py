"""Sugiyama et al. 2018: radio load (table 2) and availability (tables 4 to 6)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kankaku.analysis.saved_run import SavedRun, Trip
from kankaku.analysis.tables.dependability import HOUR_S, ROWS, Endurance
from kankaku.analysis.tables.radio_tables import LoadCase
from kankaku.railway.failures.availability import (
    Configuration,
    availability,
    estimate,
    simulate_outages,
)
from kankaku.railway.failures.fault_tree import joint_probability, minimal_cut_sets, top_probability
from kankaku.railway.motion.journey import booked_journey
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.radio.cells import Link
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.dependability_files import load_configurations, load_fault_tree
from kankaku.scenarios.reading.radio_network import load_radio_plan
from kankaku.studies import study
from kankaku.studies.radio_study import EvenTrains, FullCell, Question, perform

FOLDER = Path(__file__).parents[2] / "scenarios" / "rush_hour"
MAP = FOLDER.parent / "control_map"
YEARS = 100_000
WIRED = (Link.CONTROLLER_SWITCH, Link.SWITCH_CONTROLLER, Link.SWITCH_UNIT, Link.UNIT_SWITCH)
RADIO = (Link.ANTENNA_TRAIN, Link.TRAIN_ANTENNA)
SYSTEMS = {system.name: system for system in load_configurations(MAP)[0]}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(FOLDER)


@pytest.fixture(scope="module")
def question(scenario: Scenario) -> Question:
    """The network of the paper with one booked trip over the whole line."""
    world = study.world_of(scenario, scenario.step_s)
    rows = [row for row in range(world.size) if world.timetable.services[row].origin == "omiya"]
    journey = booked_journey(world, world.profile, rows[len(rows) // 2])
    time_s = np.arange(journey.time_s[0], journey.time_s[-1], 1.0)
    trip = Trip(time_s, journey.at(time_s)[0])
    run = SavedRun(FOLDER, "booked", scenario.seed, "", "", (trip,))
    return Question(load_radio_plan(FOLDER, scenario.line), run, scenario.seed)


@pytest.fixture(scope="module")
def cases(question: Question) -> dict[int, LoadCase]:
    found = {}
    for trains in (8, 30):
        case = perform(question, EvenTrains(0, trains))
        assert isinstance(case, LoadCase)
        found[trains] = case
    return found


@pytest.mark.parametrize("trains", [8, 30])
def test_utilisations_are_about_as_published(cases: dict[int, LoadCase], trains: int) -> None:
    case = cases[trains]
    assert case.published is not None
    for kinds, points in ((WIRED, 0.5), (RADIO, 2.0)):
        for kind in kinds:
            ours = 100.0 * case.traffic.utilisation(kind)
            assert ours == pytest.approx(100.0 * case.published.utilisation[kind], abs=points), kind


@pytest.mark.parametrize("trains", [8, 30])
def test_round_trips_take_about_as_long_as_published(
    cases: dict[int, LoadCase], trains: int
) -> None:
    round_trips_s = cases[trains].traffic.round_trips_s
    assert round_trips_s.mean() == pytest.approx(0.9, abs=0.1)
    assert round_trips_s.max() == pytest.approx(1.17, abs=0.1)


@pytest.mark.parametrize(("kind", "published"), [(RADIO[0], 32.9 - 21.6), (RADIO[1], 23.0 - 11.3)])
def test_the_slope_is_commands_times_units_times_airtime(
    cases: dict[int, LoadCase], kind: Link, published: float
) -> None:
    few, many = cases[8], cases[30]
    rise = many.traffic.utilisation(kind) - few.traffic.utilisation(kind)
    # Two commands a second of 22.5 ms by each radio unit that serves a train, over ten cells.
    explained = 22 * 2 * many.units_per_train * 0.0225 / 10
    assert rise == pytest.approx(explained, rel=0.01)
    assert 100.0 * rise == pytest.approx(published, abs=0.7)


def test_no_command_is_late(cases: dict[int, LoadCase]) -> None:
    # Greatest delay from the making of a command to the train, section 3.1.3.
    assert all(case.traffic.delays_s.max() <= 2.0 for case in cases.values())


def test_the_conventional_telegram_is_as_much_shorter_as_published(question: Question) -> None:
    central, conventional = question.plan.systems
    assert central.radio_packet_bytes / conventional.radio_packet_bytes == pytest.approx(2.5)
    # 36 devices against 16: "about 2.3 times the slots"; 16 trains per base unit, section 3.1.1.
    assert conventional.trains_per_cell == 16
    assert 2.2 <= (16 + central.trackside_devices_max) / 16 <= 2.3


def test_the_published_greatest_cell_is_too_much_for_two_commands_a_second(
    question: Question,
) -> None:
    """A finding: 16 trains and 20 devices fit at one command a second, not at the slope's two."""
    points = perform(question, FullCell(0, 20))
    assert isinstance(points, tuple)
    late = [point.trains for point in points if point.late > 0.0]
    assert min(late) == 10
    once = replace(question.plan.systems[0], updates_per_cycle=1, trackside_devices=20)
    assert once.trains_per_cell >= 16


@pytest.mark.parametrize("indicator", ROWS)
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_published_availability_to_its_printed_digits(name: str, indicator: str) -> None:
    system = SYSTEMS[name]
    decimals = ROWS[indicator][1]
    ours = Endurance(system, simulate_outages(system, 2, 1)).told[indicator]
    assert f"{ours:.{decimals}f}" == f"{system.published[indicator]:.{decimals}f}"


PRINTED = {
    "conventional": (1.49, 1.58, 1.06, 99.982),
    "central": (1.23, 1.40, 1.14, 99.984),
    "duplicated": (1.40, 1.40, 1.00, 99.984),
    "non_fail_safe_logic": (1.28, 1.52, 1.18, 99.983),
    "three_areas": (1.40, 1.28, 0.92, 99.985),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_file_holds_the_figures_of_table_6(name: str) -> None:
    assert tuple(SYSTEMS[name].published[indicator] for indicator in ROWS) == PRINTED[name]


@pytest.mark.parametrize(
    ("name", "devices"),
    [
        ("conventional", 17.0),
        ("central", 14.0),
        ("duplicated", 16.0),
        ("non_fail_safe_logic", 14.7),
        ("three_areas", 16.0),
    ],
)
def test_the_file_holds_the_devices_of_table_4(name: str, devices: float) -> None:
    assert round(sum(group.count for group in SYSTEMS[name].groups), 1) == devices


def test_seven_tenths_of_a_controller_are_two_thirds() -> None:
    """A finding: with the printed 0.7 there would be 1.29 failures a year, not the printed 1.28."""
    system = SYSTEMS["non_fail_safe_logic"]
    printed = replace(
        system,
        groups=tuple(
            replace(group, count=0.7) if group.device == "controller" else group
            for group in system.groups
        ),
    )
    assert f"{availability(printed).failures_per_year:.2f}" == "1.29"
    assert f"{availability(system).failures_per_year:.2f}" == "1.28"


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS)
def test_simulated_years_agree_with_the_closed_form(
    scenario: Scenario, system: Configuration
) -> None:
    years = simulate_outages(system, YEARS, scenario.seed)
    exact = availability(system)
    for values, expected in (
        (years.failures, exact.failures_per_year),
        (years.stopped_s / HOUR_S, exact.stopped_s_per_year / HOUR_S),
    ):
        found = estimate(values)
        assert abs(found.mean - expected) <= found.half_width


def test_no_single_failure_mode_brings_about_a_top_event() -> None:
    # Section 3.2.2: for every cause there is a countermeasure.
    tree = load_fault_tree(MAP)
    assert tree is not None
    assert set(tree.tops) == {"collision", "derailment"}
    for top in tree.tops:
        sets = minimal_cut_sets(tree, top)
        assert min(map(len, sets)) >= 3
        assert sum(joint_probability(tree, it) for it in sets) == pytest.approx(
            top_probability(tree, top), rel=1e-6
        )
