"""The raw tables of a run: frames with declared columns, and the folder that holds them."""

import io
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from kankaku.analysis.tables import delay
from kankaku.analysis.tables.columns import (
    csv_text,
    read_csv,
    rows_frame,
    typed_frame,
    with_clocks,
    write_whole,
)
from kankaku.analysis.tables.energy import energy_frame
from kankaku.analysis.tables.interstation import stops_frame
from kankaku.analysis.tables.remaining_stops import remaining_stops_frame
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.capacity.delay_bound import arrival_bounds_s
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import (
    CALLS,
    OBSTRUCTIONS,
    RAW_TABLES,
    TRAJECTORY,
    UNFINISHED,
    VIOLATIONS,
    HoldTimes,
    RunRecord,
)
from kankaku.railway.step.state import NO_REASON, NOTHING, Reason

REASONS = tuple(reason.name.lower() for reason in Reason)
"""What may bind a train's speed, as the table ``trajectory`` names it."""
DWELLING, PLAN = REASONS[Reason.DWELLING], REASONS[Reason.PLAN]


@dataclass(frozen=True, slots=True, eq=False)
class RunTables:
    """The raw tables of one run of one controller."""

    controller: str
    seed: int
    calls: pd.DataFrame
    trajectory: pd.DataFrame
    interstation_stops: pd.DataFrame
    remaining_stops: pd.DataFrame
    energy: pd.DataFrame
    violations: pd.DataFrame
    obstructions: pd.DataFrame
    unfinished: pd.DataFrame
    initial_delay_s: float = 0.0
    """By how much the train of a sweep overstays; 0 without a sweep. [s]"""

    @property
    def frames(self) -> Mapping[str, pd.DataFrame]:
        """Frames by table name."""
        return {name: getattr(self, name) for name in RAW_TABLES}


def run_tables(
    record: RunRecord, run_times_s: FloatArray | None = None, *, initial_delay_s: float = 0.0
) -> RunTables:
    """
    Turn the record of a run into tables.

    Parameters
    ----------
    record
        What the run left behind.
    run_times_s
        Run time to each call from the one before, of trains that are not late and of those that
        are, [s], broadcastable to (2, n_trains, n_calls_max); by default
        :func:`kankaku.analysis.tables.delay.technical_run_times_s` of the record's world.
    initial_delay_s
        By how much the train of a sweep overstays; 0 without a sweep. [s]

    Returns
    -------
    RunTables
        The tables, numbers rounded as they are written.
    """
    if run_times_s is None:
        run_times_s = delay.technical_run_times_s(record.world)
    return RunTables(
        controller=record.controller,
        seed=record.seed,
        calls=_calls_frame(record, run_times_s),
        trajectory=_trajectory_frame(record),
        interstation_stops=stops_frame(record),
        remaining_stops=remaining_stops_frame(record),
        energy=energy_frame(record),
        violations=_violations_frame(record),
        obstructions=_obstructions_frame(record),
        unfinished=_unfinished_frame(record),
        initial_delay_s=initial_delay_s,
    )


def _calls_frame(record: RunRecord, run_times_s: FloatArray) -> pd.DataFrame:
    world = record.world
    services = world.timetable.services
    columns = record.arrival_s.shape[1]
    rows, sequence = np.nonzero(np.arange(columns) < world.call_count[:, np.newaxis])
    made = (rows, sequence)
    calls = [call for service in services for call in service.calls]
    arrival_s, departure_s = record.arrival_s[made], record.departure_s[made]
    booked_arrival_s, booked_departure_s = (
        world.booked_arrival_s[made],
        world.booked_departure_s[made],
    )
    minimum_dwell_s, dwell_delay_s = world.minimum_dwell_s[made], record.dwell_delay_s[made]
    nobody_s = np.zeros_like(record.arrival_s)
    held = record.held or HoldTimes(nobody_s, nobody_s)
    stays_s = minimum_dwell_s + dwell_delay_s
    over_s = np.maximum(booked_departure_s, arrival_s + stays_s) + held.open_s[made]
    unhindered_s = delay.unhindered_arrivals_s(world, record.dwell_delay_s, run_times_s)[made]
    return typed_frame(
        {
            "train": [services[row].train for row in rows.tolist()],
            "sequence": sequence,
            "station": [call.station for call in calls],
            "track": [world.line.track_by_id[call.track].physical for call in calls],
            "stop_m": world.chainage_m(rows, world.stop_m[made]),
            "booked_arrival_s": booked_arrival_s,
            "booked_departure_s": booked_departure_s,
            "arrival_s": arrival_s,
            "departure_s": departure_s,
            "arrival_delay_s": delay.delay_s(arrival_s, booked_arrival_s, record.end_s),
            "departure_delay_s": delay.delay_s(departure_s, booked_departure_s, record.end_s),
            "minimum_dwell_s": minimum_dwell_s,
            "dwell_delay_s": dwell_delay_s,
            "primary_delay_s": delay.primary_delay_s(
                booked_arrival_s, booked_departure_s, minimum_dwell_s, dwell_delay_s
            ),
            "unhindered_arrival_s": unhindered_s,
            "arrival_bound_s": arrival_bounds_s(record, run_times_s)[made],
            "secondary_delay_s": delay.secondary_delay_s(
                arrival_s, unhindered_s, booked_arrival_s, record.end_s
            ),
            "stop_error_m": record.stop_error_m[made],
            "held_open_s": held.open_s[made],
            "held_closed_s": held.closed_s[made],
            "closed_doors_s": delay.closed_doors_s(over_s, departure_s),
        },
        CALLS,
    )


def _trajectory_frame(record: RunRecord) -> pd.DataFrame:
    samples, world = record.trajectory, record.world
    track_ids, track = _tracks_under(world, samples.row, samples.front_m)
    trains = pd.array(list(world.timetable.trains), dtype="str")
    plans = pd.array([*samples.plans, ""], dtype="str")
    # Places beside the track count down from below nothing, trains up from above it.
    causes = pd.array([*reversed(samples.places), "", *world.timetable.trains], dtype="str")
    return typed_frame(
        {
            "time_s": samples.time_s,
            "train": trains.take(samples.row),
            "front_m": world.chainage_m(samples.row, samples.front_m),
            "speed_mps": samples.speed_mps,
            "limit_m": world.chainage_m(samples.row, samples.eoa_m),
            "track": pd.array(track_ids, dtype="str").take(track),
            "reason": pd.array(list(REASONS), dtype="str").take(samples.reason),
            "plan": plans.take(
                np.where(samples.plan == NO_REASON, len(samples.plans), samples.plan)
            ),
            "cause": causes.take(samples.cause - NOTHING + len(samples.places)),
        },
        TRAJECTORY,
    )


def _tracks_under(world: World, rows: IntArray, front_m: FloatArray) -> tuple[list[str], IntArray]:
    """Return all physical tracks, and which of them is under each front."""
    line = world.line
    names = list(dict.fromkeys(track.physical for track in line.tracks))
    number_of = {name: number for number, name in enumerate(names)}
    under = np.empty(rows.size, dtype=np.intp)
    order = np.argsort(rows, kind="stable")
    ends = np.searchsorted(rows[order], np.arange(world.size + 1))
    for row, service in enumerate(world.timetable.services):
        own = order[ends[row] : ends[row + 1]]
        tracks = [line.track_by_id[track] for track in service.route]
        starts_m = np.array([track.start_m for track in tracks[1:]])
        numbers = np.array([number_of[track.physical] for track in tracks])
        under[own] = numbers[np.searchsorted(starts_m, front_m[own], side="right")]
    return names, under


def _violations_frame(record: RunRecord) -> pd.DataFrame:
    found = record.violations
    trains = record.world.timetable.trains
    return typed_frame(
        {
            "time_s": [violation.time_s for violation in found],
            "train": [trains[violation.row] if violation.row >= 0 else "" for violation in found],
            "kind": [violation.kind for violation in found],
            "excess": [violation.excess for violation in found],
            "message": [violation.message for violation in found],
        },
        VIOLATIONS,
    )


def _unfinished_frame(record: RunRecord) -> pd.DataFrame:
    found, trains = record.unfinished, record.world.timetable.trains
    return typed_frame(
        {
            "train": [trains[item.row] for item in found],
            "cause": [item.cause for item in found],
            "by": [item.by for item in found],
            "front_m": [
                float(record.world.chainage_m(item.row, np.array(item.front_m))) for item in found
            ],
            "message": [item.sentence for item in found],
        },
        UNFINISHED,
    )


def _obstructions_frame(record: RunRecord) -> pd.DataFrame:
    found = record.obstructions
    return typed_frame(
        {
            "obstruction": [item.id for item in found],
            "cause": [item.cause.value for item in found],
            "tracks": [" ".join(item.tracks) for item in found],
            **{
                name: [getattr(item, name) for item in found]
                for name in ("start_m", "end_m", "requested_s", "established_s", "lifted_s")
            },
        },
        OBSTRUCTIONS,
    )


def table_file(table: str) -> str:
    """
    Return the file name of a raw table.

    Parameters
    ----------
    table
        Name of the table.

    Returns
    -------
    str
        Name within a run's folder.
    """
    return f"{table}.parquet" if table == "trajectory" else f"{table}.csv"


def write_run(tables: RunTables, folder: Path) -> None:
    """
    Write the raw tables of a run; the folder appears complete or not at all.

    Parameters
    ----------
    tables
        What :func:`run_tables` returned.
    folder
        Folder of the run; replaced if it exists. Parents are made.
    """
    partial = folder.with_name(f".{folder.name}.partial")
    former = folder.with_name(f".{folder.name}.former")
    for leftover in (partial, former):
        shutil.rmtree(leftover, ignore_errors=True)
    partial.mkdir(parents=True)
    for name, frame in tables.frames.items():
        file = partial / table_file(name)
        if file.suffix == ".parquet":
            buffer = io.BytesIO()
            # Thousands of times, each of them for every train: kept once.
            shown = with_clocks(frame, TRAJECTORY).astype({"time_clock": "category"})
            shown.to_parquet(buffer, engine="pyarrow", compression="zstd", index=False)
            write_whole(file, buffer.getvalue())
        else:
            write_whole(file, csv_text(frame, RAW_TABLES[name]))
    if folder.exists():
        folder.rename(former)
    partial.rename(folder)
    shutil.rmtree(former, ignore_errors=True)


def read_run(
    folder: Path,
    controller: str,
    seed: int,
    initial_delay_s: float = 0.0,
    *,
    trajectory: bool = True,
) -> RunTables:
    """
    Read the raw tables of a run.

    Parameters
    ----------
    folder
        Folder of the run.
    controller
        Name of its controller.
    seed
        Its seed. [-]
    initial_delay_s
        By how much the train of a sweep overstays; 0 without a sweep. [s]
    trajectory
        Read the trajectory too; it is by far the largest table, and left empty otherwise.

    Returns
    -------
    RunTables
        The same frames that were written.
    """
    frames = {
        name: read_csv(folder / table_file(name), columns)
        for name, columns in RAW_TABLES.items()
        if name != "trajectory"
    }
    if trajectory:
        file = folder / table_file("trajectory")
        if file.exists() and not file.is_file():
            msg = f"{file}: is no file"
            raise ValueError(msg)
        samples = pd.read_parquet(file, engine="pyarrow").drop(
            columns="time_clock", errors="ignore"
        )
    else:
        samples = rows_frame([], TRAJECTORY)
    return RunTables(
        controller, seed, trajectory=samples, initial_delay_s=initial_delay_s, **frames
    )
