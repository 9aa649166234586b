"""Places and times of single trains as other simulators publish them, from trains as files say."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.run_curve import RunCurve, fastest_run
from kankaku.railway.plan.line import Gradient, Line, Section, SpeedLimit, Track
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.loading.load_stock import read_stock, to_train_types
from kankaku.scenarios.reading.files import Reader
from kankaku.testing.example_lines import straight_line

GRAVITY = 9.80665
BEFORE_M = 1000.0
"""The whole of a train stands on the line from the start. [m]"""


def trains_of(folder: Path, text: str) -> dict[str, TrainType]:
    """Return the train types of a file."""
    (folder / "rolling_stock.toml").write_text(text, encoding="utf-8")
    reader = Reader()
    stock = read_stock(reader, folder)
    assert stock is not None, reader.mistakes
    assert not reader.mistakes
    return dict(to_train_types(stock))


# Open Source Railway Designer, core/envelope-sim, SimpleRollingStock and MaxEffortEnvelopeTest:
# 850 t, 5 % of rotating mass, 400 m; force falls from 450 kN to 180 kN at 300 km/h.
OSRD = """\
schema_version = 1
brake_rate = "net"

[train.standard]
length_m = 400.0
mass_t = 850.0
rotating_mass_percent = 5.0
maximum_speed_kmh = 159.84         # the speed of the test, 44.4 m/s
service_brake_kmhps = 1.8

[train.standard.traction]
force_speed = [[0, 450], [300, 180]]

[train.standard.resistance]
a_n_per_t = 6.5
b_n_per_t_kmh = 0.08
c_n_per_t_kmh2 = 0.0012
"""
STOPS_M = 0.0, 6000.0, 10_000.0


@pytest.mark.parametrize(
    ("permil", "turns_m"),
    [(0.0, ((2726.0, 4029.0), (8292.0,))), (20.0, ((4380.0,), (8827.0,)))],
)
def test_top_speed_and_braking_begin_where_osrd_has_them(
    tmp_path: Path, permil: float, turns_m: tuple[tuple[float, ...], ...]
) -> None:
    (train,) = trains_of(tmp_path, OSRD).values()
    end_m = BEFORE_M + STOPS_M[-1]
    line = straight_line({"a": BEFORE_M}, end_m, [Gradient(0.0, end_m, permil / 1000.0)])
    for (start_m, stop_m), wanted_m in zip(pairwise(STOPS_M), turns_m, strict=True):
        run = fastest_run(line, train, BEFORE_M + start_m, BEFORE_M + stop_m)
        at_top = np.flatnonzero(run.speed_mps > run.speed_mps.max() - 1e-6)
        first_m, last_m = run.chainage_m[at_top[[0, -1]]] - BEFORE_M
        assert first_m == pytest.approx(wanted_m[0], abs=2.0)
        assert last_m == pytest.approx(wanted_m[-1], abs=2.0)


# railtoolkit, TrainRuns.jl, test/data and test/snapshots/default: force by speed [km/h, kN].
LOCAL = """[
  [0, 94.4], [1, 94.4], [10, 80.0], [11, 78.16], [32, 38.89], [36, 35.77], [37, 35.6], [42, 35.6],
  [43, 35.55], [46, 34.74], [47, 34.28], [48, 33.56], [49, 32.88], [50, 32.22], [51, 31.59],
  [52, 26.3], [56, 26.3], [57, 25.99], [63, 25.09], [64, 25.14], [66, 24.38], [68, 23.66],
  [69, 23.32], [70, 22.99], [71, 19.4], [80, 19.4], [81, 19.44], [85, 18.92], [86, 18.67],
  [88, 18.25], [89, 15.36], [110, 14.31], [111, 14.46], [112, 14.34], [114, 14.08],
  [117, 13.72], [118, 13.61], [119, 13.49], [120, 13.38],
]"""
FREIGHT = """[
  [0, 186.94], [1, 186.94], [8, 154.53], [9, 149.24], [10, 144.12], [12, 134.34], [14, 125.2],
  [16, 116.68], [18, 108.79], [20, 101.53], [22, 94.84], [24, 88.7], [26, 83.11], [28, 78.07],
  [30, 73.58], [31, 71.6], [33, 67.77], [35, 64.13], [37, 60.67], [39, 57.4], [41, 54.3],
  [43, 51.39], [45, 48.66], [46, 48.08], [48, 46.38], [50, 44.73], [53, 42.37], [56, 40.14],
  [59, 38.04], [62, 36.07], [65, 34.23], [68, 32.52], [71, 30.94], [74, 29.49], [77, 28.17],
  [80, 26.98],
]"""


class Consist(NamedTuple):
    """A traction unit and its wagons; resistances in permil of weight, air at 100 km/h."""

    unit_t: float
    driven_t: float
    unit_permil: tuple[float, float, float]
    """Of driven and of other axles, and of air."""
    wagons_t: float
    wagon_permil: tuple[float, float, float]
    """Constant, linear and square."""
    headwind_kmh: float
    """In the air resistance of wagons; of the unit it is 15 km/h always."""

    def coefficients(self) -> tuple[float, float, float]:
        """Return what a, b and c are. [N], [N s/m], [N s2/m2]."""
        terms = [GRAVITY * self.driven_t * self.unit_permil[0], 0.0, 0.0]
        terms[0] += GRAVITY * (self.unit_t - self.driven_t) * self.unit_permil[1]
        terms[0] += GRAVITY * self.wagons_t * self.wagon_permil[0]
        terms[1] += GRAVITY * self.wagons_t * self.wagon_permil[1] / (100.0 / 3.6)
        for mass_t, permil, wind_kmh in (
            (self.unit_t, self.unit_permil[2], 15.0),
            (self.wagons_t, self.wagon_permil[2], self.headwind_kmh),
        ):
            square = GRAVITY * mass_t * permil / (100.0 / 3.6) ** 2
            wind_mps = wind_kmh / 3.6
            terms[0] += square * wind_mps**2
            terms[1] += 2.0 * square * wind_mps
            terms[2] += square
        return terms[0], terms[1], terms[2]


CONSISTS = {
    "local": Consist(68.0, 45.333, (3.0, 1.4, 3.9), 0.0, (0.0, 0.0, 0.0), 0.0),
    "longdistance": Consist(85.0, 85.0, (2.5, 0.0, 6.0), 358.0, (2.0, 0.715, 3.64), 15.0),
    "freight": Consist(80.0, 80.0, (2.2, 0.0, 10.0), 840.0, (1.4, 0.0, 3.9), 0.0),
}
FIGURES = {
    # Length, mass, rotating mass, greatest speed, deceleration.
    "local": (41.7, 88.0, 8.0, 120.0, 0.4253),
    "longdistance": (153.37, 443.0, 6.7434, 160.0, 0.375),
    "freight": (204.72, 920.0, 4.4545, 80.0, 0.225),
}
TRACTION = {
    "local": f"force_speed = {LOCAL}",
    # 19,950 kN km/h from 66.5 km/h on.
    "longdistance": "starting_force_kn = 300.0\npower_kw = 5541.667",
    "freight": f"force_speed = {FREIGHT}",
}
LIMITS = (
    *((0.0, 160.0), (3000.0, 60.0), (4000.0, 160.0), (5000.0, 60.0), (6000.0, 160.0)),
    *((6500.0, 60.0), (6700.0, 65.0), (6800.0, 70.0), (7000.0, 120.0)),
)
"""From where on which limit holds. [m], [km/h]"""
SLOPES = (
    *((0.0, 0.0), (1000.0, 1.0), (2000.0, 2.0), (3000.0, 5.0), (4000.0, -3.0), (5000.0, 5.0)),
    *((6000.0, -10.0), (7000.0, 15.0), (8000.0, -10.0), (8500.0, 20.0), (9000.0, 0.0)),
)
"""[m], [permil]"""
WAY_M = 10_000.0


def file_of(name: str) -> str:
    """Return a train of TrainRuns.jl as a file."""
    length_m, mass_t, rotating_percent, fastest_kmh, brake_mps2 = FIGURES[name]
    a_n, b_nspm, c_ns2pm2 = CONSISTS[name].coefficients()
    return f"""\
schema_version = 1
brake_rate = "net"

[train.{name}]
length_m = {length_m}
mass_t = {mass_t}
rotating_mass_percent = {rotating_percent}
maximum_speed_kmh = {fastest_kmh}
service_brake_kmhps = {3.6 * brake_mps2}

[train.{name}.traction]
{TRACTION[name]}

[train.{name}.resistance]
a_n = {a_n}
b_nspm = {b_nspm}
c_ns2pm2 = {c_ns2pm2}
"""


def line_of(path: str) -> Line:
    """Return a way of TrainRuns.jl, with level track before it for the train to stand on."""
    track = Track("main", -BEFORE_M, WAY_M)
    line = straight_line({"a": 0.0}, WAY_M)
    line = replace(line, sections=(Section(-BEFORE_M, WAY_M, (track,)),))
    if path == "slope":
        ends_m = [*(start_m for start_m, _ in SLOPES[1:]), WAY_M]
        hills = tuple(
            Gradient(start_m, end_m, permil / 1000.0)
            for (start_m, permil), end_m in zip(SLOPES, ends_m, strict=True)
        )
        return replace(line, gradients=hills)
    if path == "speed":
        ends_m = [*(start_m for start_m, _ in LIMITS[1:]), WAY_M]
        limits = tuple(
            SpeedLimit(start_m, end_m, limit_kmh / 3.6)
            for (start_m, limit_kmh), end_m in zip(LIMITS, ends_m, strict=True)
        )
        return replace(line, limits=limits)
    return line


STEP_M = 0.1


def integrated_s(train: TrainType, line: Line) -> float:
    """Integrate the fastest run by tenths of a metre, the train a strip, its brake a net one."""
    at_m = np.arange(0.0, WAY_M + 0.5 * STEP_M, STEP_M)
    middle_m = at_m[:-1] + 0.5 * STEP_M
    pull_mps2 = GRAVITY * train.mass_kg * strip_slopes(line, middle_m, train.length_m)
    square = np.full(at_m.size, train.maximum_speed_mps**2)
    for limit in line.limits:
        # From the front's coming to the tail's leaving.
        on_it = (at_m > limit.start_m + 1e-6) & (at_m < limit.end_m + train.length_m - 1e-6)
        square[on_it] = np.minimum(square[on_it], limit.limit_mps**2)
    square[-1] = 0.0
    for place in range(at_m.size - 2, -1, -1):
        braked = square[place + 1] + 2.0 * train.service_brake_mps2 * STEP_M
        square[place] = min(square[place], braked)
    inertia_kg = train.mass_kg * (1.0 + train.rotating_mass_ratio)
    speeds = np.arange(0.0, train.maximum_speed_mps + 0.02, 0.005)
    forces_n = train.traction.force_n(speeds)
    resistance = train.resistance
    forces_n -= resistance.a_n + resistance.b_nspm * speeds + resistance.c_ns2pm2 * speeds**2

    def gained(now: float, cell: int) -> float:
        force_n = forces_n[min(int(np.sqrt(max(now, 0.0)) / 0.005 + 0.5), speeds.size - 1)]
        return float(2.0 * STEP_M * (force_n - pull_mps2[cell]) / inertia_kg)

    time_s, now = 0.0, 0.0
    for cell in range(at_m.size - 1):
        half = now + 0.5 * gained(now, cell)
        after = min(max(now + gained(half, cell), 0.0), square[cell + 1])
        time_s += 2.0 * STEP_M / (np.sqrt(now) + np.sqrt(after))
        now = after
    return time_s


def strip_slopes(line: Line, front_m: FloatArray, length_m: float) -> FloatArray:
    """Return the gradient averaged over a train, from the share of it on each stretch."""
    slopes = np.zeros(front_m.size)
    for hill in line.gradients:
        on_it_m = np.minimum(front_m, hill.end_m) - np.maximum(front_m - length_m, hill.start_m)
        slopes += hill.gradient * np.maximum(on_it_m, 0.0) / length_m
    return slopes


def run_on(folder: Path, train: str, path: str) -> tuple[RunCurve, TrainType, Line]:
    kind, line = trains_of(folder, file_of(train))[train], line_of(path)
    return fastest_run(line, kind, 0.0, WAY_M), kind, line


@pytest.mark.parametrize(
    ("train", "path", "published_s"),
    [
        ("local", "const", 391.62),
        ("local", "slope", 395.52),
        ("local", "speed", 523.31),
        ("longdistance", "const", 330.75),
        ("longdistance", "slope", 331.61),
        ("longdistance", "speed", 501.02),
        ("freight", "const", 745.07),
        ("freight", "slope", 840.82),
        ("freight", "speed", 750.45),
    ],
)
def test_ten_kilometres_take_as_long_as_train_runs_says(
    tmp_path: Path, train: str, path: str, published_s: float
) -> None:
    # Theirs is an Euler step of 20 m with the train as a point; at 0.05 m "local" takes 393.87 s.
    run, kind, line = run_on(tmp_path, train, path)
    assert run.run_time_s == pytest.approx(published_s, rel=6e-3)
    assert run.run_time_s == pytest.approx(integrated_s(kind, line), rel=1e-4)
