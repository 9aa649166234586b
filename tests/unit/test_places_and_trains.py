"""What happened at each station and to each train, and times of day as clocks show them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.results import WRITTEN_TABLES, columns_frame
from kankaku.analysis.tables.columns import (
    clock_texts,
    csv_text,
    read_csv,
    rows_frame,
    typed_frame,
    written_columns,
)
from kankaku.analysis.tables.places_and_trains import (
    BY_STATION,
    BY_TRAIN,
    by_station,
    by_train_frame,
)
from kankaku.analysis.tables.run_tables import run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.railway.step.records import Column
from tests.records import READY_S, run_times_s
from tests.unit.asked_folder import queue_runs, write_queue
from tests.unit.test_remaining_stops import queue


def tables_of_the_queue() -> pd.DataFrame:
    record = queue()
    return by_station([run_tables(record, run_times_s(record.world, 90.0, 110.0))])


def test_a_station_is_told_by_hand() -> None:
    mid = tables_of_the_queue().set_index("station").loc["mid"]
    # Booked at 130, 250 and 370; there at 120, 325 and 410.
    assert mid["mean_arrival_delay_s"] == pytest.approx((-10.0 + 75.0 + 40.0) / 3.0, abs=0.001)
    assert mid["largest_arrival_delay_s"] == 75.0
    # Away at 240, 345 and 430.
    assert mid["mean_dwell_s"] == pytest.approx((120.0 + 20.0 + 20.0) / 3.0, abs=0.001)
    assert (mid["least_headway_s"], mid["mean_headway_s"]) == (85.0, 95.0)
    assert (mid["primary_delay_s"], mid["interstation_stops"]) == (90.0, 2)
    assert mid["interstation_stop_time_s"] == 20.0


def test_a_train_is_told_by_hand() -> None:
    record = queue()
    run = run_tables(record, run_times_s(record.world, 90.0, 110.0))
    second = by_train_frame([run]).set_index("train").loc["T2"]
    assert (second["origin"], second["destination"]) == ("west", "east")
    assert second["booked_departure_s"] == READY_S + 150.0
    assert second["arrival_s"] == READY_S + 455.0
    assert second["final_arrival_delay_s"] == 55.0
    assert second["largest_arrival_delay_s"] == 75.0
    assert (second["interstation_stops"], second["interstation_stop_time_s"]) == (1, 15.0)
    assert bool(second["completed"])


def test_both_tables_agree_with_the_summary() -> None:
    runs = queue_runs()
    summary = summary_frame(runs).set_index("controller")
    stations = by_station(runs).groupby("controller")
    trains = by_train_frame(runs).groupby("controller")
    for total in ("interstation_stops", "interstation_stop_time_s", "primary_delay_s"):
        assert stations[total].sum().to_dict() == pytest.approx(
            trains[total].sum().to_dict(), abs=0.01
        )
    for name in summary.index:
        own = summary.loc[name]
        assert stations["interstation_stops"].sum()[name] == own["interstation_stops"]
        assert trains["net_kwh"].sum()[name] == pytest.approx(own["energy_net_kwh"], rel=1e-6)
        assert trains["completed"].sum()[name] == own["trains_completed"]


def test_a_train_that_never_arrived_and_a_run_without_calls_have_rows() -> None:
    run = queue_runs()[0]
    calls = run.calls.copy()
    calls.loc[calls["train"] == "T6", ["arrival_s", "departure_s"]] = np.nan
    trains = by_train_frame([replace(run, calls=calls)]).set_index("train")
    assert trains["arrival_s"].isna().to_dict()["T6"]
    assert by_train_frame([]).columns.tolist() == [column.name for column in BY_TRAIN]
    assert by_station([]).columns.tolist() == [column.name for column in BY_STATION]


def test_results_hold_both_tables(tmp_path: Path) -> None:
    folder = write_queue(tmp_path / "queue")
    for name, columns in (("by_station", BY_STATION), ("by_train", BY_TRAIN)):
        assert len(read_csv(folder / f"{name}.csv", columns))


def test_clocks_round_to_seconds_and_go_on_after_midnight() -> None:
    times_s = np.array([0.0, 59.4, 59.5, 27_410.0, 86_399.5, 90_000.0, np.nan])
    assert clock_texts(times_s) == [
        "00:00:00",
        "00:00:59",
        "00:01:00",
        "07:36:50",
        "24:00:00",
        "25:00:00",
        "",
    ]


def test_files_have_clocks_behind_the_declared_columns_and_read_back_without(
    tmp_path: Path,
) -> None:
    columns = (
        Column("train", "str", "", ""),
        Column("arrival_s", "float64", "s", "", clock=True),
        Column("delay_s", "float64", "s", ""),
    )
    frame = typed_frame(
        {"train": ["A", "B"], "arrival_s": [27_410.25, np.nan], "delay_s": [1.0, 2.0]}, columns
    )
    file = tmp_path / "table.csv"
    file.write_text(csv_text(frame, columns))
    assert file.read_text() == (
        "train,arrival_s,delay_s,arrival_clock\nA,27410.250,1.000,07:36:50\nB,,2.000,\n"
    )
    pd.testing.assert_frame_equal(read_csv(file, columns), frame)
    # As earlier versions wrote it.
    file.write_text("train,arrival_s,delay_s\nA,27410.250,1.000\nB,,2.000\n")
    pd.testing.assert_frame_equal(read_csv(file, columns), frame)
    assert rows_frame([], columns).empty
    assert csv_text(rows_frame([], columns), columns) == "train,arrival_s,delay_s,arrival_clock\n"


def test_every_time_of_day_has_a_clock_and_its_meaning() -> None:
    explained = columns_frame().set_index(["table", "column"])
    for table, columns in WRITTEN_TABLES.items():
        names = [column.name for column in written_columns(columns)]
        assert explained.loc[table].index.tolist() == names
        for column in columns:
            if "after midnight" in column.meaning:
                assert column.clock, (table, column.name)
            if column.clock:
                assert column.unit == "s"
                assert f"{column.name.removesuffix('_s')}_clock" in names


def test_the_trajectory_has_a_clock_too(tmp_path: Path) -> None:
    folder = write_queue(tmp_path / "queue")
    samples = pd.read_parquet(folder / "close_up" / "trajectory.parquet")
    assert samples.columns[-1] == "time_clock"
    assert samples["time_clock"].astype(str).tolist() == clock_texts(samples["time_s"].to_numpy())
