"""Parts of a draft: circulation, run times, even trips, notes, and files that are not replaced."""

from dataclasses import replace
from pathlib import Path

import pytest

from kankaku.scenarios.drafts.circulation import LONGEST_STAY_S, joined, linked
from kankaku.scenarios.drafts.draft import DraftError, csv_text, write_files
from kankaku.scenarios.drafts.even_trips import every
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.stock_library import library_names, library_train
from kankaku.scenarios.reading.row_formats import GradientRow, LimitRow, StationRow
from tests.unit.sketched_lines import START_S, line, there

RISES = {"up1": True, "up2": True, "down1": False, "down2": False}
# Each trip takes 3 x 100 s and 2 x 30 s from its departure to its last arrival.
UP1, UP2 = there("up1", 0), there("up2", 200)


def follows(*trips: object, **more: object) -> dict[str, str]:
    made = linked(trips, 120.0, RISES, **more)  # type: ignore[arg-type]
    return {one.id: one.next_trip for one in made}


def test_stock_that_came_first_goes_on_first() -> None:
    down1, down2 = there("down1", 500, stations="dcba"), there("down2", 700, stations="dcba")
    assert follows(UP2, UP1, down2, down1) == {
        "up1": "down1",
        "up2": "down2",
        "down1": "",
        "down2": "",
    }


def test_stock_needs_the_least_time_for_turning_back() -> None:
    # Arrival 360 s after the departure; 120 s later it may depart.
    assert follows(UP1, there("down1", 479, stations="dcba"))["up1"] == ""
    assert follows(UP1, there("down1", 480, stations="dcba"))["up1"] == "down1"


def test_stock_does_not_wait_for_hours() -> None:
    latest_s = 360 + int(LONGEST_STAY_S)
    assert follows(UP1, there("down1", latest_s, stations="dcba"))["up1"] == "down1"
    assert follows(UP1, there("down1", latest_s + 1, stations="dcba"))["up1"] == ""


def test_stock_of_other_lines_is_not_joined() -> None:
    down = there("down1", 500, stations="dcba")
    assert follows(UP1, down, going={"up1"})["up1"] == ""
    assert follows(UP1, down, coming={"down1"})["up1"] == ""


def test_stock_does_not_go_on_in_the_same_direction_or_from_elsewhere() -> None:
    assert follows(there("up1", 0, stations="ab"), there("up2", 500, stations="bcd"))["up1"] == ""
    assert follows(there("up1", 0, stations="ab"), there("down1", 500, stations="cb"))["up1"] == ""


def test_joined_trips_begin_when_the_ones_before_end() -> None:
    up, down = joined([replace(UP1, next_trip="down1"), there("down1", 600, stations="dcba")])
    assert down.calls[0].arrival_s == up.calls[-1].departure_s == START_S + 390
    assert down.calls[0].departure_s == START_S + 600


def test_run_time_is_that_of_the_closed_form() -> None:
    runs = Runs(line([]))
    # d / v + v / 2a + v / 2b with 1 m/s2 both and 20 m/s; too short for 20 m/s: 2 sqrt(d / a).
    assert runs.between_s("a", "b", "unit") == pytest.approx(1500 / 20 + 20, abs=0.1)
    near = Runs(line([], km=(0.0, 0.256, 3.0, 4.0)))
    assert near.between_s("a", "b", "unit") == pytest.approx(2 * 256**0.5, abs=0.1)


def test_run_time_obeys_limits_and_gradients_in_both_directions() -> None:
    sketch = line([])
    # Beyond the train's length on both sides, so that 10 m/s hold all the way.
    sketch.limits.append(LimitRow(0, -1.0, 5.0, 36.0))
    assert Runs(sketch).between_s("b", "a", "unit") == pytest.approx(1500 / 10 + 10, abs=0.1)
    steep = line([], km=(0.0, 0.1, 3.0, 4.0))
    steep.gradients.append(GradientRow(0, -1.0, 5.0, 30.0))
    # Gravity moves 200 of 216 t: 9.81 x 0.03 x 200 / 216, and the whole of it against the brake.
    pull = 9.80665 * 0.03
    for ends, sign in (("ab", -1.0), ("ba", 1.0)):
        gain = 1.0 + sign * pull * 200.0 / 216.0
        brake = 1.0 - sign * pull
        least_s = (2.0 * 100.0 * (1.0 / gain + 1.0 / brake)) ** 0.5
        found_s = Runs(steep).between_s(*ends, "unit")
        assert found_s == pytest.approx(least_s, rel=0.02)


def test_wrong_train_is_refused_in_words() -> None:
    sketch = line([])
    sketch.train_types = {"unit": {"length_m": -1.0}}
    with pytest.raises(DraftError, match=r"train\.unit"):
        Runs(sketch)


def test_even_trips_have_their_headway_and_time_to_run() -> None:
    sketch = line([])
    runs = Runs(sketch)
    trips = every(300.0, 3, sketch.stops, runs, train_type="unit", first_s=START_S)
    assert [one.id for one in trips] == ["001", "002", "003", "004", "005", "006"]
    starts_s = [one.calls[0].departure_s for one in trips[::2]]
    assert starts_s == [START_S, START_S + 300, START_S + 600]
    # 95 s and 5 per cent, in steps of five seconds.
    assert trips[0].calls[1].arrival_s - trips[0].calls[0].departure_s == 100
    assert trips[1].calls[-1].station == "a"


def test_every_train_of_the_library_is_one_that_can_run() -> None:
    for name in library_names():
        found = library_train(name)
        sketch = line([])
        sketch.train_types = {"unit": found.entry}
        assert 60.0 < Runs(sketch).between_s("a", "b", "unit") < 600.0, name
        assert found.title, name
        assert found.source, name


def test_unknown_train_is_refused_with_the_likeliest_one() -> None:
    with pytest.raises(DraftError, match="did you mean that"):
        library_train("metr")


def test_files_are_not_replaced_without_being_told_to(tmp_path: Path) -> None:
    write_files({"a.csv": "old"}, tmp_path)
    with pytest.raises(DraftError, match=r"a\.csv: is there already; allowed: another folder"):
        write_files({"a.csv": "new", "b.csv": "new"}, tmp_path)
    assert (tmp_path / "a.csv").read_text("utf-8") == "old"
    assert not (tmp_path / "b.csv").exists()
    write_files({"a.csv": "new", "b.csv": "new"}, tmp_path, force=True)
    assert (tmp_path / "a.csv").read_text("utf-8") == "new"


def test_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    with pytest.raises(DraftError, match="cannot be written"):
        write_files({"a.csv": ""}, tmp_path / "file" / "folder")


def test_columns_that_say_nothing_are_left_out() -> None:
    plain = [StationRow(0, "a", "A", 0.0), StationRow(0, "b", "B", 1.25)]
    assert csv_text(plain) == "id,name,chainage_km\na,A,0\nb,B,1.25\n"
    told = [plain[0], StationRow(0, "b", "B", 1.25, "い")]
    assert csv_text(told) == "id,name,chainage_km,name_local\na,A,0,\nb,B,1.25,い\n"


def test_notes_tell_everything_once_and_keep_their_tables() -> None:
    notes = SourceNotes("A sheet of paper.", "none")
    for _ in range(2):
        notes.take("stations", "column | name")
        notes.assume("dwell", "30 s", "usual")
    notes.miss("signals", "none")
    text = notes.markdown("Line")
    assert text.count("column \\| name") == 1
    assert text.count("30 s") == 1
    assert "Terms: none" in text
    assert "# Line: sources and assumptions" in text
    assert "What is taken" not in SourceNotes("nothing").markdown("Line")
