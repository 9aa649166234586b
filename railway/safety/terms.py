"""The figures that rules are kept by: of the run, of a separation, and of what is promised."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.line import Block
from kankaku.railway.plan.world import World
from kankaku.railway.safety.rules import AUTHORITY, SPACING, TOLERANCES
from kankaku.railway.step.control import Separation, exclusive_pieces
from kankaku.railway.step.promises import Promises


class Terms(NamedTuple):
    """Figures that rules are kept by."""

    step_s: float
    tolerances: FloatArray
    """Of the rules, in their units. shape (n_rules,)"""
    far_m: float
    """A rear here is nobody's. [m]"""
    by_brakes: bool
    """Trains are kept apart by what they could brake to, not by what stands."""
    promised: bool
    """What was promised is looked at."""
    margin_m: float
    delay_s: float
    """Of the radio, in the buffers. [s]"""
    error_ratio: float
    resolution_m: float
    balises_m: FloatArray
    validity_s: float
    idle_time_s: float
    boundaries_m: FloatArray
    """Where blocks start. [m], shape (n_boundaries,)"""
    enters: BoolArray
    """A block starts there on the train's route. shape (n_trains, n_boundaries)"""


def terms_of(world: World, separation: Separation, promises: Promises | None) -> Terms:
    """
    Return the figures that rules are kept by.

    Parameters
    ----------
    world
        Line and trains.
    separation
        What keeps trains apart.
    promises
        What the protection promises; None where only bare safety is looked at.

    Returns
    -------
    Terms
        The figures.
    """
    strongest_mps2 = float(world.of_type("service_brake_mps2").max())
    tolerances = np.array(list(TOLERANCES.values()))
    # A train that stops within a step may pass its aim by so much.
    tolerances[[AUTHORITY, SPACING]] += strongest_mps2 * world.step_s**2 / 8.0
    told = Promises() if promises is None else promises
    return Terms(
        world.step_s,
        tolerances,
        world.far_m,
        separation is Separation.BRAKING,
        promises is not None,
        told.margin_m,
        told.buffers.delay_s,
        told.buffers.error_ratio,
        told.buffers.resolution_m,
        told.buffers.balise_m,
        told.validity_s,
        told.idle_time_s,
        *_boundaries(world, exclusive_pieces(world.line, separation)),
    )


def _boundaries(world: World, blocks: tuple[Block, ...]) -> tuple[FloatArray, BoolArray]:
    """Return where blocks start, and on whose route."""
    boundaries_m = sorted({block.start_m for block in blocks})
    starts_m: dict[str, set[float]] = {}
    for block in blocks:
        starts_m.setdefault(block.track, set()).add(block.start_m)
    enters = np.zeros((world.size, len(boundaries_m)), dtype=np.bool_)
    for row, service in enumerate(world.timetable.services):
        own = set[float]().union(*(starts_m.get(track, ()) for track in service.route))
        enters[row] = [at_m in own for at_m in boundaries_m]
    return np.array(boundaries_m, dtype=np.float64), enters
