"""Archives of GTFS-realtime vehicle positions: from reports of trains to visits."""

import gzip
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from datetime import tzinfo
from itertools import groupby, pairwise
from pathlib import Path
from statistics import median

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.observing.event_times import epoch_s, midnight_s, service_day_s, zone_of
from kankaku.scenarios.observing.feed_messages import PositionReport, json_reports, protobuf_reports
from kankaku.scenarios.observing.visits import EventsError, ObservedEvents, Visit
from kankaku.scenarios.reading.cell_texts import printable, shown
from kankaku.scenarios.reading.raw import UnreadableError, read_whole

MOST_BYTES = 200_000_000
"""Of a message, or of an archive; unpacked. [-]"""
_JSON, _PROTOBUF = (".json", ".jsonl", ".ndjson"), (".pb", ".bin", ".protobuf")
ENDINGS = (*_JSON, *_PROTOBUF)
FORMS = f"a folder, a .zip or a file of messages ({', '.join(ENDINGS)}; .gz of each)"


def read_vehicle_positions(path: Path, line: str = "", timezone: str = "") -> ObservedEvents:
    """
    Read observed events from saved messages of vehicle positions.

    Parameters
    ----------
    path
        A message, or a folder or an archive of them.
    line
        Only trains with this route; all where it is empty.
    timezone
        Of the line; universal time where it is empty.

    Returns
    -------
    ObservedEvents
        A visit for every train that reported itself as standing at a stop.

    Raises
    ------
    EventsError
        With every message that cannot be read.
    """
    zone = zone_of(timezone)
    mistakes: list[str] = []
    reports: set[PositionReport] = set()
    for name, content in _messages(path):
        try:
            reports.update(_reports(name, content))
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            mistakes.append(f"{printable(name)}: {error}; allowed: a FeedMessage")
    routes = sorted({report.route for report in reports})
    if line and line not in routes and not mistakes:
        allowed = ", ".join(filter(None, routes)) or "no line, because no report names one"
        mistakes.append(f"{path.name}: no reports of line {shown(line)}; allowed: {allowed}")
    if mistakes:
        raise EventsError(tuple(mistakes))
    chosen = [report for report in reports if not line or report.route == line]
    visits = [visit for own in _by_train(chosen) for visit in _visits(own, zone)]
    if not visits:
        told = f"{path.name}: no train reported that it stood at a stop"
        raise EventsError((f"{told}; allowed: current_status STOPPED_AT with a stop_id",))
    notes = SourceNotes(f"Dwells were worked out from the vehicle positions of `{path.name}`.")
    notes.take("arrival", "first report of a train with current_status STOPPED_AT and this stop_id")
    notes.take("departure", "first report of the train after it")
    every_s = _interval_s(chosen)
    notes.assume("resolution", f"{every_s:g} s", "the median between two reports of a train")
    zone_told = timezone or "universal time"
    notes.assume("time zone", zone_told, "asked for" if timezone else "--timezone names another")
    return ObservedEvents(visits, notes, {visit.station: visit.station for visit in visits})


def _reports(name: str, content: bytes) -> Iterator[PositionReport]:
    if name.endswith(".gz"):
        try:
            name, content = name[:-3], gzip.decompress(content)
        except (OSError, EOFError, zlib.error) as error:
            msg = "is no file of gzip, or cut off"
            raise ValueError(msg) from error
    if name.casefold().endswith(_PROTOBUF):
        yield from protobuf_reports(content)
    else:
        yield from json_reports(content.decode("utf-8-sig"))


def _messages(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the messages of a folder, an archive or a file with their names."""
    if path.is_dir():
        files = [file for file in sorted(path.rglob("*")) if file.is_file() and _is_one(file.name)]
        if not files:
            raise EventsError((f"{path.name}: no messages in the folder; allowed: {FORMS}",))
        for file in files:
            yield file.name, _content(file)
    elif path.suffix.casefold() == ".zip":
        try:
            with zipfile.ZipFile(path) as archive:
                items = [item for item in archive.infolist() if _is_one(item.filename)]
                if sum(item.file_size for item in items) > MOST_BYTES:
                    told = f"{path.name}: is too long to be read; allowed: 200 million bytes"
                    raise EventsError((told,))
                for item in items:
                    yield item.filename, archive.read(item)
        except (zipfile.BadZipFile, zlib.error, OSError, RuntimeError) as error:
            told = f"{path.name}: is no archive that can be read; allowed: {FORMS}"
            raise EventsError((told,)) from error
    else:
        yield path.name, _content(path)


def _is_one(name: str) -> bool:
    return name.casefold().removesuffix(".gz").endswith(ENDINGS)


def _content(path: Path) -> bytes:
    try:
        content = read_whole(path, MOST_BYTES)
    except UnreadableError as error:
        told = f"{path.name}: {error.problem}; allowed: {error.allowed}"
        raise EventsError((told,)) from error
    if content is None:
        raise EventsError((f"{path}: the file is missing; allowed: {FORMS}",))
    return content


def _key(report: PositionReport) -> tuple[str, str]:
    return report.date, report.trip or report.vehicle


def _by_train(reports: Iterable[PositionReport]) -> Iterator[list[PositionReport]]:
    ordered = sorted(reports, key=lambda report: (*_key(report), report.time_s))
    for _, own in groupby(ordered, key=_key):
        yield list(own)


def _visits(reports: Sequence[PositionReport], zone: tzinfo | None) -> Iterator[Visit]:
    """Yield the visits of a train from its reports in order."""
    first_s = epoch_s(reports[0].time_s, zone)
    day_s = midnight_s(reports[0].date)
    if day_s is None:
        day_s = service_day_s(first_s)
    train = f"{day_s:.0f} {reports[0].trip or reports[0].vehicle}"
    standing: Visit | None = None
    for number, report in enumerate(reports):
        now_s = epoch_s(report.time_s, zone)
        goes_on = report.is_standing and standing is not None and standing.station == report.stop
        if standing is not None and not goes_on:
            yield standing._replace(departure_s=now_s)
            standing = None
        if report.is_standing and standing is None:
            # Who stands already when it is seen first came some time before.
            came_s = now_s if number else None
            place = f"{report.stop} {report.route} {report.direction}"
            standing = Visit(train, report.stop, place, day_s, came_s, None)
    if standing is not None and standing.arrival_s is not None:
        yield standing


def _interval_s(reports: Iterable[PositionReport]) -> float:
    gaps_s = [
        other.time_s - one.time_s
        for own in _by_train(reports)
        for one, other in pairwise(own)
        if other.time_s > one.time_s
    ]
    return float(median(gaps_s)) if gaps_s else 0.0
