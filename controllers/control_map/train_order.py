"""Who goes before whom, laid out for the planning of control maps."""

from itertools import pairwise

import numpy as np

from kankaku.controllers.control_map.way_ahead import Order
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.leaders import predecessors, section_ends_m


def order_of(world: World) -> Order:
    """
    Return who goes before whom.

    Parameters
    ----------
    world
        Line and timetable.

    Returns
    -------
    Order
        The order.
    """
    return _in_network(world) if world.line.network else _on_chain(world)


def _on_chain(world: World) -> Order:
    line, services = world.line, world.timetable.services
    first = [line.section_of_track[service.route[0]] for service in services]
    before = predecessors(world)
    through, same_way = np.full_like(before, -1), np.zeros(before.shape, dtype=np.bool_)
    last_through: dict[int, tuple[int, tuple[str, ...]]] = {}
    for row, service in enumerate(services):
        for section, way in enumerate(pairwise(service.route), first[row] + 1):
            ahead, other = last_through.get(section, (-1, ()))
            through[row, section], same_way[row, section] = ahead, way == other
            last_through[section] = row, way
    clear_m, fouling_m = section_ends_m(line)
    section_at = {section.start_m: number for number, section in enumerate(line.sections)}
    starts = [line.turnout_at.get(section.start_m) for section in line.sections]
    points = [section_at[turnout.position_m] for turnout in line.turnouts]
    throw_s = [turnout.throw_s + turnout.proof_s if turnout else 0.0 for turnout in starts]
    turnout = np.full(len(line.sections), -1, dtype=np.intp)
    turnout[points] = np.arange(len(points))
    shape = before.shape
    return Order(
        np.tile(np.concatenate([[line.start_m], fouling_m[:-1]]), (world.size, 1)),
        np.tile(clear_m, (world.size, 1)),
        np.tile(turnout, (world.size, 1)),
        np.tile(np.array(throw_s), (world.size, 1)),
        np.array(first, dtype=np.intp),
        np.full(world.size, len(line.sections) - 1, dtype=np.intp),
        before,
        np.tile(np.arange(shape[1]), (world.size, 1)),
        through,
        same_way,
        np.zeros((2, *shape), dtype=np.intp),
        np.zeros(0, dtype=np.intp),
        np.zeros(0),
        np.array(points, dtype=np.intp),
        np.array([crossing.strike_in_m for crossing in line.crossings]),
        world.leaves_at_stop,
    )


def _in_network(world: World) -> Order:
    line, ways = world.line, world.passages
    shape = world.size, max(map(len, ways))
    entry_m, clear_m, throw_s = np.full((3, *shape), np.inf)
    turnout, before, before_at = np.full((3, *shape), -1, dtype=np.intp)
    waits = np.zeros((2, *shape), dtype=np.intp)
    wait_row: list[int] = []
    wait_clear_m: list[float] = []
    for row, (way, order) in enumerate(zip(ways, world.orders, strict=True)):
        for number, passage in enumerate(way):
            entry_m[row, number], clear_m[row, number] = passage.entry_m, passage.clear_m
            turnout[row, number] = passage.turnout
            points = line.turnouts[passage.turnout] if passage.turnout >= 0 else None
            throw_s[row, number] = points.throw_s + points.proof_s if points else 0.0
            before[row, number], before_at[row, number] = order.ahead[number]
            waits[0, row, number] = len(wait_row)
            for ahead, its_passage in order.waits[number]:
                wait_row.append(ahead)
                wait_clear_m.append(ways[ahead][its_passage].clear_m)
            waits[1, row, number] = len(wait_row)
    return Order(
        entry_m,
        clear_m,
        turnout,
        throw_s,
        np.zeros(world.size, dtype=np.intp),
        np.array([len(way) - 1 for way in ways], dtype=np.intp),
        before,
        before_at,
        np.full(shape, -1, dtype=np.intp),
        np.zeros(shape, dtype=np.bool_),
        waits,
        np.array(wait_row, dtype=np.intp),
        np.array(wait_clear_m),
        np.zeros(len(line.turnouts), dtype=np.intp),
        np.zeros(0),
        world.leaves_at_stop,
    )
