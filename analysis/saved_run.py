"""Where the trains of a saved run were, for those who work with its results."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.results import read_results, run_folder
from kankaku.analysis.tables.columns import by_train
from kankaku.analysis.tables.run_tables import table_file
from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import KankakuError
from kankaku.railway.step.records import TRAJECTORY

_FULL = 0.99
"""Share of the longest way that makes a trip a whole one. [-]"""


class SavedRunError(KankakuError):
    """A results folder that holds no run to work with; says what to do."""


class Trip(NamedTuple):
    """Where one train was."""

    time_s: FloatArray
    """Rising. [s], shape (n_samples,)"""
    front_m: FloatArray
    """[m], shape (n_samples,)"""


@dataclass(frozen=True, slots=True, eq=False)
class SavedRun:
    """The trips of one run."""

    folder: Path
    controller: str
    seed: int
    scenario: str
    """Its name; empty if the results do not say."""
    scenario_digest: str
    """Of the scenario as it was run; empty if the results do not say."""
    trips: tuple[Trip, ...]

    @property
    def start_s(self) -> float:
        """When the first train enters, seconds after midnight. [s]"""
        return min(float(trip.time_s[0]) for trip in self.trips)

    @property
    def end_s(self) -> float:
        """When the last train leaves. [s]"""
        return max(float(trip.time_s[-1]) for trip in self.trips)

    def fronts_m(self, times_s: FloatArray) -> FloatArray:
        """
        Return where the trains were.

        Parameters
        ----------
        times_s
            Seconds after midnight. [s], shape (n_times,)

        Returns
        -------
        FloatArray
            Fronts; not a number while a train is not on the line. [m], shape (n_times, n_trains)
        """
        columns = [
            np.interp(times_s, trip.time_s, trip.front_m, left=np.nan, right=np.nan)
            for trip in self.trips
        ]
        return np.column_stack(columns)

    @property
    def typical_trip(self) -> Trip:
        """The trip of median duration among those over the whole line, from time 0."""
        lengths_m = [abs(float(trip.front_m[-1] - trip.front_m[0])) for trip in self.trips]
        whole = [
            trip
            for trip, length_m in zip(self.trips, lengths_m, strict=True)
            if length_m >= _FULL * max(lengths_m)
        ]
        whole.sort(key=lambda trip: float(trip.time_s[-1] - trip.time_s[0]))
        time_s, front_m = whole[len(whole) // 2]
        return Trip(time_s - time_s[0], front_m)

    def evenly_spaced_m(self, trains: int, times_s: FloatArray) -> FloatArray:
        """
        Return where trains would be that all make the typical trip, one evenly after the other.

        Parameters
        ----------
        trains
            So many are on the line at any time. [-]
        times_s
            Times from 0 on. [s], shape (n_times,)

        Returns
        -------
        FloatArray
            Fronts. [m], shape (n_times, n_trains)
        """
        trip = self.typical_trip
        period_s = float(trip.time_s[-1])
        since_s = times_s[:, np.newaxis] + np.arange(trains) * period_s / trains
        return np.interp(since_s % period_s, trip.time_s, trip.front_m)


def read_saved_run(folder: Path, controller: str | None = None) -> SavedRun:
    """
    Read where the trains of a saved run were.

    Parameters
    ----------
    folder
        Results folder.
    controller
        Under which controller; the first one of the results if None.

    Returns
    -------
    SavedRun
        Its first seed and initial delay.

    Raises
    ------
    SavedRunError
        If there is no such run, or its trajectory cannot be read.
    """
    try:
        results = read_results(folder, trajectories=False)
        run = results.run(controller or results.controllers[0])
    except FileNotFoundError as error:
        raise SavedRunError(str(error)) from error
    except (KeyError, IndexError) as error:
        msg = f"{folder}: no run of {controller!r}; allowed: {', '.join(results.controllers)}"
        raise SavedRunError(msg) from error
    except (ValueError, OverflowError) as error:
        msg = f"{folder}: cannot be read ({error}); allowed: what `python run.py` wrote"
        raise SavedRunError(msg) from error
    file = _trajectory_file(folder, run.controller, run.seed, run.initial_delay_s)
    samples = _samples(file)
    return SavedRun(
        folder=folder,
        controller=run.controller,
        seed=run.seed,
        scenario=str(results.provenance.get("scenario", "")),
        scenario_digest=str(results.provenance.get("scenario_sha256", "")),
        trips=tuple(
            Trip(own["time_s"].to_numpy(), own["front_m"].to_numpy())
            for _, own in by_train(samples)
            if len(own) > 1
        ),
    )


def _trajectory_file(folder: Path, controller: str, seed: int, delay_s: float) -> Path:
    places = (
        run_folder(folder, controller, seed, delay_s, seeds=1),
        run_folder(folder, controller, seed, seeds=2),
        run_folder(folder, controller, seed, seeds=1),
    )
    files = [place / table_file("trajectory") for place in places]
    return next((file for file in files if file.is_file()), files[-1])


def _samples(file: Path) -> pd.DataFrame:
    names = ["time_s", "train", "front_m"]
    if not file.is_file():
        msg = f"{file}: the file is missing; allowed: what `python run.py` wrote"
        raise SavedRunError(msg)
    try:
        samples = pd.read_parquet(file, engine="pyarrow", columns=names)
        samples = samples.astype({"time_s": "float64", "front_m": "float64"})
    except (OSError, TypeError, ValueError, KeyError) as error:
        wanted = ", ".join(column.name for column in TRAJECTORY)
        msg = f"{file}: cannot be read; allowed: a Parquet table with {wanted}"
        raise SavedRunError(msg) from error
    if not np.isfinite(samples[["time_s", "front_m"]].to_numpy()).all():
        msg = f"{file}: a time or a place is missing; allowed: numbers"
        raise SavedRunError(msg)
    if not samples["train"].value_counts().max() > 1:
        msg = f"{file}: no train ran; allowed: a run with trains"
        raise SavedRunError(msg)
    return samples.sort_values("time_s", kind="stable")
