"""Why a train was slow, in words."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from kankaku.analysis.tables.causes import CauseLink, Sample
from kankaku.analysis.tables.delay_tree import IN_THE_WAY, OVERSTAY, OWN_RUN
from kankaku.analysis.tables.explained import NOT_ON_LINE, Explained, Share
from kankaku.analysis.tables.remaining_stops import AT_PLATFORM, BESIDE, BETWEEN
from kankaku.analysis.tables.run_tables import DWELLING, PLAN, REASONS
from kankaku.analysis.words import KMH_PER_MPS, clock, label_of
from kankaku.railway.step.state import Reason

STANDS_BELOW_MPS = 0.05
FAR_M = 50_000.0
"""An end of authority that is farther away than this is none. [m]"""
WORTH_TELLING_S = 1.0
"""Who is late or loses by less than this is told to be in time, or to lose nothing. [s]"""
MOST_ORIGINS = 3
AT_END_M = 1.0
"""Who stands nearer to the end of its authority than this stands at it. [m]"""
FAR_FROM_END_M = 40.0
"""Who stands farther away from it stands for a speed that its protection permits. [m]"""
PEER = REASONS[Reason.PEER]
_BOUND: Mapping[str, str] = {
    "traction": "its own power: it accelerated",
    "line_limit": "a speed limit of the line, or the brake curve to one",
    "station_stop": "the brake curve to its own stop",
    "emergency": "the emergency brake",
    PEER: "another program, which drives it and does not say why",
    "held": "supervision, which kept it at its platform, doors closed",
}


def explanation_text(found: Explained, names: Mapping[str, str]) -> str:
    """
    Return a paragraph about a train at a moment.

    Parameters
    ----------
    found
        What there is to tell.
    names
        Names of stations by identifier.

    Returns
    -------
    str
        Where it was, how fast, what bound it and since when, who was ahead and why, and what it
        cost.
    """
    return " ".join(_Teller(found, names).sentences())


class _Teller:
    def __init__(self, found: Explained, names: Mapping[str, str]) -> None:
        self._found, self._names = found, names

    def sentences(self) -> Iterator[str]:
        found = self._found
        under = f"Under {label_of(found.controller)}, train {found.train}"
        if found.state == NOT_ON_LINE:
            yield f"{under} was not on the line at {_moment(found.time_s)}{self._when()}."
            return
        yield f"{under} {self._where()} at {_moment(found.time_s)}."
        yield from self._stand()
        yield self._bound()
        yield from self._before()
        yield from self._links()
        yield from self._origins()
        yield from self._cost()

    def _name(self, station: Any) -> str:  # noqa: ANN401 - a cell of a table
        return self._names.get(str(station), str(station))

    def _when(self) -> str:
        start_s, end_s = self._found.on_line_s
        if np.isnan(start_s):
            return ", and never came"
        return f"; it was from {_moment(start_s)} to {_moment(end_s)}"

    def _where(self) -> str:
        sample, last, ahead = self._found.sample, self._found.last, self._found.ahead
        assert sample is not None  # noqa: S101 - whoever has no sample is not on the line
        if self._found.state == AT_PLATFORM and last is not None:
            since = f"since {_moment(last['arrival_s'])}"
            return f"was at its platform at {self._name(last['station'])} ({since})"
        if self._found.state == BETWEEN or sample.speed_mps < STANDS_BELOW_MPS:
            told = f"stood at {sample.front_m:,.0f} m"
        else:
            told = f"ran {KMH_PER_MPS * sample.speed_mps:.0f} km/h at {sample.front_m:,.0f} m"
        if ahead is None:
            return f"{told}, after its last call"
        left_m = abs(ahead["stop_m"] - sample.front_m)
        leg = f"on its way to {self._name(ahead['station'])}"
        if last is not None:
            leg = f"between {self._name(last['station'])} and {self._name(ahead['station'])}"
        return f"{told}, {leg}, {left_m:,.0f} m before its stop"

    def _stand(self) -> Iterator[str]:
        stand = self._found.stand
        if stand is not None:
            yield (
                f"It had come to a stand at {_moment(stand.start_s)} and stood there for "
                f"{_seconds(stand.duration_s)}."
            )

    def _bound(self) -> str:
        sample, since = self._found.sample, ""
        assert sample is not None  # noqa: S101 - the same
        if np.isfinite(self._found.since_s) and self._found.since_s < self._found.time_s:
            since = f", since {_moment(self._found.since_s)}"
        away_m = abs(sample.limit_m - sample.front_m)
        end = f" at {sample.limit_m:,.0f} m" if away_m < FAR_M else ""
        ahead = f", {away_m:,.0f} m ahead" if end else ""
        stands = sample.speed_mps < STANDS_BELOW_MPS
        cause = sample.cause
        if not cause and stands and away_m < AT_END_M and self._found.chain:
            # It stands at the end of its way: whatever it would do otherwise.
            cause = self._found.chain[0].name
        if sample.reason == PLAN:
            whom = f" for {self._who(cause)}" if cause else ""
            told = f"It was bound by the plan of the operation ({label_of(sample.plan)}){whom}"
            return f"{told}{since}; the end of its authority was{end}{ahead}."
        if cause:
            behind = f"{'before' if self._is_place(cause) else 'behind'} {self._who(cause)}"
            if stands and away_m > FAR_FROM_END_M:
                told = f"It was bound by what its protection permits {behind}{since}"
                return f"{told}; the end of its authority{end} was {away_m:,.0f} m ahead."
            return f"It was bound by the end of its authority{end}{ahead}, {behind}{since}."
        return self._bound_by_itself(sample)

    def _before(self) -> Iterator[str]:
        before = self._found.before
        if before is None:
            return
        word = f" by the plan of the operation ({label_of(before.plan)})" if before.plan else ""
        yield f"Until {_moment(before.time_s)} it had been slowed{word} for {before.cause}."

    def _is_place(self, name: str) -> bool:
        return any(link.name == name and link.state == BESIDE for link in self._found.chain)

    def _who(self, name: str) -> str:
        return name if self._is_place(name) else f"train {name}"

    def _bound_by_itself(self, sample: Sample) -> str:
        call, ahead = self._found.last, self._found.next_train
        if sample.reason == DWELLING and call is not None:
            over = call["dwell_delay_s"]
            more = f" and an overstay of {_seconds(over)}" if over >= WORTH_TELLING_S else ""
            return f"Its stop held it: a minimum of {_seconds(call['minimum_dwell_s'])}{more}."
        bound = _BOUND.get(sample.reason, label_of(sample.reason))
        if sample.reason == PEER:
            next_one = f"; train {ahead[0]} was next, {ahead[1]:,.0f} m ahead" if ahead else ""
            return f"It was bound by {bound}{next_one}."
        return f"It was bound by {bound}; nobody ahead was in its way."

    def _links(self) -> Iterator[str]:
        chain = self._found.chain
        for number, link in enumerate(chain):
            told = self._link(link)
            if number == 0:
                yield f"Ahead, {told}."
            else:
                yield f"That one had been held up by another: {told}."
        if chain and chain[-1].state != BESIDE:
            yield self._end(chain[-1])

    def _link(self, link: CauseLink) -> str:
        if link.state == BESIDE:
            return f"beside the track, was {link.name}"
        moment = _moment(link.time_s)
        if link.state == AT_PLATFORM:
            late = _late(link.arrival_delay_s)
            told = f"train {link.name} was at its platform at {self._name(link.station)}, {late}"
        elif link.state == BETWEEN:
            told = f"train {link.name} stood between stations after {self._name(link.station)}"
        else:
            after = f" after {self._name(link.station)}" if link.station else ""
            told = f"train {link.name} was running{after}"
        return f"{told} ({moment})"

    def _end(self, link: CauseLink) -> str:
        if link.beyond_booked_s > 0.0:
            return (
                f"Train {link.name} overstayed by {_seconds(link.overstay_s)} at "
                f"{self._name(link.station)}, {_seconds(link.beyond_booked_s)} more than its "
                "booked dwell absorbs."
            )
        if link.secondary_delay_s >= WORTH_TELLING_S:
            owed = _seconds(link.secondary_delay_s)
            return f"Train {link.name} did not overstay there itself; it owed {owed} to others."
        return f"Train {link.name} made no stop longer than its booked dwell absorbs."

    def _origins(self) -> Iterator[str]:
        found, shares = self._found, self._found.shares[:MOST_ORIGINS]
        if found.ahead is None or not found.ahead["arrival_delay_s"] >= WORTH_TELLING_S:
            return
        total_s = found.ahead["arrival_delay_s"]
        told = [self._share(share) for share in shares if share.share_s >= WORTH_TELLING_S]
        if told:
            there = self._name(found.ahead["station"])
            yield (
                f"Of the {_seconds(total_s)} by which it was late at {there} came {_listed(told)}."
            )

    def _share(self, share: Share) -> str:
        part, own = _seconds(share.share_s), share.train == self._found.train
        if share.kind == OVERSTAY:
            who = "its own overstay" if own else f"the overstay of train {share.train}"
            return f"{part} from {who} at {self._name(share.station)}"
        if share.kind == OWN_RUN:
            who = "its own" if own else f"train {share.train}'s"
            return f"{part} from {who} run, slower than booked"
        if share.kind == IN_THE_WAY:
            return f"{part} from {share.train}, which was in the way and not late itself"
        return f"{part} from nobody the tables name"

    def _cost(self) -> Iterator[str]:
        found, ahead = self._found, self._found.ahead
        if ahead is None:
            return
        there = self._name(ahead["station"])
        if found.state == AT_PLATFORM:
            yield f"It had arrived {_late(ahead['arrival_delay_s'])}."
            return
        if np.isnan(ahead["arrival_s"]):
            yield f"It never arrived at {there}."
            return
        stood = ""
        if found.stood_s >= WORTH_TELLING_S:
            stood = f" and {_seconds(found.stood_s)} at a stand between stations"
        lost = "no time to others"
        if found.lost_s >= WORTH_TELLING_S:
            lost = f"{_seconds(found.lost_s)} to others"
        late = _late(ahead["arrival_delay_s"])
        moment = _moment(ahead["arrival_s"])
        yield f"On that leg it lost {lost}{stood}; it arrived at {there} at {moment}, {late}."


def _moment(time_s: float) -> str:
    return clock(time_s, seconds=True)


def _seconds(duration_s: float) -> str:
    return f"{duration_s:,.0f} s"


def _late(delay_s: float) -> str:
    if abs(delay_s) < WORTH_TELLING_S:
        return "in time"
    return f"{_seconds(abs(delay_s))} {'late' if delay_s > 0.0 else 'early'}"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
