"""Who follows whom: kept by events, read as arrays."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.passing import NO_PREDECESSOR, Precursors, Predecessor
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NOTHING, beside
from kankaku.railway.wayside.first_come import ASK_M, FirstCome
from kankaku.railway.wayside.machine import ROUNDING_S


class Leaders:
    """
    The next train ahead on each train's route, in the order of the timetable at merges.

    A train follows its predecessor on the first track that the predecessor has not yet
    cleared. Points through which another train goes first, from or to another track, are
    not granted: the way ends at their fouling point, also for a train that still follows
    somebody else. So does the way before a track of a network that a train of the other direction
    has to leave first, before points that have to be thrown, and behind the place where a train
    that goes first will begin. Only a train that enters, or asks for its way where turns go to who
    comes first, a tail that leaves a track, and the end of a throw change anything, so between
    those events the arrays stand still. In a network they say nothing of a train before it enters,
    or after it has left: a train there may come after all others of the day.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._rows = np.arange(world.size)
        self._ways = world.passages
        self._ahead = [list(order.ahead) for order in world.orders]
        self._waits = [order.waits for order in world.orders]
        self._asks_all = not world.line.network
        self._dependents = [set[int]() for _ in range(world.size)]
        self._entered = [self._asks_all] * world.size
        self._gone = [False] * world.size
        self._leaves_at_stop = world.leaves_at_stop.tolist()
        self._beyond: dict[Predecessor, Predecessor] = {}
        """Who was before a train that has ended its trip, and is still there or was last."""
        points = world.line.turnouts
        self._first_come = FirstCome(world) if world.line.first_come else None
        self._asked = [0 if world.line.first_come else len(way) for way in self._ways]
        """The passage up to which each train has asked."""
        self.ask_m: FloatArray = np.array([self._next_ask_m(row) for row in range(world.size)])
        """Where the front of each train asks for its next passage. [m]"""
        self._throw_s = [turnout.throw_s + turnout.proof_s for turnout in points]
        self._at = [0] * world.size
        """The passage that each train's tail has not left yet."""
        self._origin_m = world.stop_m[:, 0] - world.length_m
        """Where tails are when trains enter. [m]"""
        self._left_s: dict[Predecessor, float] = {}
        """When passages were left that somebody waits for."""
        self._thrown: dict[int, float] = {}
        """Until when points are thrown for a train, as far as it waits for nothing else."""
        self.next_s = np.inf
        """When points have been thrown for somebody. [s]"""
        size = world.size
        self.granted_to_m: FloatArray = np.full(size, world.far_m)
        self.granted_by: IntArray = np.full(size, NOTHING, dtype=np.intp)
        self.follows: BoolArray = np.zeros(size, dtype=np.bool_)
        self.leader: IntArray = np.full(size, -1, dtype=np.intp)
        self.next_clear_m: FloatArray = np.array([way[0].clear_m for way in self._ways])
        if self._asks_all:
            rows = range(size)
            self._depend_on_all_before(rows)
            self._follow(rows, -np.inf)

    def _depend_on_all_before(self, rows: Iterable[int]) -> None:
        for row in rows:
            waits = (one for waits in self._waits[row] for one in waits)
            for before in (*self._ahead[row], *waits):
                self._depend(row, before)

    def _depend(self, row: int, before: Predecessor) -> None:
        """Note on whom a train depends: on those before a train that is not there, too."""
        for one in self._chain(before):
            self._dependents[one.row].add(row)

    def _chain(self, before: Predecessor) -> Iterator[Predecessor]:
        """Yield who is before on a track, up to the first one that is there or is to come."""
        before = self._still_there(before)
        while before.row >= 0:
            yield before
            if before.passage > 0 or self._entered[before.row]:
                return
            before = self._still_there(self._ahead[before.row][0])

    def _still_there(self, before: Predecessor) -> Predecessor:
        """Return who is before on a track but for trains that ended their trips there."""
        passed = list[Predecessor]()
        while before.row >= 0 and self._gone[before.row] and self._leaves_at_stop[before.row]:
            passed.append(before)
            before = self._beyond.get(before, self._ahead[before.row][before.passage])
        # Else a whole day of trains is passed again for every one that follows.
        self._beyond.update(dict.fromkeys(passed, before))
        return before

    def _follow(self, rows: Iterable[int], time_s: float) -> None:
        for row in rows:
            if self._entered[row] and not self._gone[row]:
                self._find(row, time_s)
        self.next_s = min(self._thrown.values(), default=np.inf)

    def _find(self, row: int, time_s: float) -> None:
        """Find the leader of a train, and the first place ahead that is not granted to it."""
        self.leader[row] = -1
        self.follows[row] = False
        self.granted_to_m[row] = self._world.far_m
        self.granted_by[row] = NOTHING
        self._thrown.pop(row, None)
        way, befores, leader = self._ways[row], self._ahead[row], -1
        for number in range(0 if self._asks_all else self._at[row], len(way)):
            if number > self._asked[row]:
                self._end(row, number, NOTHING)
                return
            blocker = self._blocker(row, number, time_s)
            if blocker is not None:
                self._end(row, number, blocker)
                return
            (ahead, passage), expected = self._ahead_now(befores[number])
            if ahead >= 0 and self._at[ahead] <= passage:
                same_way = number == 0 or self._ahead_now(befores[number - 1])[0].row == ahead
                granted = same_way or self._at[ahead] == passage
                if leader < 0:
                    self.leader[row] = leader = ahead
                    self.follows[row] = granted
                if not granted:
                    self._end(row, number, ahead)
                    return
            if expected >= 0:
                self.granted_to_m[row] = self._origin_m[expected]
                self.granted_by[row] = expected
                return

    def _ahead_now(self, before: Predecessor) -> tuple[Predecessor, int]:
        """Return the train ahead on a track, and the next one that will begin in between."""
        expected, ahead = -1, NO_PREDECESSOR
        for one in self._chain(before):
            if one.passage > 0 or self._entered[one.row]:
                ahead = one
            elif expected < 0:
                expected = one.row
        return ahead, expected

    def _end(self, row: int, number: int, by: int) -> None:
        """End the way of a train before a passage."""
        passage = self._ways[row][number]
        self.granted_to_m[row] = passage.entry_m
        self.granted_by[row] = by if passage.turnout < 0 else beside(passage.turnout)

    def _blocker(self, row: int, number: int, time_s: float) -> int | None:
        """Return a train that has to leave before a passage may be entered."""
        if number <= self._at[row] or not self._waits[row][number]:
            return None
        turnout = self._ways[row][number].turnout
        throw_s = self._throw_s[turnout] if turnout >= 0 else 0.0
        ready_s, last = -np.inf, None
        for before in self._waits[row][number]:
            if self._at[before.row] <= before.passage:
                return before.row
            left_s = self._left_s.get(before, -np.inf) + throw_s
            if left_s > ready_s:
                ready_s, last = left_s, before.row
        if throw_s == 0.0 or time_s >= ready_s - ROUNDING_S:
            return None
        self._thrown[row] = ready_s
        return last

    def enter(self, rows: Sequence[int], time_s: float) -> None:
        """
        Let trains be followed that begin on the way of others.

        Parameters
        ----------
        rows
            Trains that enter. In a network those behind them followed whoever was before them so
            far, and kept out of their places.
        time_s
            Now. [s]
        """
        if self._asks_all:
            return
        concerned = set(rows)
        for row in rows:
            self._entered[row] = True
            concerned |= self._dependents[row]
        self._depend_on_all_before(rows)
        self._follow(concerned, time_s)

    def clear(self, rows: IntArray, time_s: float) -> None:
        """
        Take note of tails that left their track.

        Parameters
        ----------
        rows
            The trains. shape (n_events,)
        time_s
            Now. [s]
        """
        concerned = set[int]()
        for row in rows.tolist():
            way, passage = self._ways[row], self._at[row]
            self._left_s[Predecessor(row, passage)] = time_s
            self._at[row] += 1
            gone = self._at[row] >= len(way)
            self.next_clear_m[row] = np.inf if gone else way[self._at[row]].clear_m
            concerned |= {row, *self._dependents[row]}
        self._follow(concerned, time_s)

    def leave(self, row: int, time_s: float) -> None:
        """
        Take a train that left the line out of everybody's way.

        Parameters
        ----------
        row
            The train.
        time_s
            Now. [s]
        """
        for passage in range(self._at[row], len(self._ways[row])):
            self._left_s[Predecessor(row, passage)] = time_s
        self._at[row] = len(self._ways[row])
        self.next_clear_m[row] = np.inf
        self._gone[row] = True
        self._thrown.pop(row, None)
        behind = {one for one in self._dependents[row] if not self._gone[one]}
        # Whoever it was following may not be through yet: the trains behind it follow that one.
        for before in self._ahead[row]:
            for other in behind:
                self._depend(other, before)
        self._follow(behind, time_s)

    def _next_ask_m(self, row: int) -> float:
        """Return where a train asks for the next passage that has to be asked for. [m]"""
        way = self._ways[row]
        if self._asked[row] + 1 >= len(way):
            return np.inf
        return way[self._asked[row] + 1].entry_m - ASK_M

    def ask(
        self, front_m: FloatArray, stop_m: FloatArray, present: BoolArray, time_s: float
    ) -> bool:
        """
        Let trains ask for the passages that they have come near to, nearest ones first.

        Who has a stop to make before a passage asks for it when that stop is over.

        Parameters
        ----------
        front_m
            Fronts. [m], shape (n_trains,)
        stop_m
            Their next stops, or those at which they are held. [m], shape (n_trains,)
        present
            Trains on the line. shape (n_trains,)
        time_s
            Now. [s]

        Returns
        -------
        bool
            Whether anybody asked.
        """
        far_m = np.minimum(front_m, stop_m - ASK_M)
        asking = np.flatnonzero(present & (far_m >= self.ask_m))
        if self._first_come is None or not asking.size:
            return False
        concerned = set[int]()
        for row in asking[np.argsort(self.ask_m[asking] - front_m[asking])].tolist():
            while far_m[row] >= self.ask_m[row]:
                self._asked[row] += 1
                found = self._first_come.asked(row, self._asked[row], self._has_asked)
                if found is not None:
                    concerned |= self._reorder(found)
                self.ask_m[row] = self._next_ask_m(row)
            concerned |= {row, *self._dependents[row]}
        self._follow(concerned, time_s)
        return True

    def _has_asked(self, row: int, number: int) -> bool:
        return number <= self._asked[row] and (number > 0 or self._at[row] > 0)

    def _reorder(self, found: Sequence[Precursors]) -> set[int]:
        """Take over who goes before whom, and return the trains for which that is new."""
        changed = set[int]()
        for row, one in enumerate(found):
            ahead = list(one.ahead)
            if ahead != self._ahead[row] or one.waits != self._waits[row]:
                changed.add(row)
                self._beyond.clear()
                self._ahead[row], self._waits[row] = ahead, one.waits
        self._depend_on_all_before(row for row in changed if self._entered[row])
        return changed

    def thrown(self, time_s: float) -> bool:
        """
        Grant points that have been thrown in the meantime.

        Parameters
        ----------
        time_s
            Now. [s]

        Returns
        -------
        bool
            Whether there were any.
        """
        if time_s < self.next_s - ROUNDING_S:
            return False
        self._follow([r for r, s in self._thrown.items() if s <= time_s + ROUNDING_S], time_s)
        return True

    def tails_and_clearance_m(
        self, front_m: FloatArray, granted_to_m: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """
        Return the tails, and how far the way of each train is clear.

        Parameters
        ----------
        front_m
            Fronts; of a train not yet on the line, its origin. [m], shape (n_trains,)
        granted_to_m
            How far the way is granted beside the trains ahead. [m], shape (n_trains,)

        Returns
        -------
        tuple[FloatArray, FloatArray]
            Tails, and leader's tail or what is granted. [m], shape (n_trains,)
        """
        tail_m = front_m - self._world.length_m
        clear_to_m = granted_to_m.copy()
        lower_to_tails(clear_to_m, tail_m, self._rows, (self.leader, self.follows))
        return tail_m, clear_to_m


@formula
def lower_to_tails(
    clear_to_m: FloatArray,
    tail_m: FloatArray,
    rows: IntArray,
    ahead: tuple[IntArray, BoolArray],
) -> None:
    """
    End the clear way of trains at the tails of those that they follow.

    Parameters
    ----------
    clear_to_m
        How far the way of each train is clear; written to. [m], shape (n_trains,)
    tail_m
        Tails. [m], shape (n_trains,)
    rows
        For which trains. shape (n_rows,)
    ahead
        Row of the train ahead, and who follows it on its own way. shape (n_trains,) each
    """
    leader, follows = ahead
    for train in rows:
        if follows[train]:
            clear_to_m[train] = min(clear_to_m[train], tail_m[leader[train]])


def predecessors(world: World) -> IntArray:
    """
    Return the train before each train on every track that it takes, in timetable order.

    Parameters
    ----------
    world
        Line and timetable.

    Returns
    -------
    IntArray
        Rows of trains by section; -1 for none, and where a route does not pass.
        shape (n_trains, n_sections)
    """
    line, last_on_track = world.line, dict[str, int]()
    before = np.full((world.size, len(line.sections)), -1, dtype=np.intp)
    for row, service in enumerate(world.timetable.services):
        for section, track in enumerate(service.route, line.section_of_track[service.route[0]]):
            before[row, section] = last_on_track.get(track, -1)
            last_on_track[track] = row
    return before


def section_ends_m(line: Line) -> tuple[FloatArray, FloatArray]:
    """
    Return where tails have left sections, and where fronts wait for the next ones.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    tuple[FloatArray, FloatArray]
        Fouling end and fouling start of the turnout at the end of each section; the end of the
        section where there is none. [m], shape (n_sections,)
    """
    ends = [(line.turnout_at.get(section.end_m), section.end_m) for section in line.sections]
    clear_m = [turnout.fouling_end_m if turnout else end_m for turnout, end_m in ends]
    fouling_m = [turnout.fouling_start_m if turnout else end_m for turnout, end_m in ends]
    return np.array(clear_m), np.array(fouling_m)
