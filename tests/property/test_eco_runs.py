"""Runs of least energy against dynamic programming, and what holds for all of them."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.motion.eco_run import eco, net_energy_j
from kankaku.railway.motion.run_curve import fastest
from kankaku.railway.motion.way import Way, way_on
from kankaku.railway.plan.line import Gradient, Line, SpeedLimit
from kankaku.railway.plan.profile import build_profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.loading.load import load
from kankaku.testing.example_lines import commuter_train, straight_line
from tests.examples import all_if_deep, examples
from tests.property.dense_optimum import Optimum, dense_optimum
from tests.property.dense_run import dense_run, restrictions

MODEL = load(Path("scenarios/eco_driving"))
LEGS_M = ((0.0, 2360.0), (2360.0, 4150.0))
SUPPLEMENTS = (0.01, 0.0385, 0.1, 0.2)
SOME_SUPPLEMENTS = all_if_deep(SUPPLEMENTS, (0.01, 0.2))
"""The least and the most: what lies between is tried on random lines."""
END_M = 4000.0
ROUNDING_J = 1e-3 * 3.6e6
FEW = examples(4)
MANY = examples(25)


class Task(NamedTuple):
    """A run to be made from a speed to rest."""

    line: Line
    train: TrainType
    ends_m: tuple[float, float]
    start_mps: float = 0.0

    def way(self) -> Way:
        profile = build_profile(self.line, [self.train])
        return way_on(profile, 0, self.train, self.ends_m, (self.start_mps, 0.0))

    def optimum(self, added_s: float, *, cell_m: float = 5.0, speeds: int = 300) -> Optimum:
        return dense_optimum(
            self.line,
            self.train,
            self.ends_m,
            added_s,
            self.start_mps,
            cell_m=cell_m,
            speeds=speeds,
        )

    def moved_j(self) -> float:
        """Energy that the fastest run takes from the wire, the scale of errors. [J]"""
        supply = replace(self.train.supply, regeneration_efficiency=0.0)
        way = self._replace(train=replace(self.train, supply=supply)).way()
        return net_energy_j(way, fastest(way))


def without_regeneration(train: TrainType) -> TrainType:
    return replace(train, supply=replace(train.supply, regeneration_efficiency=0.0))


MODEL_TRAIN = MODEL.train_types["e233-1000"]


@st.composite
def tasks(draw: st.DrawFn, steepest_permil: int) -> Task:
    """Limits and gradients at tens of metres, which no way of tabulating them moves."""
    gradients, place = [], 0
    while place < END_M:
        end = min(place + 10 * draw(st.integers(15, 70)), round(END_M))
        permil = draw(st.integers(-steepest_permil, steepest_permil))
        gradients.append(Gradient(float(place), float(end), permil / 1000.0))
        place = end
    limits = [
        SpeedLimit(10.0 * start, min(10.0 * (start + cells), END_M), limit_mps)
        for start, cells, limit_mps in draw(
            st.lists(
                st.tuples(st.integers(0, 380), st.integers(2, 50), st.floats(5.0, 28.0)), max_size=4
            )
        )
    ]
    line = straight_line({"west": 300.0}, END_M, gradients, limits)
    start_m = 10.0 * draw(st.integers(0, 150))
    task = Task(line, commuter_train(), (start_m, start_m + 10.0 * draw(st.integers(40, 240))))
    share = draw(st.just(0.0) | st.floats(0.0, 0.95))
    greatest_mps = dense_run(task.line, task.train, task.ends_m).greatest_start_mps
    return task._replace(start_mps=share * greatest_mps)


@pytest.mark.parametrize("ends_m", LEGS_M)
@pytest.mark.parametrize("regenerates", [True, False], ids=["regenerating", "not regenerating"])
def test_least_energy_on_the_model_line_is_that_of_dynamic_programming(
    ends_m: tuple[float, float], regenerates: bool
) -> None:
    train = MODEL_TRAIN if regenerates else without_regeneration(MODEL_TRAIN)
    task = Task(MODEL.line, train, ends_m)
    way = task.way()
    shortest_s = fastest(way).run_time_s
    for supplement in SOME_SUPPLEMENTS:
        energy_j = net_energy_j(way, eco(way, (1.0 + supplement) * shortest_s).curve)
        optimum = task.optimum(supplement * shortest_s)
        assert energy_j == pytest.approx(optimum.net_j, rel=0.005)
        # No run at all can be below the bound, but for the width of the cells.
        assert energy_j >= 0.995 * optimum.bound_j


@pytest.mark.parametrize("supplement", [0.0385, 0.2])
def test_dynamic_programming_converges(supplement: float) -> None:
    task = Task(MODEL.line, MODEL_TRAIN, (3000.0, 3900.0))
    added_s = supplement * fastest(task.way()).run_time_s
    grids = ((10.0, 150), (5.0, 300), (2.5, 600))
    coarse_j, usual_j, fine_j = (
        task.optimum(added_s, cell_m=cell_m, speeds=speeds).net_j for cell_m, speeds in grids
    )
    assert coarse_j == pytest.approx(fine_j, rel=0.01)
    assert usual_j == pytest.approx(fine_j, rel=0.005)


@pytest.mark.parametrize("start_mps", [8.0, 16.0])
def test_least_energy_from_a_running_start_is_that_of_dynamic_programming(start_mps: float) -> None:
    task = Task(MODEL.line, MODEL_TRAIN, LEGS_M[0], start_mps)
    way = task.way()
    shortest_s = fastest(way).run_time_s
    energy_j = net_energy_j(way, eco(way, 1.0385 * shortest_s).curve)
    assert energy_j == pytest.approx(task.optimum(0.0385 * shortest_s).net_j, rel=0.005)


@FEW
@given(tasks(12), st.sampled_from(SUPPLEMENTS))
def test_least_energy_on_random_lines_is_that_of_dynamic_programming(
    task: Task, supplement: float
) -> None:
    task = task._replace(start_mps=0.0)
    way = task.way()
    shortest_s = fastest(way).run_time_s
    energy_j = net_energy_j(way, eco(way, (1.0 + supplement) * shortest_s).curve)
    optimum = task.optimum(supplement * shortest_s)
    # Downhill, what is brought back may leave next to nothing.
    assert energy_j == pytest.approx(optimum.net_j, rel=0.01, abs=0.005 * task.moved_j())


@MANY
@given(tasks(12), st.lists(st.floats(0.0, 0.2), min_size=2, max_size=4))
def test_from_rest_more_time_takes_less_energy(task: Task, supplements: list[float]) -> None:
    way = task._replace(start_mps=0.0).way()
    shortest_s = fastest(way).run_time_s
    energies_j = [net_energy_j(way, fastest(way))]
    for supplement in sorted(supplements):
        run_time_s = (1.0 + supplement) * shortest_s
        run = eco(way, run_time_s).curve
        energies_j.append(net_energy_j(way, run))
    # The tolerance of the time is worth most near the fastest run.
    slack_j = 0.004 * task.moved_j() + ROUNDING_J
    assert all(after <= before + slack_j for before, after in pairwise(energies_j))


@MANY
@given(tasks(35), st.floats(0.0, 1.0))
def test_a_run_meets_its_time_and_keeps_every_limit_and_its_brake_curves(
    task: Task, supplement: float
) -> None:
    way = task.way()
    quickest = fastest(way)
    run_time_s = (1.0 + supplement) * quickest.run_time_s
    run = eco(way, run_time_s).curve
    assert run.run_time_s == pytest.approx(run_time_s, abs=0.0101)
    assert np.all(0.5 * run.speed_mps[1:] ** 2 <= way.cap_m2ps2[1:] + 1e-9)
    assert run.speed_mps[0] == pytest.approx(task.start_mps)
    assert run.speed_mps[-1] == 0.0
    assert np.all(np.diff(run.time_s) > 0.0)
    assert np.all(np.diff(run.traction_work_j) >= 0.0)
    for enters_m, leaves_m, limit_mps in restrictions(task.line, task.train.length_m):
        on_it = (run.chainage_m[1:] >= enters_m) & (run.chainage_m[1:] <= leaves_m)
        assert np.all(run.speed_mps[1:][on_it] <= limit_mps + 1e-6)
