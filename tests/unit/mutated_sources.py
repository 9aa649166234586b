"""Sources with something wrong in them, and how an importer takes it."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any, TypeVar

from hypothesis import strategies as st

from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.draft import Draft, write_files
from kankaku.scenarios.importing.formats import Wish, imported
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError

T = TypeVar("T")
STRANGE = st.one_of(
    st.none(),
    st.booleans(),
    st.sampled_from(
        [
            0,
            -1,
            1e308,
            10**400,
            "",
            "x",
            "\x1b[2J",
            "\ud800",
            "y" * 300,
            "0",
            [],
            {},
            [[]],
            [1, 2, 3],
        ]
    ),
    st.floats(allow_nan=False, allow_infinity=False),
)


def places(value: object, above: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Return the key paths of all values of a JSON source."""
    found = [above] if above else []
    if isinstance(value, dict):
        for key, inner in value.items():
            found += places(inner, (*above, key))
    if isinstance(value, list):
        for number, inner in enumerate(value):
            found += places(inner, (*above, number))
    return found


def changed(source: T, place: tuple[str | int, ...], value: object, *, drop: bool) -> T:
    """Return a source with another value at a place, or without it."""
    made = deepcopy(source)
    inner: Any = made
    for key in place[:-1]:
        inner = inner[key]
    if drop:
        del inner[place[-1]]
    else:
        inner[place[-1]] = value
    return made


def write_json(path: Path, value: object) -> Path:
    """Write a JSON source."""
    path.write_text(json.dumps(value), encoding="utf-8")
    return path


def read_or_refused(name: str, source: Path, wish: Wish) -> Draft | None:
    """Import a source; nothing if it is refused, and then with sentences that name a file."""
    sentences: tuple[str, ...] = ()
    try:
        return imported(name, source, wish)
    except KankakuError as error:
        sentences = error.sentences
    assert sentences
    for sentence in sentences:
        assert "\n" not in sentence
        assert "allowed" in sentence or "more mistakes" in sentence, sentence
    return None


def load_or_too_weak(draft: Draft, folder: Path) -> None:
    """Load what was made of a source; nothing but the train itself may be wrong with it."""
    write_files(draft.files(), folder)
    mistakes: tuple[Mistake, ...] = ()
    try:
        load(folder)
    except ScenarioError as error:
        mistakes = error.mistakes
    assert {mistake.file for mistake in mistakes} <= {"rolling_stock.toml"}, mistakes
