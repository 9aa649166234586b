"""Saved results for tests of the page, made without a simulation."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from kankaku.analysis.results import COLUMNS, STATIONS, columns_frame
from kankaku.analysis.tables.columns import csv_text, rows_frame
from kankaku.analysis.tables.run_tables import RunTables, write_run
from kankaku.analysis.tables.summary import SUMMARY, summary_frame
from kankaku.railway.step.records import RAW_TABLES, Column

HOSTILE = "</script><img src=x onerror=alert(1)><script>alert(2)</script>"
"""A name that would be a program if anybody took it for markup."""
STATION_NAMES = {"a": "Alpha", "b": "Beta", "c": "Gamma"}
PLACES_M = {"a": 0.0, "b": 1000.0, "c": 2500.0}


LINE: Mapping[str, object] = {
    "title": "A line",
    "knows_future": [],
    "stations": [
        {"id": key, "name": name, "name_local": f"{name}駅", "chainage_m": PLACES_M[key]}
        | {"longitude_deg": 139.6 + PLACES_M[key] / 1e5, "latitude_deg": 35.9}
        for key, name in STATION_NAMES.items()
    ],
    "tracks": [{"id": "main", "start_m": -300.0, "end_m": 2800.0, "across": 0.0, "ways": [1]}],
    "turnouts": [{"id": "p1", "position_m": 1200.0}],
    "limits": [
        {"start_m": -300.0, "end_m": 2800.0, "limit_mps": 20.0, "track": "", "train_type": ""}
    ],
    "gradients": [{"start_m": 0.0, "end_m": 900.0, "gradient": 0.01, "track": ""}],
    "curves": [],
    "blocks": [{"id": "b1", "track": "main", "start_m": -300.0, "end_m": 1000.0}],
    "train_types": {
        "unit": {
            "length_m": 100.0,
            "mass_kg": 200_000.0,
            "inertial_mass_kg": 216_000.0,
            "service_brake_mps2": 1.0,
            "maximum_speed_mps": 25.0,
            "curve_resistance_m": 0.6,
            "resistance": {"a_n": 2000.0, "b_nspm": 50.0, "c_ns2pm2": 5.0},
            "supply": {
                "traction_efficiency": 0.85,
                "regeneration_efficiency": 0.8,
                "regeneration_force_n": None,
                "regeneration_power_w": None,
                "regeneration_cutoff_mps": 2.0,
                "auxiliary_w": 50_000.0,
            },
        }
    },
    "type_of": {"1A": "unit", "2B": "unit"},
}
"""What results may say of that line."""


def _rows(columns: tuple[Column, ...], rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    empty: Mapping[str, object] = {"str": "", "int64": 0, "float64": 0.0, "bool": False}
    plain = {column.name: empty[column.dtype] for column in columns}
    return rows_frame([{**plain, **row} for row in rows], columns)


def saved_run(controller: str, seed: int = 1, *, late_s: float = 30.0) -> RunTables:
    """
    Return a run of two trains over three stations; the second one waits between two of them.

    Parameters
    ----------
    controller
        Its name.
    seed
        Its seed.
    late_s
        By how much the first train overstays at the second station, and the second one waits. [s]

    Returns
    -------
    RunTables
        The tables.
    """
    calls, samples = [], []
    for number, train in enumerate(("1A", "2B")):
        begin_s = 25200.0 + 120.0 * number
        for sequence, (station, place_m) in enumerate(PLACES_M.items()):
            booked_s = begin_s + place_m / 10.0 + 30.0 * sequence
            lost_s = late_s if (sequence == 2 or (number and sequence == 1)) else 0.0
            over_s = late_s if number == 0 and sequence == 1 else 0.0
            calls.append(
                {
                    "train": train,
                    "sequence": sequence,
                    "station": station,
                    "track": "main",
                    "stop_m": place_m,
                    "booked_arrival_s": booked_s,
                    "booked_departure_s": booked_s + 30.0,
                    "arrival_s": booked_s + lost_s,
                    "departure_s": booked_s + lost_s + over_s + 30.0,
                    "arrival_delay_s": lost_s,
                    "departure_delay_s": lost_s + over_s,
                    "dwell_delay_s": over_s,
                    "primary_delay_s": over_s,
                    "unhindered_arrival_s": booked_s,
                    "secondary_delay_s": lost_s if number else 0.0,
                }
            )
        samples += _samples(number, train, begin_s, late_s)
    stop = {
        "train": "2B",
        "start_s": 25400.0,
        "duration_s": late_s,
        "front_m": 900.125,
        "next_station": "b",
    }
    energy = [
        {"train": train, "net_kwh": 10.5 + late_s / 7.0, "completed": True, "gross_kwh": 20}
        for train in ("1A", "2B")
    ]
    return RunTables(
        controller,
        seed,
        calls=_rows(RAW_TABLES["calls"], calls),
        trajectory=_rows(RAW_TABLES["trajectory"], samples),
        interstation_stops=_rows(RAW_TABLES["interstation_stops"], [stop]),
        remaining_stops=_rows(RAW_TABLES["remaining_stops"], [{**stop, "cause": "1A"}]),
        energy=_rows(RAW_TABLES["energy"], energy),
        violations=_rows(RAW_TABLES["violations"], []),
        obstructions=_rows(RAW_TABLES["obstructions"], []),
        unfinished=_rows(RAW_TABLES["unfinished"], []),
    )


def _samples(number: int, train: str, begin_s: float, late_s: float) -> list[dict[str, object]]:
    stops_s = np.arange(begin_s, begin_s + 400.0)
    front_m = np.clip(np.round(7.123 * (stops_s - begin_s - 30.0), 3), 0.0, 2500.0)
    held = number * (np.abs(stops_s - 25400.0 - late_s / 2) < late_s / 2)
    return [
        {
            "time_s": time_s,
            "train": train,
            "front_m": place_m,
            "speed_mps": 0.0 if waits else 7.123,
            "limit_m": place_m + 321.5,
            "track": "main",
            "reason": "train_ahead" if waits else "traction",
            "cause": "1A" if waits else "",
        }
        for time_s, place_m, waits in zip(
            stops_s.tolist(), front_m.tolist(), held.tolist(), strict=True
        )
    ]


def write_results(
    folder: Path,
    runs: list[RunTables],
    *,
    names: Mapping[str, str] = STATION_NAMES,
    line: Mapping[str, object] | None = None,
    title: str = "A line",
) -> Path:
    """
    Write a results folder.

    Parameters
    ----------
    folder
        Where.
    runs
        What was run.
    names
        Names of the stations by identifier.
    line
        What it says of the line; ``LINE`` if None.
    title
        Title of the scenario.

    Returns
    -------
    Path
        The folder.
    """
    several = len({run.seed for run in runs}) > 1
    for run in runs:
        own = folder / run.controller
        write_run(run, own / f"seed_{run.seed}" if several else own)
    stations = [
        {"station": key, "name": name, "name_local": f"{name}駅", "chainage_m": PLACES_M[key]}
        for key, name in names.items()
    ]
    told = {**LINE, "title": title}
    provenance = {"scenario": "tiny", "controllers": {run.controller: {} for run in runs}}
    texts = {
        "summary.csv": csv_text(summary_frame(runs), SUMMARY),
        "columns.csv": csv_text(columns_frame(), COLUMNS),
        "stations.csv": csv_text(rows_frame(stations, STATIONS), STATIONS),
        "provenance.json": json.dumps(provenance),
        "line.json": json.dumps(told if line is None else line),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, "utf-8")
    return folder
