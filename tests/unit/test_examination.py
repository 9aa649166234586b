"""The monitor's compiled pass against the same rules in plain numbers, on random blocks."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.rolling_stock import ForceTable
from kankaku.railway.plan.world import World
from kankaku.railway.safety.examination import PLACES, Clear, breaches
from kankaku.railway.safety.rules import KINDS
from kankaku.railway.safety.survey import survey_of
from kankaku.railway.safety.terms import Terms, terms_of
from kankaku.railway.safety.train_steps import TrainSteps
from kankaku.railway.step.control import Separation
from kankaku.railway.step.promises import Promises
from kankaku.scenarios.loading.load import load
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.unit.plain_rules import excesses

NETWORK = Path(__file__).parents[2] / "scenarios" / "binding_network"
STEPS = 60
TABLE = ForceTable((0.0, 8.0, 25.0), (300e3, 280e3, 90e3))
BUFFERS = Buffers(0.02, 1.5, 2.0, (-300.0, 0.0, 250.0, 700.0, 1100.0))
RADIO = Promises(25.0, BUFFERS, exclusive_platform=True, validity_s=3.0)
BLOCKS = Promises(10.0, idle_time_s=2.0)


def chain(**changed: Any) -> World:  # noqa: ANN401 - fields of a train type
    """Four trains on a hilly line with limits; every train its own kind of brakes."""
    scenario = two_station_scenario(
        4,
        gradients=(Gradient(100.0, 600.0, 0.02), Gradient(600.0, 1250.0, -0.035)),
        limits=(SpeedLimit(300.0, 500.0, 12.0), SpeedLimit(450.0, 900.0, 15.0)),
        block_m=200.0,
    )
    kinds = {name: replace(kind, **changed) for name, kind in scenario.train_types.items()}
    return world_of(replace(scenario, train_types=kinds))


def random_block(world: World, terms: Terms, rng: np.random.Generator) -> tuple[TrainSteps, Clear]:
    """Trains that go about as trains do, and now and then do not."""
    rows = np.sort(rng.choice(world.size, 3, replace=False)).astype(np.intp)
    shape = rows.size, STEPS + 1
    speed_mps = np.clip(np.cumsum(rng.normal(0.0, 0.5 * terms.step_s, shape), axis=1) + 12.0, 0, 30)
    speed_mps[:, 20:24] = 0.0
    gone_m = np.cumsum(speed_mps, axis=1) * terms.step_s
    front_m = world.stop_m[rows, :1] + gone_m + rng.uniform(-200.0, 700.0, (rows.size, 1))
    flags = rng.random((8, *shape)) < 0.3
    present = ~(flags[0] & flags[1])[:, 1:]
    moving = present & ~(flags[2] & flags[3])[:, 1:]
    time_s = 100.0 + terms.step_s * np.arange(STEPS + 1, dtype=np.float64)
    way_m = 0.5 * np.square(speed_mps) + rng.normal(0.0, 40.0, shape)
    steps = TrainSteps(
        rows,
        time_s,
        front_m,
        speed_mps,
        front_m + way_m,
        rng.uniform(0.0, float(terms.delay_s > 0.0), shape),
        rng.integers(0, 2, shape).astype(np.intp),
        flags[4] & flags[5],
        present,
        moving,
        moving & flags[6][:, 1:] & flags[7][:, 1:],
        time_s - rng.uniform(0.0, 6.0, shape),
        flags[0] & flags[7],
    )
    ahead_m = [front_m + way_m + rng.normal(40.0, 30.0, shape) for _ in range(5)]
    ahead_m[1][:, :10] = world.far_m
    return steps, Clear(*ahead_m[:2], *(places[:, 1:].copy() for places in ahead_m[2:]))


Case = tuple[World, Terms]


def case(name: str) -> Case:
    """A world, what keeps its trains apart and what is promised."""
    apart = {"by brakes": Separation.BRAKING, "blocks": Separation.BLOCKS}
    promises = {"standing": Promises(25.0), "blocks": BLOCKS, "bare safety": None}
    changed: dict[str, dict[str, Any]] = {
        "net brake": {"traction": TABLE, "net_brake": True, "brake_build_up_s": 2.0},
        "by brakes": {"brake_build_up_s": 1.2},
    }
    world = world_of(load(NETWORK)) if name == "network" else chain(**changed.get(name, {}))
    separation = apart.get(name, Separation.STANDING)
    return world, terms_of(world, separation, promises.get(name, RADIO))


def judged(found: Case, steps: TrainSteps, clear: Clear) -> dict[tuple[str, int, int], float]:
    """By how much each rule is broken, or kept, by kind, step and column; in plain numbers."""
    world, terms = found
    return {
        (kind, step, column): over
        for column, step in np.argwhere(steps.present).tolist()
        for kind, over in excesses(world, terms, steps, clear, (column, step)).items()
    }


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "name", ["standing", "net brake", "by brakes", "blocks", "bare safety", "network"]
)
def test_the_pass_finds_what_plain_numbers_find(name: str, seed: int) -> None:
    world, terms = case(name)
    steps, clear = random_block(world, terms, np.random.default_rng(seed))
    closest = np.full(len(KINDS), -np.inf)
    told = breaches(survey_of(world), terms, steps, clear, closest)
    plain = judged((world, terms), steps, clear)
    allowed = dict(zip(KINDS, terms.tolerances.tolist(), strict=True))
    broken = {key: over for key, over in plain.items() if over > allowed[key[0]]}
    found = {(kind, step, column): over for kind, step, column, over in told}
    assert len(found) == len(told)
    assert found == pytest.approx(broken, rel=1e-9, abs=1e-6)
    for kind, nearest in zip(KINDS, closest.tolist(), strict=True):
        own = [over for key, over in plain.items() if key[0] == kind and np.isfinite(over)]
        assert nearest == pytest.approx(max(own, default=-np.inf), rel=1e-9, abs=1e-6)


def test_each_rule_is_broken_and_kept_on_these_blocks() -> None:
    """Else the test above would compare nothing with nothing."""
    broken, kept = set[str](), set[str]()
    for name in ("net brake", "blocks", "network"):
        world, terms = case(name)
        steps, clear = random_block(world, terms, np.random.default_rng(0))
        allowed = dict(zip(KINDS, terms.tolerances.tolist(), strict=True))
        for (kind, _, _), over in judged((world, terms), steps, clear).items():
            if np.isfinite(over):
                (broken if over > allowed[kind] else kept).add(kind)
    assert broken == kept == set(KINDS)


def test_not_a_number_breaks_rules() -> None:
    world, terms = case("net brake")
    steps, clear = random_block(world, terms, np.random.default_rng(1))
    column, step = np.argwhere(steps.moving[:, 30:] & ~steps.surprised[:, 30:-1])[0] + [0, 30]
    closest = np.full(len(KINDS), -np.inf)
    braking = {"authority", "spacing", "acceleration", "braking"}
    for name, kinds in {
        "front_m": {"stop", *braking},
        "speed_mps": {"limit", *braking},
        "eoa_m": {"authority", "band", "margin", "grant", "release", "platform"},
    }.items():
        values = getattr(steps, name)
        kept = values[column].copy()
        values[column, step : step + 2] = np.nan
        told = breaches(survey_of(world), terms, steps, clear, closest)
        nameless = {kind for kind, at, _, over in told if at == step and np.isnan(over)}
        assert kinds <= nameless
        values[column] = kept
    assert not np.isnan(closest).any()


def test_more_breaches_than_places_are_all_told() -> None:
    world, terms = case("standing")
    steps, clear = random_block(world, terms, np.random.default_rng(0))
    many = 20
    longer = steps._replace(
        rows=np.tile(steps.rows, many),
        **{
            name: np.tile(values, (many, 1))
            for name, values in steps._asdict().items()
            if values.ndim > 1
        },
    )
    clear_for_all = Clear(*(np.tile(places, (many, 1)) for places in clear))
    survey, closest = survey_of(world), np.full(len(KINDS), -np.inf)
    once = breaches(survey, terms, steps, clear, closest)
    assert len(once) * many > PLACES
    again = breaches(survey, terms, longer, clear_for_all, closest)
    assert [one for one in again if one[2] < steps.rows.size] == once
    assert len(again) == len(once) * many
