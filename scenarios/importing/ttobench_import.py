"""Tracks and trains of TTOBench: a line in one direction with stops, limits and gradients."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import Stop
from kankaku.scenarios.importing.formats import Wish
from kankaku.scenarios.importing.one_way import OneWay, drafted
from kankaku.scenarios.importing.one_way_trips import spaced_trips
from kankaku.scenarios.importing.source_keys import KeyPlace, SafeIds, read_json, safe_text
from kankaku.scenarios.importing.wished_stock import library_stock
from kankaku.scenarios.reading.row_formats import CurveRow, GradientRow, LimitRow

HEADWAY_S = 180.0
LENGTH_M = 120.0
"""Of a train whose length no file tells. [m]"""
LONGEST_M = 9.9e6
STRAIGHT_M = 1e5
"""A curve of a greater radius is no curve to a scenario. [m]"""


def read(source: Path, wish: Wish) -> Draft:
    """
    Read a track of TTOBench, and a train where one is named.

    Parameters
    ----------
    source
        JSON file of the track.
    wish
        Train, headway and number of trains.

    Returns
    -------
    Draft
        A chain in the direction of the file.

    Raises
    ------
    SourceError
        With everything that is wrong with the files.
    """
    track = read_json(source)
    title = safe_text(track.at("metadata").at("id").text(), source.stem)
    notes = SourceNotes(f"Track {title!r} of TTOBench, file {source.name}.", _terms(track))
    stops_m = _stops_m(track)
    length_m = stops_m[-1] if stops_m else 0.0
    limits = _stretches(track, "speed limits", ("velocity", "km/h", 3.0, 400.0), length_m)
    gradients = _stretches(track, "gradients", ("slope", "permil", -120.0, 120.0), length_m)
    curves = _curves(track, length_m)
    track.refuse()
    types = stock_of(wish.stock, notes) if wish.stock else library_stock(wish.train, notes)
    way = OneWay(
        title=title,
        notes=notes,
        stops=tuple(
            Stop(f"stop-{number:02d}", f"Stop {number}", _km(place_m))
            for number, place_m in enumerate(stops_m, 1)
        ),
        train_types=types,
        extent_km=(_least_km(stops_m, limits, gradients), _km(length_m)),
        limits=[LimitRow(0, *ends, value) for ends, value in limits],
        gradients=[GradientRow(0, *ends, value) for ends, value in gradients],
        curves=curves,
        goes_on=True,
    )
    notes.take(f"{len(stops_m)} stops", "stops")
    notes.take(f"{len(limits)} speed limits", "speed limits")
    notes.take(f"{len(gradients)} gradients", "gradients")
    if curves:
        notes.take(f"{len(curves)} curves", "curvatures")
        notes.assume("transition curves", "curves of their smaller radius", "a scenario has none")
    notes.assume("names of stations", "Stop 1 and so on", "the source has none")
    if track.has("altitude"):
        notes.miss("altitude of the first stop", "none: only gradients act on trains")
    notes.miss("the other running direction", "trains run one way only, as the source tells it")
    trips = spaced_trips(way, wish, HEADWAY_S)
    return drafted(way, trips)


def _least_km(
    stops_m: Sequence[float], *told: Sequence[tuple[tuple[float, float], float]]
) -> float:
    """Return where the source begins: at its first stop or stretch. [km]"""
    return min([_km(stops_m[0]), *(ends_km[0] for rows in told for ends_km, _ in rows[:1])])


def _terms(place: KeyPlace) -> str:
    told = place.at("metadata")
    return safe_text(told.at("license").text(), "") if told.has("license") else ""


def _unit(place: KeyPlace, wanted: str) -> None:
    place.one_of((wanted,))


def _stops_m(track: KeyPlace) -> list[float]:
    stops = track.at("stops")
    _unit(stops.at("unit"), "m")
    places = stops.at("values").items()
    found = [place.number(-LONGEST_M / 10.0, LONGEST_M) for place in places]
    for place, (before_m, here_m) in zip(places[1:], pairwise(found), strict=False):
        if here_m <= before_m:
            place.wrong(f"is {here_m:g}, not beyond the stop before", f"above {before_m:g}")
    if len(places) < 2:
        stops.at("values").wrong(f"has {len(places)} stops", "two stops or more")
    return found


def _stretches(
    track: KeyPlace, part: str, told: tuple[str, str, float, float], end_m: float
) -> list[tuple[tuple[float, float], float]]:
    """Return start and end [km] of stretches and what holds there; each up to the next one."""
    table = track.at(part)
    key, unit, low, high = told
    _unit(table.at("units").at("position"), "m")
    _unit(table.at("units").at(key), unit)
    starts_m: list[float] = []
    values: list[float] = []
    for row in table.at("values").items():
        cells = row.items()
        if len(cells) != 2:
            row.wrong(f"has {len(cells)} values", "a position and a value")
            continue
        start_m = cells[0].number(-LONGEST_M / 10.0, LONGEST_M)
        if starts_m and start_m <= starts_m[-1]:
            cells[0].wrong(f"is {start_m:g}, not beyond the one before", f"above {starts_m[-1]:g}")
        starts_m.append(start_m)
        values.append(cells[1].number(low, high))
    edges_m = [*starts_m, max(end_m, starts_m[-1] + 1.0)] if starts_m else []
    return [
        ((_km(from_m), _km(to_m)), value)
        for (from_m, to_m), value in zip(pairwise(edges_m), values, strict=False)
        if from_m < end_m
    ]


def _curves(track: KeyPlace, end_m: float) -> list[CurveRow]:
    """Return curves; a radius at the start of a stretch may be another one at its end."""
    if not track.has("curvatures"):
        return []
    table = track.at("curvatures")
    rows = table.at("values").items()
    found: list[tuple[float, float]] = []
    for row in rows:
        cells = row.items()
        if len(cells) < 2:
            row.wrong(f"has {len(cells)} values", "a position and a radius")
            continue
        start_m = cells[0].number(-LONGEST_M / 10.0, LONGEST_M)
        if found and start_m <= found[-1][0]:
            cells[0].wrong(f"is {start_m:g}, not beyond the one before", f"above {found[-1][0]:g}")
        radii_m = [_radius_m(cell) for cell in cells[1:]]
        found.append((start_m, min(radii_m)))
    edges_m = [*(start_m for start_m, _ in found), end_m]
    told = found if len(edges_m) > 1 else []
    return [
        CurveRow(0, _km(from_m), _km(to_m), radius_m)
        for (from_m, to_m), (_, radius_m) in zip(pairwise(edges_m), told, strict=True)
        if radius_m <= STRAIGHT_M and from_m < to_m
    ]


def _radius_m(cell: KeyPlace) -> float:
    if cell.value in ("infinity", "inf", None):
        return 10.0 * STRAIGHT_M
    radius_m = abs(cell.number(-1e9, 1e9))
    if radius_m < 50.0:
        cell.wrong(f"is {radius_m:g}", "50 m or more to either side, or 'infinity'")
    return radius_m


def stock_of(path: Path, notes: SourceNotes) -> dict[str, dict[str, Any]]:
    """
    Read a train of TTOBench.

    Parameters
    ----------
    path
        JSON file.
    notes
        What was taken and assumed is added.

    Returns
    -------
    dict[str, dict[str, Any]]
        One table ``[train.NAME]`` by name.

    Raises
    ------
    SourceError
        With everything that is wrong with the file.
    """
    train = read_json(path)
    name = SafeIds().of(train.at("metadata").at("id").text() or path.stem)

    def told(key: str, unit: str, low: float, high: float) -> float:
        _unit(train.at(key).at("unit"), unit)
        return train.at(key).at("value").number(low, high)

    mass_t = told("mass", "kg", 1000.0, 2e7) / 1000.0
    rotating = told("rho", "%", 0.0, 30.0)
    brakes_kn = told("max reg braking force", "kN", 0.0, 5000.0)
    brakes_kn += told("max pn braking force", "kN", 0.0, 20000.0)
    rate_kmhps = round(3.6 * brakes_kn / (mass_t * (1.0 + rotating / 100.0)), 3)
    if not 0.5 <= rate_kmhps <= 12.0:
        train.at("max pn braking force").at("value").wrong(
            f"with the other brake it is {rate_kmhps:g} km/h/s for this mass", "0.5 to 12 km/h/s"
        )
    entry: dict[str, Any] = {
        "length_m": told("length", "m", 10.0, 900.0) if train.has("length") else LENGTH_M,
        "mass_t": mass_t,
        "rotating_mass_percent": rotating,
        "maximum_speed_kmh": told("max speed", "km/h", 5.0, 400.0),
        "service_brake_kmhps": rate_kmhps,
        "traction": {
            "starting_force_kn": told("max traction force", "kN", 1.0, 5000.0),
            "power_kw": told("max traction power", "kW", 1.0, 50000.0),
        },
        "resistance": {
            "a_kn": told("rolling resistance r0", "kN", 0.0, 1000.0),
            "b_kn_per_kmh": told("rolling resistance r1", "kN/(km/h)", 0.0, 100.0),
            "c_kn_per_kmh2": told("rolling resistance r2", "kN/(km/h)^2", 0.0, 1.0),
        },
        "supply": {
            "traction_efficiency_percent": told("efficiency traction", "%", 1.0, 100.0),
            "regeneration_efficiency_percent": told("efficiency reg brake", "%", 0.0, 100.0),
            "regeneration_force_kn": told("max reg braking force", "kN", 0.0, 5000.0),
            "regeneration_power_kw": told("max reg braking power", "kW", 0.0, 50000.0),
        },
    }
    train.refuse()
    notes.take(f"train {name!r}: mass, speed, forces, powers, resistance, efficiencies", path.name)
    notes.take("service brake: both brake forces over the mass", path.name)
    if not train.has("length"):
        notes.assume("length of the train", f"{LENGTH_M:g} m", "the source has none")
    notes.assume("auxiliaries", "15 kW for every 20 m of train", "the source has none")
    return {name: entry}


def _km(value_m: float) -> float:
    return round(value_m / 1000.0, 6)
