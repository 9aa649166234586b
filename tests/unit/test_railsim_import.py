"""Scenarios of MATSim railsim."""

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.scenarios.drafts.draft import Draft, write_files
from kankaku.scenarios.importing.formats import SourceError, Wish, imported
from kankaku.scenarios.loading.load import load
from tests.examples import examples
from tests.shared_data import SAMPLES
from tests.unit.mutated_sources import load_or_too_weak, read_or_refused

PUBLIC = SAMPLES / "railsim"


def link(name: str, ends: str, length_m: float, speed: float = 30.0, **attributes: object) -> str:
    told = "".join(
        f'<attribute name="railsim{key}" class="x">{value}</attribute>'
        for key, value in attributes.items()
    )
    start, stop = ends.split()
    return (
        f'<link id="{name}" from="{start}" to="{stop}" length="{length_m}" freespeed="{speed}">'
        f"<attributes>{told}</attributes></link>"
    )


NETWORK = "".join(
    [
        "<network><nodes/><links>",
        link("in", "a a", 1.0),
        link("l1", "a b", 2000.0, ResourceId="r1", TrainCapacity=8),
        link("l2", "b c", 400.0, 20.0, ResourceId="r2", TrainCapacity=1, MinimumTime=20.0),
        link("l3", "c d", 300.0, 20.0, ResourceId="r2", TrainCapacity=1, Speed_slow=10.0),
        link("l4", "d e", 1500.0, ResourceId="r3"),
        link("side", "b d", 800.0, ResourceId="r4"),
        link("out", "e e", 1.0),
        "</links></network>",
    ]
)
VEHICLES = """<vehicleDefinitions xmlns="http://www.matsim.org/files/dtd">
<vehicleType id="quick"><attributes>
<attribute name="railsimAcceleration" class="x">0.5</attribute>
<attribute name="railsimDeceleration" class="x">0.6</attribute></attributes>
<length meter="100.0"/><maximumVelocity meterPerSecond="25.0"/></vehicleType>
<vehicleType id="slow"><attributes>
<attribute name="railsimAcceleration" class="x">0.3</attribute>
<attribute name="railsimDeceleration" class="x">0.4</attribute></attributes>
<length meter="300.0"/><maximumVelocity meterPerSecond="20.0"/></vehicleType>
<vehicle id="v1" type="quick"/><vehicle id="v2" type="slow"/><vehicle id="v3" type="quick"/>
</vehicleDefinitions>"""


def route(name: str, links: str, vehicle: str, clock: str, *, calls: bool) -> str:
    middle = (
        '<stop refId="M" arrivalOffset="00:03:00" departureOffset="00:03:30" '
        'minimumStopDuration="00:00:40"/>'
        if calls
        else ""
    )
    way = "".join(f'<link refId="{one}"/>' for one in links.split())
    return (
        f'<transitRoute id="{name}"><routeProfile><stop refId="A" departureOffset="00:00:00"/>'
        f'{middle}<stop refId="E" arrivalOffset="00:06:00"/></routeProfile><route>{way}</route>'
        f'<departures><departure id="{name}_0" departureTime="{clock}" vehicleRefId="{vehicle}"/>'
        "</departures></transitRoute>"
    )


MAIN = "in l1 l2 l3 l4 out"
SCHEDULE = "".join(
    [
        '<transitSchedule><transitStops><stopFacility id="A" linkRefId="in" name="Alpha"/>',
        '<stopFacility id="M" linkRefId="l3"/><stopFacility id="E" linkRefId="out"/>',
        '</transitStops><transitLine id="L">',
        route("stopping", MAIN, "v1", "06:00:00", calls=True),
        route("through", MAIN, "v2", "06:00:00", calls=False),
        route("aside", "in l1 side l4 out", "v3", "06:20:00", calls=False),
        "</transitLine></transitSchedule>",
    ]
)
TWICE = '<departure id="stopping_0" departureTime="06:30:00" vehicleRefId="v3"/>'
FILES = {"net.xml": NETWORK, "schedule.xml": SCHEDULE, "vehicles.xml": VEHICLES}


def folder_of(folder: Path, **changes: str) -> Path:
    folder.mkdir(exist_ok=True)
    for name, text in FILES.items():
        (folder / name).write_text(changes.get(name.partition(".")[0], text), encoding="utf-8")
    return folder


def rows(draft: Draft, file: str, *names: str) -> list[tuple[Any, ...]]:
    return [tuple(getattr(row, name) for name in names) for row in draft.rows[file]]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    return folder_of(tmp_path / "case")


def test_links_become_a_line_with_limits_and_stops(source: Path) -> None:
    draft = imported("railsim", source, Wish())
    assert rows(draft, "stations.csv", "id", "name", "chainage_km") == [
        ("A", "Alpha", 0.0),
        ("M", "M", 2.7),
        ("E", "E", 4.2),
    ]
    assert rows(draft, "limits.csv", "start_km", "end_km", "limit_kmh", "train_type") == [
        (0.0, 2.0, 108.0, ""),
        (2.0, 2.7, 72.0, ""),
        (2.7, 4.2, 108.0, ""),
        (2.4, 2.7, 36.0, "slow"),
    ]


def test_resources_are_blocks_and_those_for_many_are_divided(source: Path) -> None:
    edges = [
        low
        for low, _ in rows(imported("railsim", source, Wish()), "blocks.csv", "start_km", "end_km")
    ]
    assert edges[1:] == [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.7]


def test_trains_have_the_rates_of_their_type(source: Path) -> None:
    entry = imported("railsim", source, Wish()).stock["train"]["quick"]
    force_kn = entry["traction"]["force_speed"][0][1]
    assert force_kn / entry["mass_t"] == pytest.approx(0.5)
    assert entry["service_brake_kmhps"] == pytest.approx(2.16)
    assert entry["maximum_speed_kmh"] == pytest.approx(90.0)


def test_trains_that_are_booked_at_once_follow_each_other(source: Path, tmp_path: Path) -> None:
    draft = imported("railsim", source, Wish(headway_s=240.0))
    calls = rows(draft, "calls.csv", "train", "station", "departure")
    assert ("stopping_0", "A", "06:00:00") in calls
    assert ("through_0", "A", "06:04:00") in calls
    times = rows(draft, "calls.csv", "train", "station", "arrival", "departure")
    assert ("stopping_0", "M", "06:03:00", "06:03:40") in times
    write_files(draft.files(), tmp_path / "made")
    assert not load(tmp_path / "made").warnings
    text = draft.notes.markdown(draft.title)
    for told in (
        "routes on other links: aside",
        "(20 s)",
        "through_0: 240 s after",
        "1 links beside",
    ):
        assert told in text, told


def test_routes_may_have_departures_of_one_name(tmp_path: Path) -> None:
    schedule = SCHEDULE.replace("through_0", "0").replace("stopping_0", "0")
    draft = imported("railsim", folder_of(tmp_path / "case", schedule=schedule), Wish())
    assert rows(draft, "services.csv", "train") == [("L-stopping-0",), ("L-through-0",)]
    write_files(draft.files(), tmp_path / "made")
    assert not load(tmp_path / "made").warnings


def test_a_route_can_be_chosen(source: Path) -> None:
    draft = imported("railsim", source, Wish(route="aside"))
    assert rows(draft, "services.csv", "train") == [("aside_0",)]
    assert rows(draft, "stations.csv", "id", "chainage_km") == [("A", 0.0), ("E", 4.3)]
    with pytest.raises(SourceError, match="unknown route 'asid'"):
        imported("railsim", source, Wish(route="asid"))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"net": NETWORK.replace('length="400.0"', 'length="x"')}, "/link l2 length: is 'x'"),
        ({"net": NETWORK + "<"}, "net.xml: "),
        ({"net": "<!DOCTYPE x [<!ENTITY a 'b'>]><network/>"}, "net.xml: declares entities"),
        ({"net": "<other/>"}, "case: has no file of network"),
        ({"vehicles": VEHICLES.replace('type="slow"', 'type="no"')}, "/vehicle v2 type: is 'no'"),
        ({"vehicles": VEHICLES.replace("railsimAcc", "acc", 1)}, "Acceleration: is missing"),
        ({"schedule": SCHEDULE.replace('refId="l3"', 'refId="q"')}, "is 'q'"),
        ({"schedule": SCHEDULE.replace('<link refId="l2"/>', "")}, "'l3' does not go on from 'l1'"),
        ({"schedule": SCHEDULE.replace("00:03:00", "3 min")}, "arrivalOffset: is '3 min'"),
        ({"schedule": NETWORK}, "is a second file of network"),
        (
            {"schedule": SCHEDULE.replace("<departures>", f"<departures>{TWICE}", 1)},
            "/departure stopping_0 id: stands in this route already",
        ),
        (
            {"schedule": SCHEDULE.replace('"through"', '"stopping"')},
            "/transitRoute stopping id: stands in this line already",
        ),
        (
            {"schedule": SCHEDULE.replace('<stop refId="A"', '<stop refId="M"')},
            "route stopping: no train calls at the first stop along it",
        ),
    ],
)  # fmt: skip
def test_mistakes_name_file_and_element(
    tmp_path: Path, changes: dict[str, str], sentence: str
) -> None:
    with pytest.raises(SourceError) as caught:
        imported("railsim", folder_of(tmp_path / "case", **changes), Wish())
    assert any(sentence in told for told in caught.value.sentences), caught.value.sentences


def test_a_file_instead_of_a_folder_is_refused(source: Path) -> None:
    with pytest.raises(SourceError, match="is no folder"):
        imported("railsim", source / "net.xml", Wish())


VALUES = [
    (name, found.span(1))
    for name, text in FILES.items()
    for found in re.finditer(r'(?:="|>)([^"<>]+)(?:"|<)', text)
]


@examples(150)
@given(
    st.sampled_from(VALUES),
    st.sampled_from(["", "0", "-1", "1e400", "nan", "x", "99:99:99", "10" * 300, "&amp;", "a b"]),
)
def test_changed_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, at: tuple[str, tuple[int, int]], value: str
) -> None:
    folder = tmp_path_factory.mktemp("rs")
    name, (start, stop) = at
    text = FILES[name][:start] + value + FILES[name][stop:]
    source = folder_of(folder / "case", **{name.partition(".")[0]: text})
    draft = read_or_refused("railsim", source, Wish())
    if draft is not None:
        load_or_too_weak(draft, folder / "made")


@pytest.mark.skipif(not PUBLIC.is_dir(), reason="samples that are not part of the project")
def test_public_scenarios_load(tmp_path: Path) -> None:
    for number, source in enumerate(sorted(PUBLIC.glob("*/*"))):
        write_files(imported("railsim", source, Wish()).files(), tmp_path / f"{number}")
        assert not load(tmp_path / f"{number}").warnings
