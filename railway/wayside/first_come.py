"""
Turns that go to who comes first.

A train asks for points, and for a track that is used both ways, when it has come near. If those
whose turn is right before its own have not asked yet, it goes before them, there and wherever else
their ways meet later, unless somebody could then wait for ever: the order that follows has to be
free of cycles, as that of the timetable is (:func:`kankaku.railway.plan.passing.waiting_cycle`).
What has been asked for is never given to a later train, so nothing that was granted is taken back.
"""

from collections.abc import Callable
from typing import TypeAlias

from kankaku.railway.plan.passing import Precursors, conflicting, waiting_cycle
from kankaku.railway.plan.turns import Turn, Turns, booked_turns, precursors
from kankaku.railway.plan.world import World

Asked: TypeAlias = Callable[[int, int], bool]
"""Says whether a train has asked for a passage of its own."""
ASK_M = 1500.0
"""How far before it a train asks for a passage: longer than its brake takes. [m]"""


class FirstCome:
    """Whose turn it is, by who asked first."""

    def __init__(self, world: World) -> None:
        self._world, self._line = world, world.line
        self._services = world.timetable.services
        self._turns = booked_turns(world.line, self._services)
        self._length_m = {kind.id: kind.length_m for kind in world.train_types}

    def asked(self, row: int, number: int, has_asked: Asked) -> tuple[Precursors, ...] | None:
        """
        Give a train its turn before those that have not asked yet.

        Parameters
        ----------
        row
            The train.
        number
            The passage that it asks for.
        has_asked
            Says whether a train has asked for a passage of its own.

        Returns
        -------
        tuple[Precursors, ...] | None
            Who goes before whom from now on; None where nothing changes.
        """
        passage = self._world.passages[row][number]
        at = self._turns.on_track[self._line.track_by_id[passage.track].place]
        if passage.turnout >= 0:
            at = self._turns.at_points[passage.turnout]
        late = self._late_before(at, row, number, has_asked)
        if not late:
            return None
        turns = self._moved(row, number, late, has_asked)
        if turns is None:
            return None
        found = precursors(self._line, self._services, turns)
        if waiting_cycle(self._line, self._services, found, self._length_m):
            return None
        self._turns = turns
        return found

    def _moved(self, row: int, number: int, late: set[int], has_asked: Asked) -> Turns | None:
        """Return the turns with a train before some others from a passage on; None if it cannot."""
        on_track, at_points = dict(self._turns.on_track), dict(self._turns.at_points)
        for later, passage in enumerate(self._world.passages[row]):
            if later < number:
                continue
            place = self._line.track_by_id[passage.track].place
            moved = self._before(on_track[place], row, later, late, has_asked)
            if moved is None:
                return None
            on_track[place] = moved
            if passage.turnout >= 0:
                moved = self._before(at_points[passage.turnout], row, later, late, has_asked)
                if moved is None:
                    return None
                at_points[passage.turnout] = moved
        return Turns(on_track, at_points)

    def _clash(self, one: Turn, other: Turn) -> bool:
        """Return whether two turns at the same place are in each other's way."""
        if len(one.way) == 1:
            return True
        ways = (one.way[0], one.way[1]), (other.way[0], other.way[1])
        return one.way == other.way or conflicting(self._line, *ways)

    def _late_before(self, order: list[Turn], row: int, number: int, has_asked: Asked) -> set[int]:
        """Return the trains right before a train's own turn that have not asked yet."""
        own = _place(order, row, number)
        late = set[int]()
        for turn in reversed(order[:own]):
            if not self._clash(turn, order[own]):
                continue
            if turn.way == order[own].way or has_asked(turn.row, turn.number):
                break
            late.add(turn.row)
        return late

    def _before(
        self, order: list[Turn], row: int, number: int, late: set[int], has_asked: Asked
    ) -> list[Turn] | None:
        """Return an order with a train before the late ones; None if others are in its way."""
        own = _place(order, row, number)
        first = own
        for place in range(own - 1, -1, -1):
            turn = order[place]
            if turn.row in late and not has_asked(turn.row, turn.number):
                first = place
        skipped = [turn for turn in order[first:own] if self._clash(turn, order[own])]
        if any(turn.row not in late for turn in skipped):
            return None
        if first < own and any(
            turn.number == 0 for turn in (*order[first:own], *_up_to_next(order, own))
        ):
            # Who begins there enters by the timetable, after those that are before it there.
            return None
        return [*order[:first], order[own], *order[first:own], *order[own + 1 :]]


def _place(order: list[Turn], row: int, number: int) -> int:
    return next(n for n, turn in enumerate(order) if turn.row == row and turn.number == number)


def _up_to_next(order: list[Turn], own: int) -> list[Turn]:
    """Return the turns behind one, up to the next one that goes the same way."""
    behind = order[own + 1 :]
    same = (n for n, turn in enumerate(behind) if turn.way == order[own].way)
    return behind[: next(same, len(behind)) + 1]
