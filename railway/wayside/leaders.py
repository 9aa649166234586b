"""Who follows whom: kept by events, read as arrays."""

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NOTHING, beside


class Leaders:
    """
    The next train ahead on each train's route, in timetable order at merges.

    A train follows its predecessor on the first section that the predecessor has not yet
    cleared. Points through which another train goes first, from or to another track, are
    not granted: the way ends at their fouling point, also for a train that still follows
    somebody else. Only a tail that leaves a section changes anything, so between those events the
    arrays stand still.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        sections = world.line.sections
        section_of_track = world.line.section_of_track
        self._first = [section_of_track[service.route[0]] for service in world.timetable.services]
        # Lists, because they are read one by one.
        self._predecessor = predecessors(world).tolist()
        self._clear_m, self._fouling_m = (ends_m.tolist() for ends_m in section_ends_m(world.line))
        self._turnout = _turnouts_at_ends(world.line)
        self._section = list(self._first)
        """The section that each train's tail has not left yet."""
        self._last = len(sections)
        size = world.size
        self.granted_to_m: FloatArray = np.full(size, world.far_m)
        self.granted_by: IntArray = np.full(size, NOTHING, dtype=np.intp)
        self.follows: BoolArray = np.zeros(size, dtype=np.bool_)
        self.leader: IntArray = np.full(size, -1, dtype=np.intp)
        self.next_clear_m: FloatArray = np.array([self._clear_m[s] for s in self._first])
        self._follow_all()

    def _follow(self, row: int) -> None:
        """Find the leader of a train, and the first points ahead that are not granted to it."""
        self.leader[row] = -1
        self.follows[row] = False
        self.granted_to_m[row] = self._world.far_m
        self.granted_by[row] = NOTHING
        before = -1
        for section in range(self._first[row], self._last):
            ahead = self._predecessor[row][section]
            if ahead < 0 or self._section[ahead] > section:
                continue
            same_way = section == self._first[row] or self._predecessor[row][section - 1] == ahead
            granted = same_way or self._section[ahead] == section
            if before < 0:
                self.leader[row] = before = ahead
                self.follows[row] = granted
            if not granted:
                self.granted_to_m[row] = self._fouling_m[section - 1]
                self.granted_by[row] = beside(self._turnout[section - 1])
                return

    def clear(self, rows: IntArray) -> None:
        """
        Take note of tails that left their section.

        Parameters
        ----------
        rows
            The trains. shape (n_events,)
        """
        for row in rows.tolist():
            self._section[row] += 1
            gone = self._section[row] >= self._last
            self.next_clear_m[row] = np.inf if gone else self._clear_m[self._section[row]]
        self._follow_all()

    def leave(self, row: int) -> None:
        """
        Take a train that left the line out of everybody's way.

        Parameters
        ----------
        row
            The train.
        """
        self._section[row] = self._last
        self.next_clear_m[row] = np.inf
        if self._world.leaves_at_stop[row]:
            # Whoever it was following is not through yet: the trains behind it follow that one.
            for before in self._predecessor:
                for section, ahead in enumerate(before):
                    if ahead == row:
                        before[section] = self._predecessor[row][section]
        self._follow_all()

    def _follow_all(self) -> None:
        for row in range(self._world.size):
            self._follow(row)

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
        _lower_to_tails(clear_to_m, tail_m, self.leader, self.follows)
        return tail_m, clear_to_m


@compiled
def _lower_to_tails(
    clear_to_m: FloatArray, tail_m: FloatArray, leader: IntArray, follows: BoolArray
) -> None:
    for train in range(tail_m.size):
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


def _turnouts_at_ends(line: Line) -> list[int]:
    """Return the number of the turnout at the end of each section; -1 where there is none."""
    number_at = {turnout.position_m: number for number, turnout in enumerate(line.turnouts)}
    return [number_at.get(section.end_m, -1) for section in line.sections]
