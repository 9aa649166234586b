"""What became of a failure: what noticed it, what was done about it, and what it cost."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from kankaku.analysis.tables.delay import delay_s
from kankaku.controllers.control_map.map_protection import Memory
from kankaku.controllers.control_map.measuring import CENTRE_ROW, Notice
from kankaku.railway.failures.unit_failures import UnitFailure, Variant
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Authority, LineState, Reason

STOP_S = 1.0
"""Shorter standstills do not count, as elsewhere. [s]"""


AFTER_S = 30.0
"""A brake this long after a failure may still be a reaction to it. [s]"""


Finding: TypeAlias = dict[str, Any]
"""What is found out in a run, as the journal keeps it."""


FINDERS: Mapping[Variant, frozenset[Notice]] = {
    Variant.SLIDE: frozenset({Notice.WHEELS, Notice.BALISE}),
    Variant.SLIP: frozenset({Notice.WHEELS, Notice.BALISE}),
    Variant.WHEEL: frozenset({Notice.WHEELS, Notice.BALISE}),
    Variant.JUMP: frozenset({Notice.TRAIN_STAMP, Notice.REPORT_STAMP, Notice.NO_COMMANDS}),
    Variant.DRIFT: frozenset({Notice.TRAIN_STAMP, Notice.REPORT_STAMP, Notice.NO_COMMANDS}),
    Variant.UP: frozenset({Notice.NO_REPORT}),
    Variant.DOWN: frozenset({Notice.NO_COMMANDS}),
    Variant.BOTH: frozenset({Notice.NO_REPORT, Notice.NO_COMMANDS}),
    Variant.BAND: frozenset({Notice.EXCLUSION}),
    Variant.LEFT_OUT: frozenset({Notice.EXCLUSION, Notice.NO_COMMANDS}),
    Variant.RUN: frozenset({Notice.EXCLUSION}),
    Variant.IGNORED: frozenset({Notice.EXCLUSION}),
    Variant.CENTRE_JUMP: frozenset({Notice.CENTRE_CLOCK}),
    Variant.CENTRE_SILENT: frozenset({Notice.NO_COMMANDS}),
}
"""Whose alarms find a failure; equipment finds its own at once."""


class Witness:
    """Stands before a protection and remembers what it knew."""

    def __init__(self, failure: UnitFailure | None) -> None:
        self.last: Memory | None = None
        self.widened: set[int] = set()
        """Rows of the trains whose bands were longer than usual since the failure."""
        self._from_s = np.inf if failure is None else failure.from_s
        self._protection: Any = None

    def watching(self, protection: Any) -> "Witness":  # noqa: ANN401 - a control map
        """
        Return itself in front of a protection.

        Parameters
        ----------
        protection
            A control map.

        Returns
        -------
        Witness
            Can be asked in its stead.
        """
        self._protection = protection
        return self

    def initial(self) -> Memory:
        """Return the memory before the first step."""
        memory: Memory = self._protection.initial()
        return memory

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        """
        Return the authority of every train.

        Parameters
        ----------
        state
            The line.
        memory
            From the step before.

        Returns
        -------
        tuple[Authority, Memory]
            The protection's.
        """
        authority, self.last = self._protection.authorise(state, memory)
        widened_m = self.last.aboard.widened_m
        if state.time_s >= self._from_s and widened_m.any():
            self.widened.update(np.flatnonzero(widened_m).tolist())
        return authority, self.last


def measured(record: RunRecord) -> Finding:
    """Return what is found out about any run."""
    world, trains = record.world, record.world.timetable.trains
    booked_s = world.booked_arrival_s[:, 1:-1]
    late_s = delay_s(record.arrival_s[:, 1:], booked_s, record.end_s)
    long = record.standstills.duration_s >= STOP_S
    samples = record.trajectory
    braked = (samples.reason == Reason.EMERGENCY) & (samples.speed_mps > 0.0)
    events = record.violations
    return {
        "delay_s": float(np.nanmean(late_s)),
        "stopped": sorted({trains[row] for row in record.standstills.row[long].tolist()}),
        "braked": sorted({trains[row] for row in samples.row[braked].tolist()}),
        "unsafe_events": len(events),
        "first_event": events[0].message if events else "",
    }


def finding_about(failure: UnitFailure | None, record: RunRecord, witness: Witness) -> Finding:
    """Return what became of a failure."""
    if failure is None or witness.last is None:
        return {}
    detection, found_s = _detected(failure, record, witness.last)
    return {
        "kind": failure.kind.value,
        "variant": failure.variant.value,
        "unit": failure.unit,
        "onset_s": failure.from_s,
        "duration_s": failure.duration_s,
        "size": failure.size,
        "detection": detection,
        "detected_after_s": None if found_s is None else found_s - failure.from_s,
        "reactions": _reactions(failure, record, witness),
    }


def _detected(failure: UnitFailure, record: RunRecord, memory: Memory) -> tuple[str, float | None]:
    """Return what found a failure, and when. [s]"""
    if failure.variant not in FINDERS:
        found_s = [
            item.established_s
            for item in record.obstructions
            if item.id == f"{failure.unit}: {failure.variant.value}"
        ]
        return ("the equipment itself", found_s[0]) if found_s else ("", None)
    rows = {CENTRE_ROW}
    trains = record.world.timetable.trains
    if failure.unit in trains:
        rows.add(trains.index(failure.unit))
    for alarm in memory.aboard.alarms:
        about = alarm.row in rows or failure.variant is Variant.CENTRE_SILENT
        if about and alarm.notice in FINDERS[failure.variant] and alarm.time_s >= failure.from_s:
            return alarm.notice.value, alarm.time_s
    return "", None


def _reactions(failure: UnitFailure, record: RunRecord, witness: Witness) -> list[str]:
    """Return what was done about a failure, in the words of the source's table 3."""
    memory, samples = witness.last, record.trajectory
    if memory is None:
        return []
    trains = record.world.timetable.trains
    about = {trains.index(failure.unit)} if failure.unit in trains else set(range(len(trains)))
    notices = {
        alarm.notice
        for alarm in memory.aboard.alarms
        if alarm.time_s >= failure.from_s and alarm.row in about | {CENTRE_ROW}
    }
    during = (samples.time_s >= failure.from_s) & (samples.time_s < failure.until_s + AFTER_S)
    braked = during & (samples.reason == Reason.EMERGENCY) & (samples.speed_mps > 0.0)
    braked &= np.isin(samples.row, list(about))
    done = {
        "obstruction set": failure.variant in {Variant.STATE, Variant.EQUIPMENT},
        "band widened": bool(witness.widened & about)
        or (failure.unit in trains and Notice.NO_REPORT in notices),
        "nothing sent": bool(notices & {Notice.EXCLUSION, Notice.CENTRE_CLOCK}),
        "emergency brake": bool(braked.any()),
        "position corrected": Notice.BALISE in notices,
    }
    return [name for name, was_done in done.items() if was_done]
