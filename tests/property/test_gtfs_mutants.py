"""Feeds with something broken: a sound scenario, or a refusal that says where and why."""

import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.completing import mistakes_of
from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.importing.formats import Wish, imported
from tests.examples import examples
from tests.unit.feed_maker import good_feed, write_feed, zipped_feed

FREQUENT = {
    **good_feed(),
    "frequencies.txt": "trip_id,start_time,end_time,headway_secs,exact_times\n"
    "out0,08:00:00,08:20:00,600,1\nback0,08:15:00,08:40:00,600,0\n",
    "calendar_dates.txt": "service_id,date,exception_type\nWD,20260105,2\n",
    "shapes.txt": "shape_id,shape_pt_lat,shape_pt_lon,shape_pt_sequence\n"
    "s,35.60,139.70,1\ns,35.64,139.70,2\n",
}
STRANGE = (
    *("", " ", "0", "-1", "1e9", "99:99:99", "25:00:00", "8:00:00", "08:00", "nan", "inf", "x"),
    *("2", "20260230", "A1", "out0", '"', '""', ",", ";", "é", "駅", "\x00", "\u202e", "../x"),
    *("1" * 300, "x" * 5000, "08:00:00", "\uff11", "+5", "0x10", "WD", "M"),
)
_NAMED = re.compile(r"(\.txt|--\w+|feed|station|trip|calls\.csv)")


def cells(text: str) -> list[list[str]]:
    """Return a table as rows of cells."""
    return [line.split(",") for line in text.splitlines()]


def joined(table: list[list[str]]) -> str:
    """Return rows of cells as a table."""
    return "\n".join(map(",".join, table)) + "\n"


def another_cell(draw: st.DrawFn, text: str) -> str:
    """Put something strange into a cell."""
    table = cells(text)
    row = table[draw(st.integers(0, len(table) - 1))]
    row[draw(st.integers(0, len(row) - 1))] = draw(st.sampled_from(STRANGE))
    return joined(table)


def another_row(draw: st.DrawFn, text: str) -> str:
    """Leave out a row, write it twice, cut it short or swap it with another one."""
    table = cells(text)
    at, other = (draw(st.integers(0, len(table) - 1)) for _ in range(2))
    kind = draw(st.sampled_from(("out", "twice", "short", "long", "swap", "empty")))
    if kind == "out":
        del table[at]
    elif kind == "twice":
        table.insert(other, table[at])
    elif kind == "short":
        table[at] = table[at][:-1]
    elif kind == "long":
        table[at] = [*table[at], "more"]
    elif kind == "swap":
        table[at], table[other] = table[other], table[at]
    else:
        table.insert(at, [""])
    return joined(table)


def another_column(draw: st.DrawFn, text: str) -> str:
    """Leave out a column, or give two of them one name."""
    table = cells(text)
    at = draw(st.integers(0, len(table[0]) - 1))
    if draw(st.booleans()):
        return joined([row[:at] + row[at + 1 :] for row in table])
    table[0][at] = draw(st.sampled_from((*table[0], "", "Stop_ID")))
    return joined(table)


def other_bytes(draw: st.DrawFn, text: str) -> bytes:
    """Change some bytes, or cut the file short."""
    content = bytearray(text.encode())
    for _ in range(draw(st.integers(1, 3))):
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    return bytes(content[: draw(st.integers(0, len(content)))] if draw(st.booleans()) else content)


CHANGES: tuple[Callable[[st.DrawFn, str], str | bytes], ...] = (
    *(another_cell, another_cell, another_cell, another_row, another_row),
    *(another_column, other_bytes),
)


@st.composite
def broken_feeds(draw: st.DrawFn) -> dict[str, str | bytes]:
    """Return a feed with one to three changes."""
    files: dict[str, str | bytes] = dict(draw(st.sampled_from((good_feed(), FREQUENT))))
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(sorted(files)))
        text = files[name]
        if draw(st.integers(0, 30)) == 0:
            del files[name]
        elif isinstance(text, str) and text.strip():
            files[name] = draw(st.sampled_from(CHANGES))(draw, text)
    return files


def tried(source: Path) -> Draft | None:
    """Import a feed; nothing if it is refused, and then with a reason."""
    try:
        return imported("gtfs", source, Wish())
    except KankakuError as error:
        told = error.sentences
    assert told
    for sentence in told:
        assert _NAMED.search(sentence), sentence
        assert "allowed: " in sentence, sentence
        assert sentence.isprintable(), sentence
    return None


@given(broken_feeds())
@examples(1000)
def test_broken_feeds_are_read_or_refused(files: dict[str, str | bytes]) -> None:
    with TemporaryDirectory() as place:
        draft = tried(write_feed(Path(place) / "feed", files))
    if draft:
        assert not mistakes_of(draft)
        told = {note.what for note in draft.notes.assumed}
        assert {"day", "train", "tracks between stations", "platforms", "points", "blocks"} <= told


@given(st.data())
@examples(300)
def test_broken_archives_are_read_or_refused(data: st.DataObject) -> None:
    with TemporaryDirectory() as place:
        file = zipped_feed(Path(place) / "feed.zip", good_feed())
        content = bytearray(file.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
        end = data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))
        file.write_bytes(bytes(content[:end]))
        draft = tried(file)
    assert draft is None or draft.rows["calls.csv"]


@given(st.data())
@examples(300)
def test_a_refused_cell_is_told_with_its_row(data: st.DataObject) -> None:
    name, column, bad = data.draw(
        st.sampled_from(
            (
                ("stop_times.txt", 1, "8 o'clock"),
                ("stop_times.txt", 2, "08:60:00"),
                ("stop_times.txt", 3, "nowhere"),
                ("stop_times.txt", 4, "-1"),
                ("stops.txt", 2, "200"),
                ("stops.txt", 3, "east"),
                ("stops.txt", 4, "nowhere"),
                ("trips.txt", 3, "2"),
                ("calendar.txt", 1, "yes"),
                ("calendar.txt", 8, "20261301"),
            )
        )
    )
    files: dict[str, str | bytes] = dict(good_feed())
    table = cells(str(files[name]))
    row = data.draw(st.integers(1, len(table) - 1))
    table[row][column] = bad
    files[name] = joined(table)
    with TemporaryDirectory() as place:
        try:
            imported("gtfs", write_feed(Path(place) / "feed", files), Wish())
        except KankakuError as error:
            told = error.sentences
        else:
            told = ()
    assert any(one.startswith(f"{name}: row {row + 1}, column {table[0][column]}:") for one in told)
