"""Energy-saving driving beside the published example of Kawashima's method."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest

from kankaku.railway.motion.eco_run import eco, net_energy_j
from kankaku.railway.motion.run_curve import fastest
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.line import Line, SpeedLimit
from kankaku.railway.plan.profile import build_profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.loading.load import load
from kankaku.testing.example_lines import straight_line

SUPPLEMENT = 0.0385
PUBLISHED_SAVING = 0.196
"""With 3.85 % more run time, on a model line that is not published."""
MODEL = load(Path("scenarios/eco_driving"))
TRAIN = MODEL.train_types["e233-1000"]
WITHOUT = replace(TRAIN, supply=replace(TRAIN.supply, regeneration_efficiency=0.0))
LEGS_M = ((0.0, 2360.0), (2360.0, 4150.0))


class Saving(NamedTuple):
    """Against the fastest run, as a share."""

    net: float
    traction: float


def saving(
    line: Line, train: TrainType, legs_m: tuple[tuple[float, float], ...], supplement: float
) -> Saving:
    spent, work = [0.0, 0.0], [0.0, 0.0]
    profile = build_profile(line, [train])
    for ends_m in legs_m:
        way = way_on(profile, 0, train, ends_m)
        quickest = fastest(way)
        relaxed = eco(way, (1.0 + supplement) * quickest.run_time_s).curve
        for place, run in enumerate((quickest, relaxed)):
            spent[place] += net_energy_j(way, run)
            work[place] += float(run.traction_work_j[-1])
    return Saving(1.0 - spent[1] / spent[0], 1.0 - work[1] / work[0])


@pytest.mark.parametrize("length_m", [1500.0, 2360.0, 4000.0, 8000.0, 15000.0])
def test_between_two_stops_without_limits_and_regeneration_it_saves_what_is_published(
    length_m: float,
) -> None:
    """The length of the published line is unknown; over a factor of ten it hardly matters."""
    level = straight_line({"west": 300.0}, length_m + 1000.0)
    found = saving(level, WITHOUT, ((300.0, 300.0 + length_m),), SUPPLEMENT)
    assert found.net == pytest.approx(PUBLISHED_SAVING, abs=0.04)
    assert found.net == pytest.approx(found.traction, abs=1e-6)


@pytest.mark.parametrize("train", [TRAIN, WITHOUT], ids=["regenerating", "not regenerating"])
def test_the_model_line_saves_more_than_is_published(train: TrainType) -> None:
    """Three limits to brake for and speed up after make the fastest run a wasteful one."""
    found = [saving(MODEL.line, train, LEGS_M, share) for share in (0.01, SUPPLEMENT, 0.1, 0.2)]
    assert found[0].net > PUBLISHED_SAVING
    assert found[1].net > 2.0 * PUBLISHED_SAVING
    assert all(after.net > before.net for before, after in pairwise(found))
    assert all(after.traction > before.traction for before, after in pairwise(found))


def test_every_limit_on_the_way_makes_the_saving_greater() -> None:
    places_m = (600.0, 1200.0, 1800.0)
    limits = [SpeedLimit(start_m, start_m + 200.0, 65.0 / 3.6) for start_m in places_m]
    lines = [straight_line({"west": 300.0}, 3500.0, (), limits[:count]) for count in range(4)]
    found = [saving(line, WITHOUT, ((300.0, 2660.0),), SUPPLEMENT).net for line in lines]
    assert all(after > before for before, after in pairwise(found))


def test_the_timetable_of_the_model_line_has_the_published_supplement() -> None:
    profile = build_profile(MODEL.line, [TRAIN])
    calls = MODEL.timetable.services[0].calls
    for ends_m, start, stop in zip(LEGS_M, calls[:-1], calls[1:], strict=True):
        shortest_s = fastest(way_on(profile, 0, TRAIN, ends_m)).run_time_s
        booked_s = stop.arrival_s - start.departure_s
        assert booked_s / shortest_s - 1.0 == pytest.approx(SUPPLEMENT, abs=0.0002)
