"""The reference: nothing is left out, every example is allowed, and editors get the same."""

import csv
import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from kankaku.scenarios.describing.described_files import (
    ANY_NAME,
    KEY_FILES,
    NEEDED,
    ROW_FILES,
    DescribedFile,
    DescribedKey,
    DescribeError,
    KeySort,
    described_files,
    find_described,
)
from kankaku.scenarios.describing.json_schemas import json_schemas, schema_name
from kankaku.scenarios.describing.key_units import UNITS, unit_of
from kankaku.scenarios.describing.reference_page import reference_page
from kankaku.scenarios.describing.told_reference import WIDTH, told_file, told_files
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.scenarios.reading.neighbours import KNOWN
from kankaku.scenarios.reading.row_formats import columns
from kankaku.scenarios.reading.schema import check
from tests.unit.json_schema import faults
from tests.unit.scenario_folder import FILES, write_scenario

SCENARIOS = Path(__file__).parents[2] / "scenarios"
MEANINGS = tomllib.loads((SCENARIOS / "reading/meanings.toml").read_text("utf-8"))
ALL = described_files()
MADE_FROM = {"public_timetable.csv", "quiet_runs.csv", "public_intervals.csv"}
"""What tools read; no scenario needs them."""
MARGIN = "controllers.NAME.eco_margin_s"


def example_of(file: DescribedFile) -> dict[str, Any]:
    """Return a file with keys that has every key with its example, lists with one table each."""
    data: dict[str, Any] = {}
    for key in file.keys:
        if key.sort is not KeySort.KEY:
            continue
        place: Any = data
        for number, part in enumerate(key.path[:-1]):
            is_list = any(
                one.path == key.path[: number + 1] and one.sort is KeySort.TABLES
                for one in file.keys
            )
            place = place.setdefault(part, [{}] if is_list else {})
            place = place[0] if is_list else place
        place[key.path[-1]] = key.example
    return data


def test_every_file_that_is_read_is_described() -> None:
    assert {name.partition(" ")[0] for name in ALL} == set(KNOWN) - MADE_FROM
    assert set(MEANINGS) == set(ALL)


@pytest.mark.parametrize("name", ROW_FILES)
def test_every_column_is_described_and_no_other(name: str) -> None:
    assert sorted(MEANINGS[name]["keys"]) == sorted(columns(ROW_FILES[name]))
    needed = {key.path[0] for key in ALL[name].keys if key.otherwise == NEEDED}
    assert needed == set(columns(ROW_FILES[name], required=True))


@pytest.mark.parametrize("name", KEY_FILES)
def test_every_key_is_described_and_no_other(name: str) -> None:
    assert {".".join(key.path) for key in ALL[name].keys} == set(MEANINGS[name]["keys"])


@pytest.mark.parametrize("name", ROW_FILES)
def test_the_examples_of_columns_make_a_row_that_is_read(name: str, tmp_path: Path) -> None:
    keys = ALL[name].keys
    file = tmp_path / name.partition(" ")[0]
    header = ",".join(key.path[0] for key in keys)
    row = ",".join(key.example for key in keys)
    file.write_text(f"{header}\n{row}\n", "utf-8")
    reader = Reader()
    table = reader.csv(file, "line", ROW_FILES[name])
    assert not reader.mistakes
    assert len(table.rows) == 1


@pytest.mark.parametrize("name", KEY_FILES)
def test_the_examples_of_keys_make_a_file_that_is_allowed(name: str) -> None:
    found, mistakes = check(KEY_FILES[name], example_of(ALL[name]), name)
    assert not mistakes
    assert found is not None


@pytest.mark.parametrize(
    "key",
    [key for file in ALL.values() for key in file.keys],
    ids=lambda key: key.name,
)
def test_every_description_is_a_sentence_with_what_holds_otherwise(key: DescribedKey) -> None:
    assert key.meaning[0].isupper()
    assert key.meaning.endswith(".")
    assert key.otherwise
    if key.sort in {KeySort.KEY, KeySort.COLUMN}:
        assert key.allowed
        assert key.example is not None
        # What holds where nothing is said must not be told as nothing.
        assert key.otherwise != "none" or key.allowed.startswith(("a list", "a table"))


def test_a_unit_is_the_longest_ending_that_fits() -> None:
    endings = [*UNITS]
    for number, end in enumerate(endings):
        assert not any(end.endswith(shorter) for shorter in endings[:number])
    found = {name: unit_of(name) for name in ("chainage_km", "brake_kmhps", "level", "mass_t")}
    assert found == {"chainage_km": "km", "brake_kmhps": "km/h/s", "level": "", "mass_t": "t"}


def test_every_number_with_a_unit_in_its_name_has_it_in_the_reference() -> None:
    without = {
        key.path[-1]
        for file in ALL.values()
        for key in file.keys
        if "number" in key.allowed and not key.unit
    }
    assert (
        without
        == {
            *("schema_version", "seed", "scale", "trip_correlation", "burst_factor", "cars"),
            *("safety_factor", "cells", "updates_per_cycle", "broadcasts_per_update", "level"),
            *("own_slots_per_cycle", "answer_slots", "trackside_devices", "trackside_devices_max"),
            *("repeats", "trains", "count", "effect", "probability", "across", "delay_scale"),
            *("protection_options", "operation_options", "supervision_options"),
        }
        & without
    )


def test_a_terminal_of_80_columns_holds_every_line() -> None:
    lines = told_files() + [line for file in ALL.values() for line in told_file(file)]
    assert max(map(len, lines)) <= WIDTH < 80
    assert all(
        any(key.name in line for line in lines) for file in ALL.values() for key in file.keys
    )


@pytest.mark.parametrize(
    ("asked", "file", "first", "count"),
    [
        ("calls.csv", "calls.csv", None, 0),
        ("calls.xlsx", "calls.csv", None, 0),
        ("calls.csv.arrival", "calls.csv", "arrival", 1),
        ("calls.csv arrival", "calls.csv", "arrival", 1),
        ("calls.csv: arrival", "calls.csv", "arrival", 1),
        ("tracks.csv of a network across", "tracks.csv of a network", "across", 1),
        ("scenario.toml controllers.eco_margin_s", "scenario.toml", MARGIN, 1),
        ("scenario.toml controllers.atc.eco_margin_s", "scenario.toml", MARGIN, 1),
        ("scenario.toml controllers.NAME.eco_margin_s", "scenario.toml", MARGIN, 1),
        ("scenario.toml eco_margin_s", "scenario.toml", MARGIN, 1),
        ("scenario.toml work_zones.0.from", "scenario.toml", "work_zones.from", 1),
        ("scenario.toml [radio]", "scenario.toml", "[radio]", 6),
        ("scenario.toml from", "scenario.toml", "work_zones.from", 4),
        ("rolling_stock.toml train.x.supply", "rolling_stock.toml", "[train.NAME.supply]", 7),
    ],
)
def test_it_finds_what_is_asked_for(asked: str, file: str, first: str | None, count: int) -> None:
    found, keys = find_described(asked)
    assert found.name == file
    assert len(keys) == count
    assert first is None or keys[0].name == first


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ("call.csv", "'calls.csv' (did you mean that?)"),
        ("calls.csvx", "no such file"),
        ("calls.csv arival", "'arrival' (did you mean that?)"),
        ("scenario.toml controllers.eco_margin", "allowed: eco_margin_s"),
    ],
)
def test_what_is_not_described_is_answered_with_the_likeliest(asked: str, told: str) -> None:
    with pytest.raises(DescribeError) as caught:
        find_described(asked)
    assert told in str(caught.value)


SCHEMAS = {name: json.loads(text) for name, text in json_schemas().items()}


@pytest.mark.parametrize(
    "file", sorted(SCENARIOS.glob("*/*.toml")), ids=lambda file: str(file)[-40:]
)
def test_every_shipped_file_with_keys_fits_its_schema(file: Path) -> None:
    if file.name not in KEY_FILES:
        pytest.skip("no file of a scenario")
    data = json.loads(json.dumps(tomllib.loads(file.read_text("utf-8")), default=str))
    schema = SCHEMAS[schema_name(file.name)]
    assert not [*faults(schema, data, schema)]


@pytest.mark.parametrize("name", KEY_FILES)
def test_the_schema_refuses_what_the_program_refuses(name: str) -> None:
    schema = SCHEMAS[schema_name(name)]
    data = json.loads(json.dumps(example_of(ALL[name])))
    assert not [*faults(schema, data, schema)]
    assert [*faults(schema, {**data, "unknown": 1}, schema)]
    assert [*faults(schema, {**data, "schema_version": 2}, schema)]
    for key in data:
        if ALL[name].keys and any(
            k.path == (key,) and k.otherwise == NEEDED for k in ALL[name].keys
        ):
            assert [*faults(schema, {k: v for k, v in data.items() if k != key}, schema)]


def cell(text: str) -> object:
    try:
        return float(text)
    except ValueError:
        return text


@pytest.mark.parametrize("name", [name for name in FILES if name.endswith(".csv")])
def test_rows_as_objects_fit_their_schema(name: str) -> None:
    schema = SCHEMAS[schema_name(name)]
    rows = [
        {key: cell(text) for key, text in row.items()}
        for row in csv.DictReader(FILES[name].splitlines())
    ]
    assert not [*faults(schema, rows, schema)]
    assert [*faults(schema, [], schema)]
    assert [*faults(schema, [{**rows[0], "unknown": 1}], schema)]


def described(part: Any) -> bool:  # noqa: ANN401
    own = part.get("properties", {}).values()
    return all(one.get("description") and described(one) for one in own)


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_key_of_a_schema_says_what_it_means(name: str) -> None:
    schema = SCHEMAS[name]
    tables = [schema, schema.get("items", {}), *schema.get("$defs", {}).values()]
    assert all(map(described, tables))


def test_the_page_has_every_column_and_key_in_a_row_of_its_own() -> None:
    rows = [line for line in reference_page().splitlines() if line.startswith("| `")]
    assert len(rows) == sum(len(file.keys) for file in ALL.values())
    widths = {len(row.replace("\\|", "").split("|")) for row in rows}
    assert widths == {8}


@pytest.mark.parametrize(
    ("file", "pointer"),
    [
        ("calls.csv", "kankaku describe calls.csv tells every column"),
        ("calls.xlsx, sheet Blatt 1", "kankaku describe calls.csv tells every column"),
        ("scenario.toml", "kankaku describe scenario.toml tells every key"),
        ("my_folder", ""),
    ],
)
def test_mistakes_point_to_the_reference(file: str, pointer: str) -> None:
    error = ScenarioError((Mistake(file, "row 2", "wrong", "right"),))
    assert error.pointer == pointer


def test_a_path_has_names_of_ones_own_only_where_tables_are_named() -> None:
    for file in ALL.values():
        for key in file.keys:
            for number, part in enumerate(key.path):
                before = next((one for one in file.keys if one.path == key.path[:number]), None)
                assert (part == ANY_NAME) == (before is not None and before.sort is KeySort.NAMED)


def test_the_small_scenario_needs_no_more_files_than_are_needed(tmp_path: Path) -> None:
    names = {file.name for file in write_scenario(tmp_path / "small").iterdir()}
    needed = {name for name, file in ALL.items() if file.otherwise == NEEDED}
    assert needed - {"tracks.csv of a network"} <= names
