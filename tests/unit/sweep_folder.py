"""A small sweep: two stations, two trains, and the first one leaves the second station late."""

from pathlib import Path

from tests.unit.scenario_folder import FILES

SWEEP = """
[sweep]
train = "L1"
station = "second"
first_s = 0.0
last_s = 60.0
step_s = 30.0

[published]
source = "A table, 2020"
shortest_interval_s = 51.1
headway_margin_s = 40.0
"""
SWEPT_FILES = {
    "scenario.toml": f"""\
schema_version = 1
title = "Two stations"
seed = 7
step_s = 0.5
patience_min = 10.0
{SWEEP}
[controllers.close_up]
protection = "moving_block"
operation = "close_up"

[controllers.two_stage]
protection = "moving_block"
operation = "two_stage_plain"
""",
    "rolling_stock.toml": FILES["rolling_stock.toml"],
    "stations.csv": """\
id,name,name_local,chainage_km,lon_deg,lat_deg
first,First,一,0.0,139.6,35.9
second,Second,二,1.2,139.7,35.8
""",
    "tracks.csv": "section,id,start_km,end_km\nonly,main,-0.3,2.0\n",
    "platforms.csv": """\
station,track,start_km,end_km,stop_km
first,main,-0.205,0.005,0.0
second,main,0.995,1.205,1.2
""",
    "services.csv": "train,train_type\nL1,unit\nF2,unit\n",
    # No train runs in a minute, so none has slack to lose a delay in.
    "calls.csv": """\
train,station,track,arrival,departure
L1,first,main,07:00:00,07:00:20
L1,second,main,07:01:20,07:01:40
F2,first,main,07:02:00,07:02:20
F2,second,main,07:03:20,07:03:40
""",
    "dwell_stations.csv": """\
station,minimum_dwell_s,booked_dwell_s,delay_scale
first,20,20,1.0
second,20,20,1.0
""",
}


def write_sweep(folder: Path) -> Path:
    """Write the sweep and return its folder."""
    folder.mkdir(parents=True)
    for name, text in SWEPT_FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder
