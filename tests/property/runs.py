"""Runs through the real loop over the toy engine, and lines made at random."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from hypothesis import strategies as st

from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.failures.unit_failures import UnitFailure, failing
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.line import Gradient, Line, SpeedLimit
from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller
from kankaku.railway.step.engine_contract import Observation
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import (
    make_scenario,
    straight_line,
    world_of,
)
from kankaku.testing.toy_engine import ToyEngine

READY_S = 25_200.0
GRAVITY = 9.80665


class Observed:
    """An engine that remembers what it showed and what it was told."""

    def __init__(self, engine: ToyEngine) -> None:
        self._engine = engine
        self.seen: list[Observation] = []
        self.told_mps: list[FloatArray] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def observe(self) -> Observation:
        self.seen.append(self._engine.observe())
        return self.seen[-1]

    def apply(self, speed_mps: FloatArray) -> None:
        self.told_mps.append(speed_mps.copy())
        self._engine.apply(speed_mps)

    def hold(self, until_s: FloatArray) -> None:
        self._engine.hold(until_s)

    def advance(self) -> None:
        self._engine.advance()

    @property
    def time_s(self) -> FloatArray:
        return np.array([seen.time_s for seen in self.seen])

    @property
    def front_m(self) -> FloatArray:
        return np.array([seen.front_m for seen in self.seen])

    @property
    def speed_mps(self) -> FloatArray:
        return np.array([seen.speed_mps for seen in self.seen])

    def passes_s(self, row: int, chainage_m: float) -> float:
        """Time at which a front passes a chainage, exact under constant acceleration."""
        front_m, speed_mps, time_s = self.front_m[:, row], self.speed_mps[:, row], self.time_s
        after = int(np.argmax(front_m >= chainage_m))
        gap_m = chainage_m - front_m[after - 1]
        before_mps = speed_mps[after - 1]
        step_s = time_s[after] - time_s[after - 1]
        gain = (speed_mps[after] - before_mps) / step_s
        root = np.sqrt(before_mps**2 + 2.0 * gain * gap_m)
        return float(time_s[after - 1] + 2.0 * gap_m / (before_mps + root))


def controller_of(
    world: World,
    operation: str = "close_up",
    protection: str = "moving_block",
    radio: RadioSpec | None = None,
) -> Controller:
    spec = ControllerSpec("test", protection, operation, {}, {}, radio=radio is not None)
    return build(spec, world, radio or LOSSLESS)


def run(
    scenario: Scenario,
    operation: str = "close_up",
    *,
    controller: Controller | None = None,
    delay_s: FloatArray | None = None,
    radio: RadioSpec | None = None,
    unit_failures: Sequence[UnitFailure] | None = None,
    watched: bool = True,
) -> tuple[RunRecord, Observed]:
    """
    Run a scenario; the delays are the scenario's own where None.

    With a radio, and no controller named, the moving block goes by radio. Who is not watched may
    take steps in bundles, which is much faster, and leaves nothing with the engine.
    """
    world = world_of(scenario)
    if delay_s is None:
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    engine = Observed(ToyEngine(world, delay_s, scenario.step_s))
    whole = Run(
        world,
        delay_s,
        scenario.seed,
        scenario.patience_s,
        scenario.disruptions,
        radio or LOSSLESS,
    )
    units = None
    if unit_failures is not None:
        whole, units = failing(whole, unit_failures)
    record = simulate(
        whole,
        engine if watched else ToyEngine(world, delay_s, scenario.step_s),
        controller or controller_of(world, operation, radio=radio),
        all_meters(world),
        units=units,
    )
    return record, engine


def solo_scenario(
    train: TrainType,
    stops_m: Sequence[float],
    end_m: float,
    *,
    gradients: Sequence[Gradient] = (),
    limits: Sequence[SpeedLimit] = (),
    step_s: float = 0.5,
) -> Scenario:
    """One train that calls at every stop for 10 s, always late."""
    names = {f"s{index}": stop_m for index, stop_m in enumerate(stops_m)}
    line = straight_line(names, end_m, gradients, limits)
    calls = tuple(
        Call(name, "main", stop_m, READY_S + index, READY_S + index, 10.0)
        for index, (name, stop_m) in enumerate(names.items())
    )
    service = Service("T1", "s0", train.id, ("main",), calls)
    return make_scenario(line, [service], train, step_s=step_s)


@st.composite
def random_gradients(draw: st.DrawFn, end_m: float, steepest: float = 0.035) -> list[Gradient]:
    """Stretches of 150 m to 700 m, up and down, some of them level."""
    stretches = []
    start_m = 0.0
    while start_m < end_m:
        stop_m = min(start_m + draw(st.floats(150.0, 700.0)), end_m)
        permil = draw(st.integers(-round(1000 * steepest), round(1000 * steepest)))
        stretches.append(Gradient(start_m, stop_m, permil / 1000.0))
        start_m = stop_m
    return stretches


@st.composite
def random_limits(draw: st.DrawFn, end_m: float) -> list[SpeedLimit]:
    """Up to five limits anywhere; they may overlap."""
    return [
        SpeedLimit(start_m, min(start_m + draw(st.floats(20.0, 500.0)), end_m), limit_mps)
        for start_m, limit_mps in draw(
            st.lists(st.tuples(st.floats(0.0, end_m - 20.0), st.floats(5.0, 28.0)), max_size=5)
        )
    ]


def mean_slope(line: Line, front_m: float, length_m: float) -> float:
    """Gradient averaged over a train, summed stretch by stretch."""
    rise_m = 0.0
    for stretch in line.gradients:
        on_it_m = min(front_m, stretch.end_m) - max(front_m - length_m, stretch.start_m)
        rise_m += stretch.gradient * max(on_it_m, 0.0)
    return rise_m / length_m
