"""Reading of scenario files: the good ones become SI, the bad ones are named exactly."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.dwell import Overstay
from kankaku.railway.plan.line import SpeedLimit
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from tests.unit.scenario_folder import FILES, replace, write_scenario

DETECTION = "[train_detection]\nrelease_delay_s = 2.5\n\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def faults_of(folder: Path) -> tuple[Mistake, ...]:
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    return caught.value.mistakes


def only_fault(folder: Path) -> Mistake:
    mistakes = faults_of(folder)
    assert len(mistakes) == 1, mistakes
    assert mistakes[0].problem
    assert mistakes[0].allowed
    return mistakes[0]


def test_units_become_si(folder: Path) -> None:
    scenario = load(folder)
    assert (scenario.name, scenario.seed, scenario.patience_s) == ("small", 7, 600.0)
    assert scenario.line.limits[0] == SpeedLimit(-300.0, 1000.0, 25.0)
    assert scenario.line.gradients[0].gradient == pytest.approx(0.010)
    assert [section.end_m for section in scenario.line.sections] == [1200.0, 1600.0, 3500.0]
    train = scenario.train_types["unit"]
    assert train.mass_kg == 440e3
    assert train.service_brake_mps2 == pytest.approx(5.0 / 3.6)
    assert train.traction.starting_force_n == 335e3
    assert train.supply.traction_efficiency == 0.85
    service = scenario.timetable.services[1]
    assert (service.origin, service.route) == ("middle", ("middle-2", "south-1"))
    assert (service.calls[0].arrival_s, service.calls[0].stop_m) == (25440.0, 1500.0)
    assert scenario.dwell_delays.overstays == (Overstay("A1", "middle", 90.0),)
    assert [call.delay_scale for call in scenario.timetable.services[0].calls] == [0.5, 1.5, 1.0]
    assert scenario.controllers[0].protection_options == {"margin_m": 10.0}


def test_loading_is_deterministic_and_the_digest_follows_the_bytes(folder: Path) -> None:
    first, second = load(folder), load(folder)
    assert first == second
    assert np.array_equal(
        first.dwell_delays.draw(first.timetable, 7), second.dwell_delays.draw(second.timetable, 7)
    )
    replace(folder, "balises.csv", "0.5\n", "0.50\n")
    assert load(folder).digest != first.digest


def test_optional_files_may_be_absent(folder: Path) -> None:
    for name in ("limits", "gradients", "curves", "balises", "blocks", "geometry"):
        (folder / f"{name}.csv").unlink()
    replace(folder, "scenario.toml", "[dwell_delays]\nscale = 1.0\ncap_s = 60.0\n", "")
    replace(folder, "scenario.toml", "trip_correlation = 0.3\n", "")
    (folder / "dwell_quantiles.csv").unlink()
    scenario = load(folder)
    assert scenario.line.blocks == ()
    assert scenario.dwell_delays.scale == 1.0


def test_circuits_divide_their_blocks_and_other_blocks_are_one_circuit(folder: Path) -> None:
    rows = "id,track,start_km,end_km\nm1b,middle-1,1.25,1.6\nm1a,middle-1,1.2,1.25\n"
    (folder / "circuits.csv").write_text(rows, encoding="utf-8")
    replace(folder, "scenario.toml", "[[overstays]]", DETECTION + "[[overstays]]")
    line = load(folder).line
    assert line.release_delay_s == 2.5
    circuits = [(piece.id, piece.start_m, piece.end_m) for piece in line.track_circuits]
    assert circuits == [
        ("n1", -300.0, 500.0),
        ("n2", 500.0, 1200.0),
        ("m1a", 1200.0, 1250.0),
        ("m1b", 1250.0, 1600.0),
        ("m2", 1200.0, 1600.0),
        ("s1", 1600.0, 2500.0),
        ("s2", 2500.0, 3500.0),
    ]


def test_without_circuits_every_block_is_one_and_is_released_after_a_second(folder: Path) -> None:
    line = load(folder).line
    assert line.track_circuits == line.blocks
    assert line.release_delay_s == 1.0


@pytest.mark.parametrize(
    ("new", "where", "allowed"),
    [
        ("release_delay_s = -0.5", "release_delay_s", "from 0 up to 60"),
        ("release_delay_s = 61.0", "release_delay_s", "from 0 up to 60"),
        ('release_delay_s = "long"', "release_delay_s", "number"),
        ("release_delay = 1.0", "release_delay", "'release_delay_s'"),
    ],
)
def test_train_detection(folder: Path, new: str, where: str, allowed: str) -> None:
    detection = DETECTION.replace("release_delay_s = 2.5", new)
    replace(folder, "scenario.toml", "[[overstays]]", detection + "[[overstays]]")
    mistake = only_fault(folder)
    assert (mistake.file, mistake.where) == ("scenario.toml", f"train_detection.{where}")
    assert allowed in mistake.allowed


def test_another_folder_lends_its_line(folder: Path, tmp_path: Path) -> None:
    other = write_scenario(tmp_path / "other")
    for name in ("stations", "tracks", "platforms", "turnouts", "blocks", "dwell_quantiles"):
        (other / f"{name}.csv").unlink()
    replace(other, "scenario.toml", "seed = 7", 'seed = 8\nline = "../small"')
    replace(other, "scenario.toml", "scale = 1.0", 'folder = "../small"\nscale = 1.0')
    scenario = load(other)
    assert scenario.line == load(folder).line
    assert scenario.name == "other"


@pytest.mark.parametrize("named", ["../nowhere", "/"])
def test_a_folder_that_cannot_be_used(folder: Path, named: str) -> None:
    replace(folder, "scenario.toml", "seed = 7", f'seed = 7\nline = "{named}"')
    assert only_fault(folder).where == "line"


@pytest.mark.parametrize(
    "name", [n for n in FILES if n.split(".")[0] in {"scenario", "stations", "calls", "services"}]
)
def test_missing_file(folder: Path, name: str) -> None:
    (folder / name).unlink()
    mistake = only_fault(folder)
    assert (mistake.file, mistake.where) == (name, "")
    assert "missing" in mistake.problem


@pytest.mark.parametrize(
    ("old", "new", "where", "says"),
    [
        ("mass_t = 440.0", "mass_kg = 440000.0", "train.unit.mass_kg", "'mass_t'"),
        ("mass_t = 440.0", "mass_t = -1.0", "train.unit.mass_t", "above 0"),
        ("mass_t = 440.0", "mass_t = nan", "train.unit.mass_t", "number"),
        ("mass_t = 440.0", "mass_t = inf", "train.unit.mass_t", "number"),
        ("mass_t = 440.0", 'mass_t = "heavy"', "train.unit.mass_t", "number"),
        ("mass_t = 440.0", "mass_t = true", "train.unit.mass_t", "number"),
        ("cars = 10", "cars = 0", "train.unit.cars", "from 1 up to 100"),
        ("length_m = 200.0", "", "train.unit.length_m", "from 10 up to 900"),
        ("cars = 10", "cars = 10.5", "train.unit.cars", "whole number"),
        (
            "service_brake_kmhps = 5.0",
            "service_brake_kmhps = 0",
            "train.unit.service_brake_kmhps",
            "from 0.5",
        ),
        (
            "maximum_speed_kmh = 90.0",
            "maximum_speed_kmh = 900",
            "train.unit.maximum_speed_kmh",
            "up to 400",
        ),
        (
            "auxiliary_kw = 200.0",
            "auxilary_kw = 200.0",
            "train.unit.supply.auxilary_kw",
            "'auxiliary_kw'",
        ),
        ("motor_mass_t = 270.0", "motor_mass_t = 441.0", "train.unit.motor_mass_t", "440"),
        (
            "emergency_brake_kmhps = 5.5",
            "emergency_brake_kmhps = 4.0",
            "train.unit.emergency_brake_kmhps",
            "from 5",
        ),
        (
            "characteristic_speed_kmh = 75.0",
            "characteristic_speed_kmh = 35.0",
            "train.unit.traction.characteristic_speed_kmh",
            "from 40",
        ),
    ],
)
def test_rolling_stock(folder: Path, old: str, new: str, where: str, says: str) -> None:
    replace(folder, "rolling_stock.toml", f"\n{old}", f"\n{new}")
    named = {(mistake.file, mistake.where): mistake for mistake in faults_of(folder)}
    assert says in named["rolling_stock.toml", where].allowed


def test_a_controller_may_have_a_supervision(folder: Path) -> None:
    assert load(folder).controllers[0].supervision == "none"
    keys = 'supervision = "hold_for_clear_way"\nsupervision_options = { overstay_s = 5.0 }'
    replace(folder, "scenario.toml", 'operation = "close_up"', f'operation = "close_up"\n{keys}')
    chosen = load(folder).controllers[0]
    assert (chosen.supervision, chosen.supervision_options) == (
        "hold_for_clear_way",
        {"overstay_s": 5.0},
    )


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("step_s = 0.5", "step_s = 50", "step_s"),
        ("schema_version = 1", "schema_version = 2", "schema_version"),
        ("seed = 7", "seed = -7", "seed"),
        ("seed = 7", "sead = 7", "sead"),
        ('title = "Small"', 'title = ""', "title"),
        ("trip_correlation = 0.3", "trip_correlation = 1.0", "dwell_delays.trip_correlation"),
        ("margin_m = 10.0", "margin_m = inf", "controllers.plain.protection_options.margin_m"),
        ("margin_m = 10.0", 'margin_m = "x"', "controllers.plain.protection_options.margin_m"),
        (
            "margin_m = 10.0",
            "margin_m = [1, true]",
            "controllers.plain.protection_options.margin_m",
        ),
        ("margin_m = 10.0", "margin_m = []", "controllers.plain.protection_options.margin_m"),
        ('operation = "close_up"', "", "controllers.plain.operation"),
        (
            'operation = "close_up"',
            'operation = "close_up"\nsupervision = 1',
            "controllers.plain.supervision",
        ),
        (
            'operation = "close_up"',
            'operation = "close_up"\nby_default = 1',
            "controllers.plain.by_default",
        ),
        ('operation = "close_up"', 'operation = "close_up"\nby_default = false', "controllers"),
        (
            'operation = "close_up"',
            'operation = "close_up"\neco_margin_s = 0.0',
            "controllers.plain.eco_margin_s",
        ),
        (
            'operation = "close_up"',
            'operation = "close_up"\neco_reserve = true',
            "controllers.plain.eco_reserve",
        ),
        ('train = "A1"', 'train = "A9"', "overstays.0.train"),
        ('station = "middle"', 'station = "midle"', "overstays.0.station"),
        ("delay_s = 90.0", "delay_s = -1.0", "overstays.0.delay_s"),
    ],
)
def test_main_file(folder: Path, old: str, new: str, where: str) -> None:
    replace(folder, "scenario.toml", old, new)
    assert ("scenario.toml", where) in {(f.file, f.where) for f in faults_of(folder)}


def test_an_option_may_be_a_list_of_numbers(folder: Path) -> None:
    replace(folder, "scenario.toml", "margin_m = 10.0", "margin_m = [90, 45.5, 0]")
    options = load(folder).controllers[0].protection_options
    assert options == {"margin_m": (90.0, 45.5, 0.0)}


def test_an_energy_layer_is_read(folder: Path) -> None:
    assert load(folder).controllers[0].eco_margin_s is None
    text = 'operation = "close_up"'
    replace(folder, "scenario.toml", text, f"{text}\neco_margin_s = 0.5\neco_reserve = true")
    (spec,) = load(folder).controllers
    assert (spec.eco_margin_s, spec.eco_reserve) == (0.5, True)


def test_the_same_controller_twice(folder: Path) -> None:
    path = folder / "scenario.toml"
    text = path.read_text(encoding="utf-8")
    again = '[controllers.plain]\nprotection = "a"\noperation = "b"\n'
    path.write_text(text + again, encoding="utf-8")
    assert only_fault(folder).where == f"line {text.count(chr(10)) + 1}"
    path.write_text(text + again.replace("plain", "Plain"), encoding="utf-8")
    assert only_fault(folder).where == "controllers.Plain"


def test_unreadable_toml_names_the_line(folder: Path) -> None:
    replace(folder, "rolling_stock.toml", "length_m = 200.0", "length_m = = 200.0")
    mistake = only_fault(folder)
    assert (mistake.file, mistake.where) == ("rolling_stock.toml", "line 5")
    (folder / "rolling_stock.toml").write_text('schema_version = "1', encoding="utf-8")
    assert only_fault(folder).where == "line 1"


@pytest.mark.parametrize(
    ("old", "new", "where", "says"),
    [
        ("limit_kmh", "limit_mps", "row 1, column limit_mps", "'limit_kmh'"),
        ("start_km", "start_m", "row 1, column start_m", "'start_km'"),
        (",limit_kmh", "", "row 1, column limit_kmh", "start_km,end_km,limit_kmh"),
        ("limit_kmh", "end_km", "row 1, column end_km", "start_km,end_km,limit_kmh"),
        ("1.0,2.0,75", "1.0,2.0", "row 3", "3 fields"),
        ("1.0,2.0,75", "1.0,2.0,75,1", "row 3", "3 fields"),
        ("1.0,2.0,75", "1.0,2.0,401", "row 3, column limit_kmh", "up to 400"),
        ("1.0,2.0,75", "1.0,2.0,-75", "row 3, column limit_kmh", "from 3"),
        ("1.0,2.0,75", "1.0,2.0,nan", "row 3, column limit_kmh", "number"),
        ("1.0,2.0,75", "1.0,2.0,7_5", "row 3, column limit_kmh", "number"),
        ("1.0,2.0,75", "1.0,2.0,", "row 3, column limit_kmh", "number"),
        ("1.0,2.0,75", "1.0,1e99999,75", "row 3, column end_km", "number"),
    ],
)
def test_csv(folder: Path, old: str, new: str, where: str, says: str) -> None:
    replace(folder, "limits.csv", old, new)
    named = {(mistake.file, mistake.where): mistake for mistake in faults_of(folder)}
    assert says in named["limits.csv", where].allowed


@pytest.mark.parametrize("content", ["", "\n\n"])
def test_empty_csv(folder: Path, content: str) -> None:
    (folder / "stations.csv").write_text(content, encoding="utf-8")
    mistake = only_fault(folder)
    assert (mistake.file, mistake.where, mistake.problem) == (
        "stations.csv",
        "row 1",
        "the file is empty",
    )


def test_csv_without_rows(folder: Path) -> None:
    (folder / "services.csv").write_text("train,train_type\n", encoding="utf-8")
    assert only_fault(folder).where == "row 2"


def test_wrong_encoding_names_the_line(folder: Path) -> None:
    text = FILES["stations.csv"].encode("shift_jis")
    (folder / "stations.csv").write_bytes(text)
    mistake = only_fault(folder)
    assert (mistake.file, mistake.where) == ("stations.csv", "line 2")
    assert "UTF-8" in mistake.allowed


def test_spreadsheet_habits_are_understood(folder: Path) -> None:
    text = FILES["stations.csv"].replace("\n", "\r\n") + "\r\n"
    (folder / "stations.csv").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert load(folder).line.stations[2].name_local == "三"


def test_bad_clock(folder: Path) -> None:
    replace(folder, "calls.csv", "A1,first,north-1,07:00:00", "A1,first,north-1,7:00")
    mistake = only_fault(folder)
    assert (mistake.file, mistake.where) == ("calls.csv", "row 2, column arrival")
    assert "HH:MM:SS" in mistake.allowed


def test_all_faults_of_all_files_at_once(folder: Path) -> None:
    replace(folder, "scenario.toml", "step_s = 0.5", "step_ms = 500")
    replace(folder, "rolling_stock.toml", "cars = 10", "cars = 0")
    replace(folder, "limits.csv", "1.0,2.0,75", "0.9,2.0,75")
    replace(folder, "stations.csv", "二,1.5", "二,x")
    replace(folder, "calls.csv", "A1,middle,middle-1,07:02:30", "A1,middle,middle-1,06:59:30")
    (folder / "balises.csv").write_bytes(b"\xff\xfe")
    places = {(mistake.file, mistake.where) for mistake in faults_of(folder)}
    assert places == {
        ("scenario.toml", "step_ms"),
        ("scenario.toml", "step_s"),
        ("rolling_stock.toml", "train.unit.cars"),
        ("limits.csv", "row 3, column start_km"),
        ("stations.csv", "row 3, column chainage_km"),
        ("calls.csv", "row 3, column arrival"),
        ("balises.csv", "line 1"),
    }


def test_the_message_says_file_place_problem_and_what_is_allowed(folder: Path) -> None:
    replace(folder, "limits.csv", "1.0,2.0,75", "1.0,2.0,500")
    with pytest.raises(ScenarioError, match=r"limits\.csv: row 3, column limit_kmh: .*; allowed: "):
        load(folder)
