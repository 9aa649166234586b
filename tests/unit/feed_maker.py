"""A small good feed to change: a metro of five stations, both directions, two platforms each."""

import io
import zipfile
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.importing.formats import Wish, imported

STATIONS = "ABCDE"
RUN_S, DWELL_S = 120, 30


def clock(time_s: int) -> str:
    """Return a time as feeds have it."""
    return f"{time_s // 3600:02d}:{time_s // 60 % 60:02d}:{time_s % 60:02d}"


def calls(
    trip: str, stops: str, begins_s: int, suffix: str = "", dwell_s: int = DWELL_S
) -> list[str]:
    """Return rows of ``stop_times.txt`` for a trip that calls everywhere."""
    rows, at_s = [], begins_s
    for number, stop in enumerate(stops):
        arrives_s = at_s if number else begins_s
        leaves_s = arrives_s + dwell_s if 0 < number < len(stops) - 1 else arrives_s
        times = clock(arrives_s), clock(leaves_s)
        rows.append(",".join((trip, *times, f"{stop}{suffix}", str(number + 1))))
        at_s = leaves_s + RUN_S
    return rows


def good_feed() -> dict[str, str]:
    """Return the files of a feed: four trips out and four back, every ten minutes."""
    stops = [
        f"{name}{way},Station {name},{35.6 + 0.01 * at + 0.0001 * way:.4f},139.7000,"
        for at, name in enumerate(STATIONS)
        for way in (1, 2)
    ]
    times, trips = [], []
    for number in range(4):
        begins_s = 28800 + 600 * number
        times += calls(f"out{number}", STATIONS, begins_s, "1")
        times += calls(f"back{number}", STATIONS[::-1], begins_s + 900, "2")
        trips += [f"M,WD,out{number},0,b{number}", f"M,WD,back{number},1,b{number}"]
    return {
        "agency.txt": "agency_id,agency_name,agency_url,agency_timezone\n"
        "X,Example,http://example.org,Asia/Tokyo\n",
        "stops.txt": "\n".join(["stop_id,stop_name,stop_lat,stop_lon,parent_station", *stops, ""]),
        "routes.txt": "route_id,route_short_name,route_long_name,route_type\nM,M1,Line one,1\n",
        "trips.txt": "\n".join(
            ["route_id,service_id,trip_id,direction_id,block_id", *trips, ""],
        ),
        "stop_times.txt": "\n".join(
            ["trip_id,arrival_time,departure_time,stop_id,stop_sequence", *times, ""]
        ),
        "calendar.txt": "service_id,monday,tuesday,wednesday,thursday,friday,saturday,sunday,"
        "start_date,end_date\nWD,1,1,1,1,1,0,0,20260101,20261231\n",
    }


def write_feed(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write a feed into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)
    return folder


def zipped_feed(place: Path, files: Mapping[str, str | bytes], inside: str = "") -> Path:
    """Write a feed as an archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, text in files.items():
            archive.writestr(inside + name, text)
    place.write_bytes(buffer.getvalue())
    return place


def draft_of(place: Path, files: Mapping[str, str | bytes], wish: Wish | None = None) -> Draft:
    """Import a feed from a folder."""
    return imported("gtfs", write_feed(place / "feed", files), wish or Wish())


def with_line(files: Mapping[str, str], name: str, line: str) -> dict[str, str]:
    """Return a feed with one more row in a file."""
    return {**files, name: files[name] + line + "\n"}


def replaced(files: Mapping[str, str], name: str, old: str, new: str) -> dict[str, str]:
    """Return a feed with a text replaced, which must be there."""
    assert old in files[name]
    return {**files, name: files[name].replace(old, new, 1)}


def rising(values: list[float]) -> bool:
    """Return whether values rise."""
    return all(after > before for before, after in pairwise(values))
