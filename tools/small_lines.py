"""Small lines with a few trains, drawn at random, as files of a scenario."""

from itertools import pairwise

import numpy as np

from kankaku.scenarios.reading.units import clock_of

_STOCK = """\
schema_version = 1

[train.unit]
cars = {cars}
length_m = {length_m}
mass_t = {mass_t}
motor_mass_t = {motor_t}
rotating_mass_percent = 8.0
maximum_speed_kmh = {top_kmh}
service_brake_kmhps = {brake}
emergency_brake_kmhps = {emergency}

[train.unit.traction]
starting_force_kn = {force_kn}
power_speed_kmh = 35.0
characteristic_speed_kmh = {fading_kmh}

[train.unit.supply]
traction_efficiency_percent = 85.0
regeneration_efficiency_percent = 80.0
regeneration_force_kn = 200.0
regeneration_power_kw = 3000.0
regeneration_cutoff_kmh = 5.0
auxiliary_kw = 100.0
"""
_MAIN = """\
schema_version = 1
title = "Drawn"
seed = {seed}
step_s = {step_s}
patience_min = 10.0

[dwell_delays]
scale = {scale}
cap_s = 60.0

[controllers.plain]
protection = "{protection}"
operation = "{operation}"
"""
_PROTECTIONS = ("moving_block", "relative_braking")
_OPERATIONS = ("close_up", "two_stage", "eco")


def small_line(random: np.random.Generator) -> dict[str, str]:
    """
    Draw a line of one track with two to five stations and one to four trains.

    Parameters
    ----------
    random
        Source of chance.

    Returns
    -------
    dict[str, str]
        Content by file name.
    """
    stations = int(random.integers(2, 6))
    length_m = float(random.integers(2, 16)) * 10.0
    at_km = [round(float(km), 3) for km in np.cumsum(random.uniform(0.5, 2.5, stations))]
    end_km = round(at_km[-1] + 0.3, 3)
    names = [f"s{number}" for number in range(stations)]
    tables: dict[str, list[list[object]]] = {
        "stations.csv": [["id", "name", "name_local", "chainage_km", "lon_deg", "lat_deg"]],
        "tracks.csv": [["section", "id", "start_km", "end_km"], ["all", "t1", 0.0, end_km]],
        "platforms.csv": [["station", "track", "start_km", "end_km", "stop_km"]],
        "dwell_stations.csv": [["station", "minimum_dwell_s", "booked_dwell_s", "delay_scale"]],
        "services.csv": [["train", "train_type"]],
        "calls.csv": [["train", "station", "track", "arrival", "departure"]],
        "dwell_quantiles.csv": [["level", "delay_s"], [0.0, 0], [0.5, 5], [1.0, 40]],
    }
    for name, km in zip(names, at_km, strict=True):
        tables["stations.csv"].append([name, name.upper(), "\u99c5", km, 139.0 + 0.01 * km, 35.0])
        start_km = round(km - 0.001 * length_m - 0.02, 3)
        tables["platforms.csv"].append([name, "t1", start_km, round(km + 0.02, 3), km])
        tables["dwell_stations.csv"].append([name, 20, 30, 1.0])
    _add_trains(tables, names, at_km, random)
    _add_ground(tables, end_km, random)
    mass_t = float(random.integers(3, 50)) * 10.0
    brake = float(random.choice([2.5, 3.5, 5.0]))
    files = {name: _csv(rows) for name, rows in tables.items()}
    files["rolling_stock.toml"] = _STOCK.format(
        cars=max(1, round(length_m / 20.0)),
        length_m=length_m,
        mass_t=mass_t,
        motor_t=mass_t / 2.0,
        top_kmh=float(random.choice([60.0, 90.0, 130.0])),
        brake=brake,
        emergency=brake + 0.5,
        force_kn=round(mass_t * float(random.uniform(0.5, 1.2)), 1),
        fading_kmh=float(random.choice([40.0, 70.0])),
    )
    files["scenario.toml"] = _MAIN.format(
        seed=int(random.integers(0, 1000)),
        step_s=float(random.choice([0.1, 0.2, 0.5])),
        scale=float(random.choice([0.0, 1.0])),
        protection=random.choice(_PROTECTIONS),
        operation=random.choice(_OPERATIONS),
    )
    return files


def _add_trains(
    tables: dict[str, list[list[object]]],
    names: list[str],
    at_km: list[float],
    random: np.random.Generator,
) -> None:
    headway_s = int(random.integers(120, 400))
    for number in range(int(random.integers(1, 5))):
        train, time_s = f"n{number}", 25200 + number * headway_s
        tables["services.csv"].append([train, "unit"])
        before_km = at_km[0]
        for name, km in zip(names, at_km, strict=True):
            time_s += int(1000.0 * (km - before_km) / 9.0) + 40 * (km > before_km)
            tables["calls.csv"].append([train, name, "t1", clock_of(time_s), clock_of(time_s + 30)])
            time_s, before_km = time_s + 30, km


def _add_ground(
    tables: dict[str, list[list[object]]], end_km: float, random: np.random.Generator
) -> None:
    for file, column, low, high in (
        ("limits.csv", "limit_kmh", 25, 100),
        ("gradients.csv", "gradient_permil", -15, 16),
    ):
        if random.random() < 0.5:
            edges = np.unique(np.round(random.uniform(0.0, end_km, 4), 3)).tolist()
            tables[file] = [["start_km", "end_km", column]]
            for start_km, end in pairwise(edges):
                tables[file].append([start_km, end, int(random.integers(low, high))])


def _csv(rows: list[list[object]]) -> str:
    return "".join(f"{','.join(map(str, row))}\n" for row in rows)
