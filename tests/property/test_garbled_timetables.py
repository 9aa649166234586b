"""Timetables with anything in any place: a draft, or a refusal in words."""

import json
from collections.abc import Iterator, Sequence
from copy import deepcopy
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.errors import KankakuError
from kankaku.scenarios.importing.formats import Wish, imported
from tests.examples import examples

NAMES = ("A", "B", "C")
WHOLE: dict[str, Any] = {
    "x": [
        {
            "id": f"L.{number}.Weekday",
            "t": f"L.{number}",
            "r": "L",
            "n": str(number),
            "y": "L.Local",
            "nt": ["L.2.Weekday"],
            "tt": [
                {"s": "A", "d": "07:00"},
                {"s": "B", "a": "07:03", "d": "07:04"},
                {"s": "C", "a": "07:08"},
            ],
        }
        for number in (1, 3)
    ],
    "stations": [
        {"id": name, "coord": [139.0 + 0.02 * at, 35.0], "title": {"en": name, "ja": "駅"}}
        for at, name in enumerate(NAMES)
    ],
    "railways": [
        {"id": "L", "title": {"en": "Line"}, "stations": list(NAMES), "carComposition": 4}
    ],
}
anything = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.floats(allow_nan=True),
    st.text(max_size=8),
    st.sampled_from(["07:99", "23:59", "00:00", "A", "L", "\u202e", "x" * 300]),
    st.just([]),
    st.just({}),
    st.just([[], {}]),
)


def places(part: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:  # noqa: ANN401
    """Yield the ways to all values of a structure."""
    if way:
        yield way
    if isinstance(part, dict | list):
        for key, inner in part.items() if isinstance(part, dict) else enumerate(part):
            yield from places(inner, (*way, key))


PLACES = sorted(places(WHOLE), key=str)


@given(st.lists(st.tuples(st.sampled_from(PLACES), anything), min_size=1, max_size=3))
@examples(200)
def test_garbled_timetable_is_drafted_or_refused(
    changes: list[tuple[tuple[Any, ...], Any]],
) -> None:
    data = deepcopy(WHOLE)
    for way, value in changes:
        part: Any = data
        try:
            for key in way[:-1]:
                part = part[key]
            part[way[-1]] = value
        except (KeyError, IndexError, TypeError):
            continue
    with TemporaryDirectory() as folder:
        for name, content in data.items():
            (Path(folder) / f"{name}.json").write_text(json.dumps(content), encoding="utf-8")
        outcome = drafted(Path(folder) / "x.json")
    assert outcome


def drafted(source: Path) -> Sequence[object]:
    """Return the calls of a draft, or what is said instead."""
    try:
        return imported("mini-tokyo-3d", source, Wish()).rows["calls.csv"]
    except KankakuError as error:
        return error.sentences
