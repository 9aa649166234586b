"""Block layouts for a headway: lengths by platforms are made shorter until trains do not meet."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil
from typing import NamedTuple

from kankaku.controllers import registry
from kankaku.controllers.layers import ControllerError
from kankaku.railway.capacity.blocking_time import technical_headways
from kankaku.railway.capacity.permitted import permitted_profile
from kankaku.railway.errors import KankakuError, suggesting
from kankaku.railway.motion.journey import technical_journey
from kankaku.railway.plan.line import Direction
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.timetable import Service, Timetable
from kankaku.railway.step.control import Separation
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.drafts.block_design import (
    CIRCUITS_M,
    BlockTrial,
    blocks_of,
    circuits_of,
    longest_m,
    trials,
    zones_of,
)
from kankaku.scenarios.loading.load_line import to_line
from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.row_formats import BlockRow, CircuitRow
from kankaku.studies.study import foresight_of, world_of

SLOWER_S = 1.0
"""No layout counts with which trains run so much longer than booked. [s]"""
COARSE, FINE = Separation.BLOCKS, Separation.CIRCUITS


class BlockError(KankakuError):
    """A block layout that cannot be made."""

    verdict = "gets no blocks"


class Reached(NamedTuple):
    """The headway into a station."""

    headway_s: float
    place_km: float
    """Where the train is that decides."""
    falling: bool
    slower_s: float
    """Its run takes so much longer than booked, because lower codes are shown."""


@dataclass(frozen=True, slots=True)
class BlockLayout:
    """Blocks for a headway, and what they reach."""

    blocks: tuple[BlockRow, ...]
    circuits: tuple[CircuitRow, ...]
    trial: BlockTrial
    reached: Mapping[str, Reached]
    """The longer one of both directions, by station."""
    separation: Separation


class _Designer:
    """Tries layouts on a scenario whose trains are one for each direction."""

    def __init__(self, scenario: Scenario, line: LineTables, spec: ControllerSpec) -> None:
        services = [*_longest(scenario)]
        self._scenario = replace(scenario, timetable=Timetable(tuple(services)))
        self._line, self._spec = line, spec
        self.separation = self._controller_separation()
        self._zones = zones_of(line, self.train)

    @property
    def train(self) -> TrainType:
        """The train of the longest service."""
        return self._scenario.train_types[self._scenario.timetable.services[0].train_type]

    def _controller_separation(self) -> Separation:
        world = world_of(self._scenario, self._scenario.step_s)
        return registry.build(self._spec, world, self._scenario.radio).separation

    def trials(self, headway_s: float) -> list[BlockTrial]:
        """Return layouts in the order in which they are tried."""
        far_m = longest_m(self.train, headway_s)
        if self.separation is COARSE:
            return trials(far_m)
        return [BlockTrial(far_m, min(m, far_m), at_platforms=False) for m in CIRCUITS_M]

    def tables(self, trial: BlockTrial) -> tuple[list[BlockRow], list[CircuitRow]]:
        """Return the rows of a layout."""
        if self.separation is COARSE:
            return blocks_of(self._line, self._zones, trial), []
        blocks = blocks_of(self._line, self._zones, trial._replace(near_m=trial.far_m))
        return blocks, circuits_of(blocks, self._zones, trial.near_m)

    def reached(self, blocks: list[BlockRow], circuits: list[CircuitRow]) -> dict[str, Reached]:
        """Return the technical headway into each station."""
        tables = replace(
            self._line,
            blocks=Table("blocks.csv", tuple(blocks)),
            circuits=Table("circuits.csv", tuple(circuits), present=bool(circuits)),
        )
        made = to_line(tables, self._scenario.line.name)
        line = replace(self._scenario.line, blocks=made.blocks, circuits=made.circuits)
        scenario = replace(self._scenario, line=line)
        world = world_of(scenario, scenario.step_s).driven_as(self._spec.driving)
        foresight = foresight_of(registry.build(self._spec, world, scenario.radio))
        found: dict[str, Reached] = {}
        for row, service in enumerate(scenario.timetable.services):
            journey = technical_journey(world, permitted_profile(world, foresight, row), row)
            headways = technical_headways(world, foresight, journey)
            falling = line.track_by_id[service.route[0]].direction is Direction.FALLING
            for at, headway in enumerate(headways, 1):
                before, call = service.calls[at - 1 : at + 1]
                run_s = float(journey.arrival_s[at] - journey.departure_s[at - 1])
                slower_s = run_s - (call.arrival_s - before.departure_s)
                place_m = line.mirrored_m(headway.front_m) if falling else headway.front_m
                own = Reached(headway.headway_s, place_m / 1000.0, falling, slower_s)
                known = found.get(call.station)
                if known is None or own.headway_s > known.headway_s:
                    found[call.station] = own
                slowest_s = max(slower_s, known.slower_s if known else slower_s)
                found[call.station] = found[call.station]._replace(slower_s=slowest_s)
        return found


def _longest(scenario: Scenario) -> Iterator[Service]:
    """Yield the service with most calls of each direction."""
    line = scenario.line
    by_direction: dict[Direction, Service] = {}
    for service in scenario.timetable.services:
        direction = line.track_by_id[service.route[0]].direction
        known = by_direction.get(direction)
        if known is None or len(service.calls) > len(known.calls):
            by_direction[direction] = service
    for service in by_direction.values():
        yield replace(service, next_train="", turn_back_s=0.0)


def chosen_spec(scenario: Scenario, name: str) -> ControllerSpec:
    """
    Return for whom blocks are laid.

    Parameters
    ----------
    scenario
        The scenario.
    name
        A controller of it; the first one with that protection; or any protection.

    Returns
    -------
    ControllerSpec
        Of a controller that uses blocks or circuits.

    Raises
    ------
    BlockError
        If there is none of that name.
    """
    specs = [spec for spec in scenario.controllers if spec.peer is None]
    for spec in specs:
        if spec.name == name:
            return spec
    for spec in specs:
        if spec.protection == name:
            return spec
    known = [*(spec.name for spec in specs), *registry.PROTECTIONS]
    if name not in registry.PROTECTIONS:
        told = ", ".join(dict.fromkeys(known))
        where, problem = f"--for {name}", "no such controller"
        raise BlockError(where, problem, suggesting(name, known, told))
    return ControllerSpec(name, name, "close_up", {}, {})


def design(
    scenario: Scenario, line: LineTables, spec: ControllerSpec, headway_s: float
) -> BlockLayout:
    """
    Lay blocks for a headway.

    Parameters
    ----------
    scenario
        Valid; its blocks do not matter.
    line
        The files of its line.
    spec
        For whom.
    headway_s
        From train to train, both with the booked dwell. [s]

    Returns
    -------
    BlockLayout
        The first one, from long blocks or track circuits to short ones, that reaches it.

    Raises
    ------
    BlockError
        If no layout reaches it, with the least one and the critical place; or if the controller
        has no use for blocks.
    """
    designer = _Designer(scenario, line, spec)
    if designer.separation not in {COARSE, FINE}:
        told = f"--for {spec.name}"
        raise BlockError(told, "uses no blocks", "multi_step_atc, atd, digital_atc and their like")
    best: tuple[float, str, Reached, BlockTrial] | None = None
    refused: ControllerError | None = None
    for trial in designer.trials(headway_s):
        blocks, circuits = designer.tables(trial)
        try:
            reached = designer.reached(blocks, circuits)
        except ControllerError as error:
            # No train could enter such short ones.
            refused = error
            continue
        critical = max(reached, key=lambda name: reached[name].headway_s)
        worst = reached[critical]
        if max(found.slower_s for found in reached.values()) > SLOWER_S:
            continue
        if worst.headway_s <= headway_s:
            return BlockLayout(tuple(blocks), tuple(circuits), trial, reached, designer.separation)
        if best is None or worst.headway_s < best[0]:
            best = worst.headway_s, critical, worst, trial
    if best is None:
        where, problem = f"--for {spec.name}", "with any blocks trains run longer than booked"
        raise refused or BlockError(where, problem, "longer booked run times, or other options")
    least_s, critical, worst, trial = best
    problem = (
        f"{headway_s:g} s is too short for {spec.name}: into {critical!r} it takes {least_s:.1f} s "
        f"with lengths of {trial.near_m:g} m, decided at km {worst.place_km:.3f}"
    )
    where = "--headway"
    raise BlockError(where, problem, f"{ceil(least_s)} s or more")
