"""Small networks as files: a single track with a loop, a terminal, and a junction."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.radio_spec import LOSSLESS
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.testing.example_lines import world_of
from kankaku.testing.toy_engine import ToyEngine
from tests.property.runs import Observed

Files = Mapping[str, str]
Delays = Mapping[str, Mapping[str, float]]
LENGTH_M = 100.0
STATION = "id,name,name_local,chainage_km,lon_deg,lat_deg\n"
DWELL = "station,minimum_dwell_s,booked_dwell_s,delay_scale\n"
NODE = "id,km,kind,fouling_start_km,fouling_end_km,throw_s,proof_s\n"
TRACK = "id,from_node,to_node,direction,across\n"
PLATFORM = "station,track,start_km,end_km,stop_km\n"
CALL = "train,station,track,arrival,departure\n"

MAIN = """\
schema_version = 1
title = "Small network"
seed = 1
step_s = 0.5
patience_min = 30.0

[turn_back]
minimum_s = 60.0

[controllers.close_up]
protection = "moving_block"
operation = "close_up"
"""

STOCK = """\
schema_version = 1

[train.unit]
cars = 5
length_m = 100.0
mass_t = 200.0
motor_mass_t = 120.0
rotating_mass_percent = 8.0
maximum_speed_kmh = 72.0
service_brake_kmhps = 3.6
emergency_brake_kmhps = 4.5

[train.unit.traction]
starting_force_kn = 180.0
power_speed_kmh = 40.0
characteristic_speed_kmh = 70.0

[train.unit.supply]
traction_efficiency_percent = 85.0
regeneration_efficiency_percent = 80.0
regeneration_force_kn = 180.0
regeneration_power_kw = 2500.0
regeneration_cutoff_kmh = 5.0
auxiliary_kw = 100.0
"""


def stations(**at_km: float) -> str:
    """Return the rows of stations with the file's head."""
    rows = (f"{name},{name},{name},{km:g},139,35" for name, km in at_km.items())
    return STATION + "\n".join(rows) + "\n"


def dwells(*names: str, minimum_s: float = 20.0) -> str:
    """Return the dwell times of stations, all alike."""
    rows = (f"{name},{minimum_s:g},{minimum_s:g},1" for name in names)
    return DWELL + "\n".join(rows) + "\n"


LOOP: Files = {
    "scenario.toml": MAIN,
    "rolling_stock.toml": STOCK,
    "stations.csv": stations(a=0.0, m=1.0, b=2.0),
    "dwell_stations.csv": dwells("a", "m", "b"),
    "nodes.csv": NODE
    + """\
A,-0.15,buffer,-0.15,-0.15,0,0
w,0.75,points,0.72,0.78,2,1
e,1.15,points,1.12,1.18,2,1
B,2.15,buffer,2.15,2.15,0,0
""",
    "tracks.csv": TRACK
    + """\
left,A,w,both,1.5
up,w,e,rising,1
down,w,e,falling,2
right,e,B,both,1.5
""",
    "platforms.csv": PLATFORM
    + """\
a,left,-0.11,0.01,0.0
m,up,0.89,1.01,1.0
m,down,0.89,1.01,0.9
b,right,1.89,2.01,2.0
""",
    "services.csv": "train,train_type,next_train\nr1,unit,f2\nf1,unit,\nf2,unit,\n",
    "calls.csv": CALL
    + """\
r1,a,left,07:00:00,07:01:00
r1,m,up,07:02:40,07:03:10
r1,b,right,07:04:50,07:05:10
f1,b,right,07:00:00,07:01:00
f1,m,down,07:02:40,07:03:10
f1,a,left,07:04:50,07:05:10
f2,b,right,07:05:10,07:07:00
f2,m,down,07:08:40,07:09:00
f2,a,left,07:10:40,07:11:00
""",
}
"""A single track with a loop in the middle: r1 and f1 meet there, f2 is r1's stock."""

TERMINAL: Files = {
    "scenario.toml": MAIN,
    "rolling_stock.toml": STOCK,
    "stations.csv": stations(a=0.0, b=2.0),
    "dwell_stations.csv": dwells("a", "b"),
    "nodes.csv": NODE
    + """\
W,-0.5,boundary,-0.5,-0.5,0,0
x,1.6,points,1.55,1.65,4,1
E,2.2,buffer,2.2,2.2,0,0
""",
    "tracks.csv": TRACK
    + """\
in,W,x,rising,1
out,W,x,falling,2
p1,x,E,both,1
p2,x,E,both,2
""",
    "platforms.csv": PLATFORM
    + """\
a,in,-0.11,0.01,0.0
a,out,-0.11,0.01,-0.1
b,p1,1.89,2.01,2.0
b,p2,1.89,2.01,2.0
""",
    "services.csv": "train,train_type,next_train\nr1,unit,f1\nf1,unit,\nr2,unit,f2\nf2,unit,\n",
    "calls.csv": CALL
    + """\
r1,a,in,07:00:00,07:01:00
r1,b,p1,07:04:00,07:04:20
f1,b,p1,07:04:20,07:05:30
f1,a,out,07:08:00,07:08:20
r2,a,in,07:03:00,07:04:00
r2,b,p2,07:07:00,07:07:20
f2,b,p2,07:07:20,07:08:30
f2,a,out,07:11:00,07:11:20
""",
}
"""A terminal with two tracks behind scissors."""

JUNCTION: Files = {
    "scenario.toml": MAIN,
    "rolling_stock.toml": STOCK,
    "stations.csv": stations(n=0.0, s=0.05, e=2.0),
    "dwell_stations.csv": dwells("n", "s", "e"),
    "nodes.csv": NODE
    + """\
N,-0.5,boundary,-0.5,-0.5,0,0
S,-0.45,boundary,-0.45,-0.45,0,0
j,1.0,points,0.95,1.05,4,1
E,2.5,boundary,2.5,2.5,0,0
""",
    "tracks.csv": TRACK
    + """\
n-in,N,j,rising,1
n-out,N,j,falling,2
s-in,S,j,rising,3
s-out,S,j,falling,4
in,j,E,rising,2
out,j,E,falling,3
""",
    "platforms.csv": PLATFORM
    + """\
n,n-in,-0.11,0.01,0.0
n,n-out,-0.11,0.01,-0.1
s,s-in,-0.06,0.06,0.05
s,s-out,-0.06,0.06,-0.05
e,in,1.89,2.01,2.0
e,out,1.89,2.01,1.9
""",
    "services.csv": "train,train_type\nn1,unit\ns1,unit\n",
    "calls.csv": CALL
    + """\
n1,n,n-in,07:00:00,07:01:00
n1,e,in,07:03:20,07:03:40
s1,s,s-in,07:01:00,07:02:00
s1,e,in,07:04:20,07:04:40
""",
}
"""Two branches and a trunk, each with a track for either direction."""


def write(folder: Path, files: Files, **changed: str) -> Path:
    """
    Write a network.

    Parameters
    ----------
    folder
        Where; it is made.
    files
        Texts by name.
    changed
        Other texts, or further files, by the part of the name before the dot.
    """
    folder.mkdir(parents=True, exist_ok=True)
    kinds = {name.split(".")[0]: name for name in files}
    others = {kinds.get(stem, f"{stem}.csv"): text for stem, text in changed.items()}
    for name, text in {**files, **others}.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def network(folder: Path, files: Files = LOOP, **changed: str) -> Scenario:
    """Write a network and load it."""
    return load(write(folder, files, **changed))


def mistakes_of(folder: Path, files: Files, **changed: str) -> tuple[Mistake, ...]:
    """Return what is wrong with a network."""
    with pytest.raises(ScenarioError) as caught:
        network(folder, files, **changed)
    return caught.value.mistakes


def changed(files: Files, name: str, old: str, new: str) -> dict[str, str]:
    """Return a file with one passage replaced, which must occur once."""
    assert files[name].count(old) == 1, (name, old)
    return {Path(name).stem: files[name].replace(old, new)}


def overstays_s(world: World, delays_s: Delays) -> FloatArray:
    """
    Return dwell delays of some trains.

    Parameters
    ----------
    world
        Line and timetable.
    delays_s
        Delay by station, by train. [s]

    Returns
    -------
    FloatArray
        Delay of every call. [s], shape (n_trains, n_calls_max)
    """
    found = np.zeros((world.size, world.stop_m.shape[1] - 1))
    for row, service in enumerate(world.timetable.services):
        for column, call in enumerate(service.calls):
            found[row, column] = delays_s.get(service.train, {}).get(call.station, 0.0)
    return found


def run_network(
    scenario: Scenario,
    operation: str = "close_up",
    *,
    controller: Controller | None = None,
    protection: str = "moving_block",
    delays_s: Delays | None = None,
    engine_of: Callable[[World, FloatArray, float], ToyEngine] = ToyEngine,
) -> tuple[RunRecord, Observed]:
    """Run a network over the plain engine; trains may overstay, by train and station. [s]"""
    world = world_of(scenario)
    delay_s = overstays_s(world, delays_s or {})
    engine = Observed(engine_of(world, delay_s, scenario.step_s))
    spec = ControllerSpec("test", protection, operation, {}, {})
    whole = Run(world, delay_s, scenario.seed, scenario.patience_s, scenario.disruptions, LOSSLESS)
    record = simulate(whole, engine, controller or build(spec, world, LOSSLESS), all_meters(world))
    return record, engine


def row_of(record: RunRecord, train: str) -> int:
    """Return the row of a train."""
    return record.world.timetable.trains.index(train)


def arrival_s(record: RunRecord, train: str, station: str) -> float:
    """Return when a train stopped at a station. [s]"""
    return float(record.arrival_s[row_of(record, train), _call(record, train, station)])


def departure_s(record: RunRecord, train: str, station: str) -> float:
    """Return when a train left a station. [s]"""
    return float(record.departure_s[row_of(record, train), _call(record, train, station)])


def _call(record: RunRecord, train: str, station: str) -> int:
    calls = record.world.timetable.services[row_of(record, train)].calls
    return next(number for number, call in enumerate(calls) if call.station == station)
