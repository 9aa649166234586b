"""A small scenario folder to break: three stations, a second track at the middle one."""

from pathlib import Path

FILES = {
    "scenario.toml": """\
schema_version = 1
title = "Small"
seed = 7
step_s = 0.5
patience_min = 10.0

[dwell_delays]
scale = 1.0
cap_s = 60.0
trip_correlation = 0.3

[[overstays]]
train = "A1"
station = "middle"
delay_s = 90.0

[controllers.plain]
protection = "moving_block"
operation = "close_up"

[controllers.plain.protection_options]
margin_m = 10.0
""",
    "rolling_stock.toml": """\
schema_version = 1

[train.unit]
cars = 10
length_m = 200.0
mass_t = 440.0
motor_mass_t = 270.0
rotating_mass_percent = 8.0
maximum_speed_kmh = 90.0
service_brake_kmhps = 5.0
emergency_brake_kmhps = 5.5

[train.unit.traction]
starting_force_kn = 335.0
power_speed_kmh = 40.0
characteristic_speed_kmh = 75.0

[train.unit.supply]
traction_efficiency_percent = 85.0
regeneration_efficiency_percent = 80.0
regeneration_force_kn = 400.0
regeneration_power_kw = 5000.0
regeneration_cutoff_kmh = 5.0
auxiliary_kw = 200.0
""",
    "stations.csv": """\
id,name,name_local,chainage_km,lon_deg,lat_deg
first,First,一,0.0,139.6,35.9
middle,Middle,二,1.5,139.7,35.8
last,Last,三,3.0,139.8,35.7
""",
    "tracks.csv": """\
section,id,start_km,end_km
north,north-1,-0.3,1.2
middle,middle-1,1.2,1.6
middle,middle-2,1.2,1.6
south,south-1,1.6,3.5
""",
    "platforms.csv": """\
station,track,start_km,end_km,stop_km
first,north-1,-0.205,0.005,0.0
middle,middle-1,1.295,1.505,1.5
middle,middle-2,1.295,1.505,1.5
last,south-1,2.795,3.005,3.0
""",
    "turnouts.csv": """\
id,position_km,fouling_start_km,fouling_end_km
parting,1.2,1.19,1.26
joining,1.6,1.54,1.61
""",
    "limits.csv": """\
start_km,end_km,limit_kmh
-0.3,1.0,90
1.0,2.0,75
""",
    "gradients.csv": """\
start_km,end_km,gradient_permil
0.1,0.5,10
0.5,0.9,-10
""",
    "curves.csv": """\
start_km,end_km,radius_m
0.1,0.5,400
2.0,2.2,600
""",
    "balises.csv": """\
chainage_km
0.5
1.0
""",
    "blocks.csv": """\
id,track,start_km,end_km
n1,north-1,-0.3,0.5
n2,north-1,0.5,1.2
m1,middle-1,1.2,1.6
m2,middle-2,1.2,1.6
s1,south-1,1.6,2.5
s2,south-1,2.5,3.5
""",
    "geometry.csv": """\
chainage_km,lon_deg,lat_deg
-0.3,139.6,35.9
3.5,139.8,35.7
""",
    "services.csv": """\
train,train_type
A1,unit
B2,unit
C3,unit
""",
    "calls.csv": """\
train,station,track,arrival,departure
A1,first,north-1,07:00:00,07:00:30
A1,middle,middle-1,07:02:30,07:03:00
A1,last,south-1,07:05:00,07:05:30
B2,middle,middle-2,07:04:00,07:05:00
B2,last,south-1,07:07:00,07:07:30
C3,first,north-1,07:05:00,07:05:30
C3,middle,middle-1,07:07:30,07:08:00
C3,last,south-1,07:10:00,07:10:30
""",
    "dwell_stations.csv": """\
station,minimum_dwell_s,booked_dwell_s,delay_scale
first,20,30,0.5
middle,20,30,1.5
last,20,30,1.0
""",
    "dwell_quantiles.csv": """\
level,delay_s
0.0,0
0.5,4
1.0,60
""",
}


def write_scenario(folder: Path) -> Path:
    """Write the small scenario and return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def replace(folder: Path, file: str, old: str, new: str) -> None:
    """Replace one passage of one file, which must occur once."""
    text = (folder / file).read_text(encoding="utf-8")
    assert text.count(old) == 1, (file, old)
    (folder / file).write_text(text.replace(old, new), encoding="utf-8")
