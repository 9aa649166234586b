"""
What held a train up at any moment of a saved run, followed back from train to train.

It asks the tables of a run only, so that a results folder can be asked long after the run. The
chain goes by the rule of the table ``remaining_stops``, from any moment and not only from stops.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.remaining_stops import (
    AFTER_S,
    AT_PLATFORM,
    BESIDE,
    BETWEEN,
    NEAR_SAMPLES,
    RUNNING,
)
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.arrays import FloatArray, IntArray

NO_CALL = -1


class Sample(NamedTuple):
    """A row of the table ``trajectory``."""

    time_s: float
    front_m: float
    speed_mps: float
    limit_m: float
    """End of authority. [m]"""
    track: str
    reason: str
    plan: str
    cause: str


class CauseLink(NamedTuple):
    """A train or a place in a chain of causes, at the moment that counts."""

    name: str
    time_s: float
    """The moment. [s]"""
    state: str
    """``at_platform``, ``between_stations``, ``running`` or ``beside_track``."""
    call: int
    """Its call at a platform, or the last one before; ``NO_CALL`` for none. [-]"""
    station: str
    """Of that call; empty for none."""
    overstay_s: float
    """Injected dwell of that call; nan for none. [s]"""
    beyond_booked_s: float
    """What of it the booked dwell did not absorb; nan for none. [s]"""
    arrival_delay_s: float
    """Of that call; nan for none. [s]"""
    secondary_delay_s: float
    """What of that it owes to others; nan for none. [s]"""


class Stand(NamedTuple):
    """A row of the table ``interstation_stops``."""

    start_s: float
    duration_s: float
    front_m: float
    next_station: str

    @property
    def end_s(self) -> float:
        """When the train moved on. [s]"""
        return self.start_s + self.duration_s


class Seen:
    """A saved run, to be asked for moments."""

    def __init__(self, run: RunTables) -> None:
        self.run = run
        samples = run.trajectory
        names = samples["train"].to_numpy()
        order, self._part = _parts(names)
        times_s = samples["time_s"].to_numpy()
        # Within a train by time, also where a file was put together by somebody else.
        for own in self._part.values():
            order[own] = order[own][np.argsort(times_s[order[own]], kind="stable")]
        self._columns = {
            name: samples[name].to_numpy()[order] for name in Sample._fields if name in samples
        }
        self._calls = {
            str(train): own.sort_values("sequence", kind="stable")
            for train, own in run.calls.groupby("train", sort=False)
        }
        self._stands = {
            str(train): [
                Stand(row["start_s"], row["duration_s"], row["front_m"], row["next_station"])
                for row in rows_of(own.sort_values("start_s", kind="stable"))
            ]
            for train, own in run.interstation_stops.groupby("train", sort=False)
        }

    @property
    def trains(self) -> tuple[str, ...]:
        """Trains with calls, in the order of the table ``calls``."""
        return tuple(self._calls)

    def samples(self, train: str) -> dict[str, Any]:
        """
        Return the samples of a train by column.

        Parameters
        ----------
        train
            Its number; one without samples has empty columns.

        Returns
        -------
        dict[str, Any]
            Arrays by the names of :class:`Sample`, times rising. shape (n_samples,) each
        """
        part = self._part.get(train, slice(0, 0))
        return {name: values[part] for name, values in self._columns.items()}

    def calls(self, train: str) -> pd.DataFrame:
        """
        Return the calls of a train.

        Parameters
        ----------
        train
            Its number.

        Returns
        -------
        pd.DataFrame
            Its rows of the table ``calls``, along its trip.
        """
        return self._calls.get(train, self.run.calls.iloc[:0])

    def stands(self, train: str) -> list[Stand]:
        """
        Return where a train stood between stations.

        Parameters
        ----------
        train
            Its number.

        Returns
        -------
        list[Stand]
            By time.
        """
        return self._stands.get(train, [])

    def sample(self, train: str, time_s: float) -> Sample | None:
        """
        Return what is known of a train at a moment.

        Parameters
        ----------
        train
            Its number.
        time_s
            The moment. [s]

        Returns
        -------
        Sample | None
            The last sample until then; None while the train is not on the line.
        """
        own = self.samples(train)
        times_s: FloatArray = own["time_s"]
        at = int(np.searchsorted(times_s, time_s, side="right")) - 1
        if at < 0 or (at == times_s.size - 1 and time_s > times_s[at] + AFTER_S):
            return None
        return Sample(**{name: values[at] for name, values in own.items()})

    def stand(self, train: str, time_s: float) -> Stand | None:
        """
        Return the stop between stations that a train makes at a moment.

        Parameters
        ----------
        train
            Its number.
        time_s
            The moment. [s]

        Returns
        -------
        Stand | None
            None if it runs, or is at a platform.
        """
        found = [one for one in self.stands(train) if one.start_s <= time_s < one.end_s]
        return found[-1] if found else None

    def call_at(self, train: str, time_s: float) -> int:
        """
        Return the last call at which a train has arrived.

        Parameters
        ----------
        train
            Its number.
        time_s
            The moment. [s]

        Returns
        -------
        int
            Its place along the trip, from 0; ``NO_CALL`` before the first. [-]
        """
        arrived = np.flatnonzero(self.calls(train)["arrival_s"].to_numpy() <= time_s)
        return int(arrived[-1]) if arrived.size else NO_CALL

    def cause_at(self, train: str, time_s: float) -> str:
        """
        Return what a train was slow for.

        Parameters
        ----------
        train
            Its number.
        time_s
            The moment. [s]

        Returns
        -------
        str
            Train or place ahead then, or shortly before; empty for none.
        """
        own = self.samples(train)
        until = int(np.searchsorted(own["time_s"], time_s + AFTER_S, side="right"))
        near = [str(name) for name in own["cause"][max(until - NEAR_SAMPLES, 0) : until]]
        return next((name for name in reversed(near) if name), "")

    def slowed_before(self, train: str, time_s: float, since_s: float) -> Sample | None:
        """
        Return the last sample in which a train was slow for something ahead.

        Parameters
        ----------
        train
            Its number.
        time_s
            Until then. [s]
        since_s
            Not before that. [s]

        Returns
        -------
        Sample | None
            None if it was not.
        """
        own = self.samples(train)
        part = slice(*np.searchsorted(own["time_s"], (since_s, time_s), side="left").tolist())
        slow = np.flatnonzero(own["cause"][part] != "")
        if not slow.size:
            return None
        at = part.start + int(slow[-1])
        return Sample(**{name: values[at] for name, values in own.items()})

    def bound_since_s(self, train: str, time_s: float) -> float:
        """
        Return since when a train was slow for what it is slow for, without a break.

        Parameters
        ----------
        train
            Its number.
        time_s
            The moment. [s]

        Returns
        -------
        float
            Seconds after midnight; nan if it is slow for nothing. [s]
        """
        own = self.samples(train)
        last = int(np.searchsorted(own["time_s"], time_s, side="right")) - 1
        if last < 0 or not own["cause"][last]:
            return np.nan
        other = np.flatnonzero(own["cause"][: last + 1] != own["cause"][last])
        return float(own["time_s"][int(other[-1]) + 1 if other.size else 0])

    def link(self, name: str, time_s: float) -> CauseLink:
        """
        Return how a train or a place was at a moment.

        Parameters
        ----------
        name
            Train number, or what is beside the track.
        time_s
            The moment. [s]

        Returns
        -------
        CauseLink
            What the tables tell of it then.
        """
        if name not in self._calls:
            return CauseLink(name, time_s, BESIDE, NO_CALL, "", *(np.nan,) * 4)
        at = self.call_at(name, time_s)
        if at == NO_CALL:
            stands = self.stand(name, time_s) is not None
            return CauseLink(name, time_s, BETWEEN if stands else RUNNING, at, "", *(np.nan,) * 4)
        call = rows_of(self.calls(name).iloc[[at]])[0]
        state = BETWEEN if self.stand(name, time_s) else RUNNING
        if not call["departure_s"] <= time_s:
            state = AT_PLATFORM
        return CauseLink(
            name,
            time_s,
            state,
            at,
            str(call["station"]),
            call["dwell_delay_s"],
            call["primary_delay_s"],
            call["arrival_delay_s"],
            call["secondary_delay_s"],
        )

    def next_ahead(self, train: str, time_s: float) -> tuple[str, float] | None:
        """
        Return which train is next ahead, on the tracks that a train takes.

        Parameters
        ----------
        train
            Its number.
        time_s
            The moment. [s]

        Returns
        -------
        tuple[str, float] | None
            Its number, and how far it is from front to front [m]; None for nobody.
        """
        here = self.sample(train, time_s)
        if here is None:
            return None
        own = self.samples(train)
        way, forward = set(own["track"]), own["front_m"][-1] >= own["front_m"][0]
        nearest: tuple[str, float] | None = None
        for other in self._part:
            there = self.sample(other, time_s) if other != train else None
            if there is None or there.track not in way:
                continue
            apart_m = (there.front_m - here.front_m) * (1.0 if forward else -1.0)
            if apart_m > 0.0 and (nearest is None or apart_m < nearest[1]):
                nearest = other, apart_m
        return nearest

    def chain(self, train: str, time_s: float) -> list[CauseLink]:
        """
        Return what a train was slow for, what that one was held up by, and so on.

        Parameters
        ----------
        train
            Its number.
        time_s
            The moment. [s]

        Returns
        -------
        list[CauseLink]
            Nearest first; the last one is held up by nobody, or by one that was named before. Empty
            if the train itself was slow for nothing.
        """
        return list(self._chain(train, time_s))

    def _chain(self, train: str, time_s: float) -> Iterator[CauseLink]:
        seen = {train}
        while True:
            name = self.cause_at(train, time_s)
            if not name or name in seen:
                return
            link = self.link(name, time_s)
            yield link
            seen.add(name)
            since_s = self._held_up_s(link)
            if since_s is None:
                return
            train, time_s = name, since_s

    def _held_up_s(self, link: CauseLink) -> float | None:
        """Return when a link was itself held up by something else; None if it was not. [s]"""
        if link.state == BESIDE:
            return None
        before = [one for one in self.stands(link.name) if one.start_s <= link.time_s]
        if link.state == BETWEEN:
            return before[-1].start_s
        if link.beyond_booked_s > 0.0:
            return None
        # It makes its stop, or runs on, as it should: was it late because it had to stand before?
        own = [one for one in before if self.call_at(link.name, one.start_s) == link.call - 1]
        if own:
            return own[-1].start_s
        return link.time_s if link.state == RUNNING else None


def _parts(names: Any) -> tuple[IntArray, dict[str, slice]]:  # noqa: ANN401 - array of texts
    """Return an order of rows by name, and which part of it each name has."""
    codes, found = pd.factorize(names)
    order = np.argsort(codes, kind="stable")
    ends = np.searchsorted(codes[order], np.arange(len(found) + 1))
    return order, {
        str(name): slice(int(ends[number]), int(ends[number + 1]))
        for number, name in enumerate(found)
    }
