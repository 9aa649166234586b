"""What a train file may say about physics: each way of saying it, its defaults and its mistakes."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.line import TrackCurve
from kankaku.railway.plan.rolling_stock import (
    ForceTable,
    RunningResistance,
    Traction,
    TrainType,
    handbook_resistance,
)
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.testing.example_lines import straight_line
from tests.unit.scenario_folder import FILES, write_scenario

STOCK = FILES["rolling_stock.toml"]
THREE_REGIONS = "starting_force_kn = 335.0\npower_speed_kmh = 40.0\ncharacteristic_speed_kmh = 75.0"
NEW = """\
schema_version = 1

[train.unit]
length_m = 200.0
mass_t = 440.0
maximum_speed_kmh = 90.0
service_brake_kmhps = 3.0

[train.unit.traction]
starting_force_kn = 335.0
power_kw = 3600.0
"""
PER_MPS = 3.6


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def train_of(folder: Path, stock: str) -> TrainType:
    (folder / "rolling_stock.toml").write_text(stock, encoding="utf-8")
    return load(folder).train_types["unit"]


def mistakes_in(folder: Path, stock: str) -> dict[str, Mistake]:
    (folder / "rolling_stock.toml").write_text(stock, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    return {mistake.where: mistake for mistake in caught.value.mistakes}


def with_resistance(*lines: str) -> str:
    """Return the usual train with coefficients instead of the handbook's formula."""
    table = "\n".join(("\n[train.unit.resistance]", *lines, ""))
    return STOCK.replace("motor_mass_t = 270.0\n", "") + table


def with_traction(text: str) -> str:
    assert THREE_REGIONS in STOCK
    return STOCK.replace(THREE_REGIONS, text)


def test_a_new_train_needs_five_figures(folder: Path) -> None:
    train = train_of(folder, NEW)
    assert train.cars == 10
    assert train.rotating_mass_ratio == 0.08
    assert train.resistance == handbook_resistance(220e3, 220e3, 10)
    assert train.emergency_brake_mps2 == pytest.approx(1.2 * train.service_brake_mps2)
    assert train.curve_resistance_m == 0.6
    assert not train.net_brake
    supply = train.supply
    assert (supply.traction_efficiency, supply.regeneration_efficiency) == (0.85, 0.8)
    assert supply.regeneration_force_n == 335e3
    assert supply.regeneration_power_w == pytest.approx(3.6e6)
    assert (supply.regeneration_cutoff_mps, supply.auxiliary_w) == (5.0 / 3.6, 150e3)


def test_whatever_a_new_train_says_holds_instead_of_the_default(folder: Path) -> None:
    said = "\ncars = 8\nemergency_brake_kmhps = 4.0\nmotor_mass_t = 200.0\n"
    stock = NEW.replace("\nlength_m", f"{said}length_m")
    supply = "\n[train.unit.supply]\nauxiliary_kw = 0.0\nregeneration_force_kn = 0.0\n"
    train = train_of(folder, stock + supply + "regeneration_power_kw = 1000.0\n")
    assert train.resistance == handbook_resistance(200e3, 240e3, 8)
    assert train.emergency_brake_mps2 == pytest.approx(4.0 / 3.6)
    assert (train.supply.auxiliary_w, train.supply.regeneration_force_n) == (0.0, 0.0)
    assert train.supply.regeneration_power_w == 1e6


@pytest.mark.parametrize(("length_m", "cars"), [(10.0, 1), (45.0, 2), (165.0, 8)])
def test_cars_are_taken_as_twenty_metres_long(folder: Path, length_m: float, cars: int) -> None:
    stock = NEW.replace("length_m = 200.0", f"length_m = {length_m}")
    assert train_of(folder, stock).cars == cars


def test_two_figures_of_traction_are_force_and_power(folder: Path) -> None:
    traction = train_of(folder, NEW).traction
    speeds = np.array([0.0, 5.0, 3600.0 / 335.0, 20.0, 25.0])
    forces_n = np.minimum(335e3, 3.6e6 / np.maximum(speeds, 1e-9))
    assert traction.force_n(speeds) == pytest.approx(forces_n)
    assert traction.bends_mps == pytest.approx((3600.0 / 335.0,))


def test_a_power_may_end_at_a_characteristic_speed(folder: Path) -> None:
    told = "starting_force_kn = 335.0\npower_kw = 3600.0\ncharacteristic_speed_kmh = 72.0"
    traction = train_of(folder, with_traction(told)).traction
    assert traction == Traction(335e3, 3600.0 / 335.0, 20.0)
    force_n = traction.force_n(np.array([25.0]))[0]
    assert force_n == pytest.approx(3.6e6 / 25.0 * 20.0 / 25.0)


def test_a_table_of_forces_is_linear_between_its_speeds(folder: Path) -> None:
    told = "force_speed = [[0, 335], [40.0, 335], [90, 148]]"
    traction = train_of(folder, with_traction(told)).traction
    assert traction == ForceTable((0.0, 40.0 / 3.6, 25.0), (335e3, 335e3, 148e3))
    assert traction.starting_force_n == 335e3
    forces_n = traction.force_n(np.array([0.0, 40.0, 65.0, 90.0, 120.0]) / 3.6)
    assert forces_n == pytest.approx([335e3, 335e3, 241.5e3, 148e3, 148e3])


def test_what_a_brake_brings_back_at_most_is_what_a_table_gives_at_most(folder: Path) -> None:
    stock = NEW.replace("starting_force_kn = 335.0\npower_kw = 3600.0", "force_speed = []")
    told = "force_speed = [[0, 300], [60, 300], [90, 100]]"
    supply = train_of(folder, stock.replace("force_speed = []", told)).supply
    # Force falls by 20/3 kN in 1 km/h: F v has its peak where it begins to.
    assert supply.regeneration_power_w == pytest.approx(300e3 * 60.0 / 3.6)
    assert supply.regeneration_force_n == 300e3


@pytest.mark.parametrize(
    ("told", "wanted"),
    [
        (("a_n = 5525", "b_nspm = 244.8", "c_ns2pm2 = 13.2"), (5525.0, 244.8, 13.2)),
        (
            ("a_kn = 5.525", "b_kn_per_kmh = 0.068", "c_kn_per_kmh2 = 0.001"),
            (5525.0, 68.0 * PER_MPS, PER_MPS**2),
        ),
        (
            ("a_n_per_t = 20.0", "b_n_per_t_kmh = 0.1", "c_n_per_t_kmh2 = 0.002"),
            (8800.0, 44.0 * PER_MPS, 0.88 * PER_MPS**2),
        ),
        (("a_n_per_t = 20.0",), (8800.0, 0.0, 0.0)),
        (("c_ns2pm2 = 10",), (0.0, 0.0, 10.0)),
    ],
)
def test_running_resistance_in_three_families_of_units(
    folder: Path, told: tuple[str, ...], wanted: tuple[float, float, float]
) -> None:
    resistance = train_of(folder, with_resistance(*told)).resistance
    assert isinstance(resistance, RunningResistance)
    found = resistance.a_n, resistance.b_nspm, resistance.c_ns2pm2
    assert found == pytest.approx(wanted)


def test_curves_resist_by_the_constant_of_the_train(folder: Path) -> None:
    stock = STOCK.replace("cars = 10", "cars = 10\ncurve_resistance_permil_m = 800.0")
    train = train_of(folder, stock)
    assert train.curve_resistance_m == pytest.approx(0.8)
    line = straight_line({"west": 300.0}, 2000.0)
    curved = line.__class__(**{**line.__dict__, "curves": (TrackCurve(0.0, 2000.0, 400.0),)})
    drag = curved.curve_resistance_mps2(np.array([1000.0]), curve_resistance_m=0.8)
    assert drag == pytest.approx(9.80665 * 2e-3)


@pytest.mark.parametrize(("told", "net"), [("level", False), ("net", True)])
def test_a_file_says_how_its_brake_rates_are_meant(folder: Path, told: str, net: bool) -> None:
    stock = STOCK.replace("schema_version = 1", f'schema_version = 1\nbrake_rate = "{told}"')
    assert train_of(folder, stock).net_brake is net


@pytest.mark.parametrize(
    ("stock", "where", "problem", "allowed"),
    [
        (
            STOCK.replace("schema_version = 1", 'schema_version = 1\nbrake_rate = "nett"'),
            "brake_rate",
            "'nett'",
            "level or net",
        ),
        (
            STOCK + "\n[train.unit.resistance]\na_n = 5000.0\n",
            "train.unit.motor_mass_t",
            "stands beside resistance",
            "one of the two",
        ),
        (with_resistance(), "train.unit.resistance", "has no coefficient", "a_kn, b_kn_per_kmh"),
        (
            with_resistance("a_n = 5000.0", "b_kn_per_kmh = 0.1"),
            "train.unit.resistance.b_kn_per_kmh",
            "stands beside a_n",
            "only a_n, b_nspm, c_ns2pm2",
        ),
        (
            with_resistance("a_kn = 5.0", "c_n_per_t_kmh2 = 0.1"),
            "train.unit.resistance.c_n_per_t_kmh2",
            "stands beside a_kn",
            "only a_kn",
        ),
        (with_resistance("a_n = -1.0"), "train.unit.resistance.a_n", "-1.0", "from 0"),
        (with_resistance("d_n = 1.0"), "train.unit.resistance.d_n", "unknown key", "'a_n'"),
        (
            with_traction("power_kw = 3600.0"),
            "train.unit.traction.starting_force_kn",
            "is missing",
            "force_speed alone",
        ),
        (
            with_traction("starting_force_kn = 335.0"),
            "train.unit.traction.power_kw",
            "is missing",
            "power_speed_kmh",
        ),
        (
            with_traction(f"{THREE_REGIONS}\npower_kw = 3600.0"),
            "train.unit.traction.power_kw",
            "stands beside power_speed_kmh",
            "power_kw or power_speed_kmh",
        ),
        (
            with_traction(
                "starting_force_kn = 360.0\npower_kw = 3600.0\ncharacteristic_speed_kmh = 30.0"
            ),
            "train.unit.traction.characteristic_speed_kmh",
            "30 lies below the speed of power_kw",
            "from 36",
        ),
        (
            with_traction("starting_force_kn = 335.0\nforce_speed = [[0, 335], [90, 148]]"),
            "train.unit.traction.starting_force_kn",
            "stands beside force_speed",
            "alone",
        ),
        (
            with_traction("force_speed = [[0, 335], [80, 148]]"),
            "train.unit.traction.force_speed",
            "ends at 80 km/h, below maximum_speed_kmh",
            "from 90",
        ),
        (
            with_traction("force_speed = [[5, 335], [90, 148]]"),
            "train.unit.traction.force_speed",
            "begins at 5 km/h",
            "0",
        ),
        (
            with_traction("force_speed = [[0, 335], [40, 300], [40, 200], [90, 148]]"),
            "train.unit.traction.force_speed",
            "40 km/h stands behind 40 km/h",
            "rising",
        ),
        (
            with_traction("force_speed = [[0, 0], [90, 148]]"),
            "train.unit.traction.force_speed",
            "no force at the start",
            "above 0",
        ),
        *(
            (
                with_traction(f"force_speed = {value}"),
                "train.unit.traction.force_speed",
                "is not allowed",
                "a list of [km/h, kN]",
            )
            for value in (
                "335.0",
                '"fast"',
                "[0, 335]",
                "[[0, 335, 1]]",
                '[[0, "strong"]]',
                "[[0, nan], [90, 1]]",
                "[[0, 335], [90, -1]]",
                "[[0, 335], [500, 1]]",
            )
        ),
        (
            STOCK.replace("cars = 10", "cars = 10\ncurve_resistance_permil_m = 5000.0"),
            "train.unit.curve_resistance_permil_m",
            "5000.0",
            "up to 2000",
        ),
        (
            STOCK.replace("length_m = 200.0", "length_m = 901.0"),
            "train.unit.length_m",
            "901.0",
            "up to 900",
        ),
    ],
)
def test_contradictions_are_told_by_their_key(
    folder: Path, stock: str, where: str, problem: str, allowed: str
) -> None:
    found = mistakes_in(folder, stock)
    assert list(found) == [where]
    assert problem in found[where].problem
    assert allowed in found[where].allowed


def test_who_is_too_weak_is_told_by_the_key_that_the_file_has(folder: Path) -> None:
    stock = with_traction("force_speed = [[0, 5], [90, 1]]")
    (found,) = mistakes_in(folder, stock).values()
    assert found.where == "train.unit.traction.force_speed"
    assert "do not start the train" in found.problem
