"""Results in the formats of other programs, each read back by a reader that is not ours."""

import csv
import io
import zipfile
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree as ET

import duckdb
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import sumolib

from kankaku.analysis.exports.fcd_file import fcd_lines
from kankaku.analysis.exports.gtfs_feed import GtfsNames, gtfs_feed
from kankaku.analysis.exports.railsim_columns import RAILSIM_COLUMNS, railsim_frame
from kankaku.analysis.exports.tidy_parquet import tidy_columns, tidy_parquet
from kankaku.analysis.results import stations_frame
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.arrays import FloatArray
from kankaku.railway.step.records import RAW_TABLES
from kankaku.sumo_net.names import safe
from tests.unit.asked_folder import OPERATIONS, TRAINS, queue_runs, queue_scenario

NAMES = GtfsNames(
    line="Queue",
    agency="Nobody",
    timezone="Asia/Tokyo",
    first_day="20260314",
    places_deg={"west": (139.6, 35.9), "east": (139.7, 35.8)},
    local_names={"west": "西", "east": "東"},
)
HOSTILE = '</vehicle><script>alert("x")</script>&\x00'


@pytest.fixture(scope="module")
def run() -> RunTables:
    return queue_runs()[0]


def renamed(run: RunTables, name: str) -> RunTables:
    """Return a run whose first train has another name."""
    frames: dict[str, Any] = {
        table: frame.assign(train=frame["train"].replace("T1", name)) if "train" in frame else frame
        for table, frame in run.frames.items()
    }
    return replace(run, **frames)


def drawn(chainage_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a line that runs to the north-east."""
    return chainage_m * 0.6, chainage_m * 0.8


def test_railsim_has_targets_as_booked_and_every_sample(run: RunTables) -> None:
    text = railsim_frame(run, "queue").to_csv(index=False)
    rows = list(csv.DictReader(io.StringIO(text)))
    assert tuple(rows[0]) == RAILSIM_COLUMNS
    simulated = [row for row in rows if row["type"] == "simulated"]
    target = [row for row in rows if row["type"] == "target"]
    assert len(simulated) == len(run.trajectory)
    assert len(target) == 2 * len(run.calls)
    assert {row["line_id"] for row in rows} == {"queue"}
    for train in run.calls["train"].unique():
        own = [row for row in simulated if row["vehicle_id"] == train]
        raw = run.trajectory[run.trajectory["train"] == train]
        assert [float(row["time"]) for row in own] == raw["time_s"].tolist()
        run_m = raw["front_m"].to_numpy() - raw["front_m"].iloc[0]
        assert np.allclose([float(row["distance"]) for row in own], run_m, atol=0.001)
        assert "east" in {row["stop_id"] for row in own}
    booked_s = run.calls[["booked_arrival_s", "booked_departure_s"]].to_numpy().ravel()
    assert [float(row["time"]) for row in target] == booked_s.tolist()


def test_sumo_reads_the_floating_car_data(run: RunTables) -> None:
    text = "".join(fcd_lines(run, drawn, safe))
    file = io.StringIO(text)
    seen = {
        (float(step.time), vehicle.id): (float(vehicle.x), float(vehicle.y), float(vehicle.angle))
        for step in sumolib.xml.parse(file, "timestep")
        for vehicle in step.getChildList()
    }
    raw = run.trajectory
    assert len(seen) == len(raw)
    for row in rows_of(raw.iloc[:: len(raw) // 50]):
        x_m, y_m, angle_deg = seen[row["time_s"], safe(row["train"])]
        front_m = row["front_m"]
        assert (x_m, y_m) == pytest.approx((0.6 * front_m, 0.8 * front_m), abs=0.006)
        assert angle_deg == pytest.approx(np.degrees(np.arctan2(0.6, 0.8)), abs=0.01)


def test_hostile_names_stay_names_in_the_floating_car_data(run: RunTables) -> None:
    root = ET.fromstring("".join(fcd_lines(renamed(run, HOSTILE), drawn, safe)))  # noqa: S314
    assert {child.tag for step in root for child in step} == {"vehicle"}
    assert len({child.get("id") for step in root for child in step}) == TRAINS


def read_feed(archive: bytes) -> dict[str, pd.DataFrame]:
    """Read a feed as strictly as its reference demands: texts, every file, every reference."""
    with zipfile.ZipFile(io.BytesIO(archive)) as feed:
        assert feed.testzip() is None
        tables = {
            name.removesuffix(".txt"): pd.read_csv(feed.open(name), dtype="str")
            for name in feed.namelist()
        }
    required = {
        "agency": {"agency_name", "agency_url", "agency_timezone"},
        "stops": {"stop_id", "stop_name", "stop_lat", "stop_lon"},
        "routes": {"route_id", "route_type", "route_long_name"},
        "trips": {"route_id", "service_id", "trip_id"},
        "stop_times": {"trip_id", "arrival_time", "departure_time", "stop_id", "stop_sequence"},
        "calendar_dates": {"service_id", "date", "exception_type"},
    }
    for name, columns in required.items():
        assert columns <= set(tables[name].columns)
    assert set(tables["trips"]["route_id"]) <= set(tables["routes"]["route_id"])
    assert set(tables["trips"]["service_id"]) <= set(tables["calendar_dates"]["service_id"])
    assert set(tables["stop_times"]["trip_id"]) == set(tables["trips"]["trip_id"])
    assert set(tables["stop_times"]["stop_id"]) <= set(tables["stops"]["stop_id"])
    return tables


def seconds(clocks: pd.Series) -> np.ndarray:
    hours, minutes, rest = (clocks.str.split(":").str[part].astype(int) for part in range(3))
    return (3600 * hours + 60 * minutes + rest).to_numpy()


def test_a_feed_has_the_actual_times(run: RunTables) -> None:
    feed = gtfs_feed(run, stations_frame(queue_scenario().line), NAMES)
    tables = read_feed(feed.archive)
    times = tables["stop_times"]
    assert len(times) == len(run.calls)
    assert feed.left_out == ()
    assert np.abs(seconds(times["arrival_time"]) - run.calls["arrival_s"]).max() <= 0.5
    assert np.abs(seconds(times["booked_arrival_time"]) - run.calls["booked_arrival_s"]).max() == 0
    assert (seconds(times["departure_time"]) >= seconds(times["arrival_time"])).all()
    assert tables["stops"].set_index("stop_id").loc["west", "stop_lat"] == "35.900000"
    assert tables["stops"]["stop_desc"].tolist() == ["西", "東"]
    again = gtfs_feed(run, stations_frame(queue_scenario().line), NAMES)
    assert again.archive == feed.archive


def test_a_call_that_was_never_reached_is_not_in_the_feed(run: RunTables) -> None:
    calls = run.calls.copy()
    last = calls.index[calls["train"] == "T6"][-1]
    calls.loc[last, ["arrival_s", "departure_s"]] = np.nan
    late = calls["train"] == "T5"
    calls.loc[late, ["arrival_s", "departure_s"]] += 86_400.0 - 25_200.0
    feed = gtfs_feed(replace(run, calls=calls), stations_frame(queue_scenario().line), NAMES)
    assert feed.left_out == ("T6",)
    times = read_feed(feed.archive)["stop_times"]
    assert "T6" not in set(times["trip_id"])
    assert (times[times["trip_id"] == "T5"]["arrival_time"] >= "24:00:00").all()


@pytest.mark.parametrize("table", RAW_TABLES)
def test_tidy_tables_hold_what_the_runs_hold(table: str) -> None:
    runs = queue_runs()
    content = pq.read_table(io.BytesIO(tidy_parquet(runs, table)))
    assert content.column_names == [column.name for column in tidy_columns(table)]
    for column in tidy_columns(table):
        told = content.schema.field(column.name).metadata
        assert told[b"meaning"].decode() == column.meaning
        assert told[b"unit"].decode() == column.unit
    frame = content.to_pandas()
    for run in runs:
        own = frame[frame["controller"].astype(str) == run.controller]
        assert len(own) == len(run.frames[table])
        for column in RAW_TABLES[table]:
            raw, read = run.frames[table][column.name], own[column.name]
            assert read.astype(raw.dtype).tolist() == pytest.approx(raw.tolist(), nan_ok=True)


def test_a_tidy_table_answers_a_question_in_sql(tmp_path_factory: pytest.TempPathFactory) -> None:
    file = tmp_path_factory.mktemp("tidy") / "interstation_stops.parquet"
    file.write_bytes(tidy_parquet(queue_runs(), "interstation_stops"))
    with duckdb.connect() as base:
        query = f"select controller, sum(duration_s) from '{file}' group by controller"  # noqa: S608
        told = base.execute(query).fetchall()
    wanted = {run.controller: run.interstation_stops["duration_s"].sum() for run in queue_runs()}
    wanted = {name: total for name, total in wanted.items() if total}
    assert dict(told) == pytest.approx(wanted)
    assert set(wanted) <= set(OPERATIONS)
