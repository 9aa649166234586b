"""
How far the way of a train will be free, at every moment of a control map.

Trains are looked at in timetable order, first train first, so the bands of all trains that go
before are planned already; an end never lies beyond one of them.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.step.state import NOTHING

AT_START_M = 0.5
"""A front that stands at the start of an obstruction is before it, a stop error off. [m]"""


class Order(NamedTuple):
    """
    Who goes before whom on every passage of a route; it stays for a whole run.

    A passage is a section of a chain, or a track of a train's route in a network.
    """

    entry_m: FloatArray
    """Where each train waits for a passage. [m], shape (n_trains, n_passages)"""
    clear_m: FloatArray
    """Where its tail has left it. [m], shape (n_trains, n_passages)"""
    turnout: IntArray
    """The turnout at its start; -1 for none. shape (n_trains, n_passages)"""
    throw_s: FloatArray
    """Throw time and lock proof of that turnout. [s], shape (n_trains, n_passages)"""
    first: IntArray
    """The passage in which each train starts. shape (n_trains,)"""
    last: IntArray
    """The last one. shape (n_trains,)"""
    before: IntArray
    """The train before on the same track; -1 for none. shape (n_trains, n_passages)"""
    before_at: IntArray
    """Which of its own passages that is. shape (n_trains, n_passages)"""
    through: IntArray
    """The train before through the turnout of a chain. shape (n_trains, n_passages)"""
    same_way: BoolArray
    """That train takes the same way through it. shape (n_trains, n_passages)"""
    waits: IntArray
    """Where the trains begin that have to leave first, and end. (2, n_trains, n_passages)"""
    wait_row: IntArray
    """Those trains. shape (n_waits,)"""
    wait_clear_m: FloatArray
    """Where their tails have left. [m], shape (n_waits,)"""
    points: IntArray
    """The section that begins at each turnout of a chain. shape (n_turnouts,)"""
    strike_in_m: FloatArray
    """Where a front starts the closing of each level crossing. [m], shape (n_crossings,)"""
    leaves_at_stop: BoolArray
    """The train leaves the line at its last stop. shape (n_trains,)"""


class Obstructions(NamedTuple):
    """Obstructions on a control map, as in ``WaysideState``."""

    start_m: FloatArray
    from_s: FloatArray
    until_s: FloatArray
    concerns: BoolArray


class EndsOfAuthority(NamedTuple):
    """How far a train may go at every moment; arrays of shape (n_moments,)."""

    eoa_m: FloatArray
    """[m]"""
    eoa_by: IntArray
    """What is there, as :attr:`kankaku.railway.step.state.Authority.eoa_by`."""


class Grid(NamedTuple):
    """The moments of a map."""

    now_s: float
    """The first. [s]"""
    step_s: float
    """Time between two. [s]"""
    moments: int


class Others(NamedTuple):
    """Where the others are."""

    place: IntArray
    """Where each train is among those on the line; -1 if it is not there. shape (n_trains,)"""
    rear_m: FloatArray
    """Rear of the bands of those on the line. [m], shape (n_on_line, n_moments)"""
    tail_m: FloatArray
    """Tails as reported; at their origins of those that are still to come. [m], (n_trains,)"""
    gone: BoolArray
    """Trains that have left the line. shape (n_trains,)"""
    order: Order
    """Who goes before whom."""


class Ends(NamedTuple):
    """Where a train is, and how far it can come."""

    front_m: float
    tail_m: float
    reach_m: float


@formula
def rear_of(others: Others, train: int, moment: int) -> float:
    """
    Return the rear of a band.

    Parameters
    ----------
    others
        The bands.
    train
        The train; it has not left the line.
    moment
        When.

    Returns
    -------
    float
        The place; the tail at its origin of a train that is still to come. [m]
    """
    place = others.place[train]
    return float(others.rear_m[place, moment] if place >= 0 else others.tail_m[train])


@formula
def _moments_until_clear(train: int, clear_m: float, grid: Grid, others: Others) -> int:
    """Count the moments before the rear of a band is out of a place."""
    clear = 0
    while clear < grid.moments and rear_of(others, train, clear) < clear_m:
        clear += 1
    return clear


@formula
def lower_to_bands(
    eoas: EndsOfAuthority,
    row: int,
    ends: Ends,
    grid: Grid,
    others: Others,
) -> None:
    """
    Draw a train's ends of authority back to the bands of those who go before it, at every moment.

    Parameters
    ----------
    eoas
        Written: drawn back in place.
    row
        The train; bands of all trains before it are planned.
    ends
        Where it is.
    grid
        The moments.
    others
        The bands of the others.
    """
    gone, order, (eoa_m, eoa_by) = others.gone, others.order, eoas
    last = order.last[row]
    here = order.first[row]
    while here < last and ends.tail_m >= order.clear_m[row, here]:
        here += 1
    nearest_m, joins = -np.inf, here
    for section in range(here, last + 1):
        entry_m = order.entry_m[row, section]
        if section > here and entry_m >= ends.reach_m:
            return
        if section > here and ends.front_m <= entry_m + AT_START_M:
            _wait(eoas, row, section, grid, others)
        ahead = _still_before(row, section, gone, order)
        if ahead < 0 or gone[ahead]:
            continue
        if section > here and _still_before(row, section - 1, gone, order) != ahead:
            # Until it joins this way that train is beside it, wherever it is.
            nearest_m, joins = entry_m, section
        clear_m = order.clear_m[row, section]
        for moment in range(grid.moments):
            behind_m = rear_of(others, ahead, moment)
            if behind_m >= clear_m:
                break
            bound_m = max(behind_m, nearest_m)
            if bound_m < eoa_m[moment]:
                beside = behind_m < nearest_m
                eoa_m[moment] = bound_m
                eoa_by[moment] = _points_at(order, row, joins) if beside else ahead


@formula
def _wait(eoas: EndsOfAuthority, row: int, passage: int, grid: Grid, others: Others) -> None:
    """Draw ends back to a passage until all have left that have to do so first."""
    gone, order = others.gone, others.order
    entry_m, throw_s = order.entry_m[row, passage], order.throw_s[row, passage]
    ahead = order.through[row, passage]
    if order.turnout[row, passage] >= 0 and ahead >= 0 and not gone[ahead]:
        locked = _locked_moments(row, passage, grid, others)
        # A train that goes the same way is in the way itself, before its points are.
        by = ahead if order.same_way[row, passage] else _points_at(order, row, passage)
        raise_wall(eoas, by, entry_m, 0, locked)
    for wait in range(order.waits[0, row, passage], order.waits[1, row, passage]):
        ahead = order.wait_row[wait]
        if gone[ahead]:
            continue
        clear = _moments_until_clear(ahead, order.wait_clear_m[wait], grid, others)
        if clear > 0:
            clear += int(np.ceil(throw_s / grid.step_s))
            by = ahead if order.turnout[row, passage] < 0 else _points_at(order, row, passage)
            raise_wall(eoas, by, entry_m, 0, clear)


@formula
def _points_at(order: Order, row: int, section: int) -> int:
    """Return the points at the start of a section, as what stands behind a bound."""
    turnout: int = order.turnout[row, section]
    return NOTHING - 1 - turnout if turnout >= 0 else NOTHING


@formula
def _still_before(row: int, section: int, gone: BoolArray, order: Order) -> int:
    """Return the train before on a section, past those that have left the line at a stop."""
    ahead: int = order.before[row, section]
    passage: int = order.before_at[row, section]
    while ahead >= 0 and gone[ahead] and order.leaves_at_stop[ahead]:
        ahead, passage = order.before[ahead, passage], order.before_at[ahead, passage]
    return ahead


@formula
def _locked_moments(row: int, section: int, grid: Grid, others: Others) -> int:
    """Count the moments before a train may enter points: their section admits one train."""
    order = others.order
    ahead, clear_m = order.through[row, section], order.clear_m[row, section - 1]
    clear = _moments_until_clear(ahead, clear_m, grid, others)
    if clear > 0 and not order.same_way[row, section]:
        clear += int(np.ceil(order.throw_s[row, section] / grid.step_s))
    return clear


@formula
def lower_to_obstructions(
    eoas: EndsOfAuthority,
    row: int,
    ends: Ends,
    grid: Grid,
    others: Others,
    obstructions: Obstructions,
) -> None:
    """
    Draw a train's ends of authority back to the obstructions that are in force now.

    Parameters
    ----------
    eoas
        Written: drawn back in place.
    row
        The train; bands of all trains before it are planned.
    ends
        Where it is.
    grid
        The moments.
    others
        The bands of the others.
    obstructions
        What stands in the way.
    """
    gone, order = others.gone, others.order
    for number in range(obstructions.start_m.size):
        start_m = obstructions.start_m[number]
        if not obstructions.concerns[row, number] or obstructions.from_s[number] > grid.now_s:
            continue
        if ends.front_m > start_m + AT_START_M or start_m > ends.reach_m:
            continue
        crossing = number - order.points.size
        if 0 <= crossing < order.strike_in_m.size and ends.front_m < order.strike_in_m[crossing]:
            # It will be closed in time.
            continue
        if crossing < 0:
            section = order.points[number]
            ahead = order.through[row, section]
            if (
                ahead >= 0
                and not gone[ahead]
                and rear_of(others, ahead, 0) < order.clear_m[row, section - 1]
            ):
                # These points are still another train's.
                continue
        wait_s = obstructions.until_s[number] - grid.now_s
        raise_wall(eoas, NOTHING - 1 - number, start_m, 0, moments_until(wait_s, grid))


@formula
def lower_to_announced(
    eoas: EndsOfAuthority,
    row: int,
    front_m: float,
    grid: Grid,
    stopping_m: FloatArray,
    obstructions: Obstructions,
) -> bool:
    """
    Draw a train's ends of authority back to those announced obstructions that its run would meet.

    Whoever cannot stop any more when an obstruction is to begin is let through, and it begins
    when that train has passed.

    Parameters
    ----------
    eoas
        Written: drawn back in place.
    row
        The train.
    front_m
        Its front now. [m]
    grid
        The moments.
    stopping_m
        Where the run can stop. [m], shape (n_moments,)
    obstructions
        What stands in the way.

    Returns
    -------
    bool
        Whether any was drawn back.
    """
    met = False
    for number in range(obstructions.start_m.size):
        start_m, from_s = obstructions.start_m[number], obstructions.from_s[number]
        if not obstructions.concerns[row, number] or from_s <= grid.now_s:
            continue
        begins = moments_until(from_s - grid.now_s, grid)
        if begins >= grid.moments or front_m > start_m:
            continue
        if stopping_m[begins] > start_m or stopping_m[grid.moments - 1] <= start_m:
            continue
        lasts = moments_until(obstructions.until_s[number] - grid.now_s, grid)
        raise_wall(eoas, NOTHING - 1 - number, start_m, begins, lasts)
        met = True
    return met


@formula
def raise_wall(eoas: EndsOfAuthority, by: int, place_m: float, first: int, end: int) -> None:
    """
    Draw ends back to a place from one moment to another.

    Parameters
    ----------
    eoas
        Written: drawn back in place.
    by
        What stands at the place, as :attr:`kankaku.railway.step.state.Authority.eoa_by`.
    place_m
        The place. [m]
    first
        The first moment.
    end
        The moment after the last; may lie past the end.
    """
    for moment in range(first, min(end, eoas.eoa_m.size)):
        if place_m < eoas.eoa_m[moment]:
            eoas.eoa_m[moment], eoas.eoa_by[moment] = place_m, by


@formula
def moments_until(wait_s: float, grid: Grid) -> int:
    """
    Count the moments before a time.

    Parameters
    ----------
    wait_s
        How long it is from now until then; infinite where nobody knows. [s]
    grid
        The moments.

    Returns
    -------
    int
        How many, all of them at most.
    """
    if wait_s >= grid.step_s * grid.moments:
        return grid.moments
    return max(int(np.ceil(wait_s / grid.step_s - 1e-6)), 0)
