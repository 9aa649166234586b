"""
The Yizhuang line: stops, limits and gradients of TTOBench, and the invented wayside.

TTOBench [1]_ tells where limits and gradients begin; each holds up to the next one. Before the
first stop and beyond the last one, where trains stand and where they leave the line, the first and
the last of them go on. Platforms, blocks, track circuits and balises are assumed by rules.

References
----------
.. [1] Kouzoupis, Pendharkar, Corman, *TTOBench - an open-source library for train trajectory
   optimization*, Operations Research Forum 4 (67), 2023.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import Any

STATIONS = (
    ("songjiazhuang", "Songjiazhuang", "宋家庄"),
    ("xiaocun", "Xiaocun", "肖村"),
    ("xiaohongmen", "Xiaohongmen", "小红门"),
    ("jiugong", "Jiugong", "旧宫"),
    ("yizhuangqiao", "Yizhuangqiao", "亦庄桥"),
    ("yizhuang-wenhuayuan", "Yizhuang Wenhuayuan", "亦庄文化园"),
    ("wanyuanjie", "Wanyuanjie", "万源街"),
    ("rongjing-dongjie", "Rongjing Dongjie", "荣京东街"),
    ("rongchang-dongjie", "Rongchang Dongjie", "荣昌东街"),
    ("tongjinanlu", "Tongjinanlu", "同济南路"),
    ("jinghailu", "Jinghailu", "经海路"),
    ("ciqunan", "Ciqunan", "次渠南"),
    ("ciqu", "Ciqu", "次渠"),
    ("yizhuang-railway-station", "Yizhuang Railway Station", "亦庄火车站"),
)
"""Identifier, name and local name of the stations in running order."""
ENDS_DEG = ((116.422, 39.844), (116.602, 39.813))
"""Rough longitude and latitude of the ends; nothing is worked out from those of stations. [deg]"""
SECTION, TRACK = "yizhuang", "yizhuang-1"
BEFORE_M, BEYOND_M = 200.0, 300.0
"""The line of the model begins and ends so far outside the first and the last stop. [m]"""
PLATFORM_M = (-119.0, 1.0)
"""A platform, from the stop position: in the middle of the 60 km/h that the data have there. [m]"""
PLATFORM_BLOCK_M = (-150.0, 60.0)
"""The block of a platform, from the stop position. [m]"""
LONGEST_BLOCK_M = 350.0
CIRCUIT_M = 35.0
FINE_M = (-150.0, 130.0)
"""Blocks are divided into circuits here, from the stop position. [m]"""
BALISES_M = (-600.0, -250.0, -20.0)
"""Balises before every stop position, from there. [m]"""
BALISE_SPACING_M = 600.0
NEAREST_BALISES_M = 300.0
"""No spaced balise is nearer than so to those before the next stop. [m]"""

Rows = list[list[object]]


class SourceError(ValueError):
    """A file that is not the line of TTOBench."""


@dataclass(frozen=True, slots=True)
class TtoLine:
    """What TTOBench tells of a line."""

    stops_m: tuple[float, ...]
    limits_kmh: tuple[tuple[float, float], ...]
    """Place from which a limit holds, and the limit. [m], [km/h]"""
    gradients_permil: tuple[tuple[float, float], ...]
    """Place from which a gradient holds, and the gradient. [m], [permil]"""


def read_ttobench(path: Path) -> TtoLine:
    """
    Read a track file of TTOBench.

    Parameters
    ----------
    path
        JSON file.

    Returns
    -------
    TtoLine
        Stops, limits and gradients.

    Raises
    ------
    SourceError
        If the file has other parts, units or numbers of stops.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        stops = data["stops"]
        if stops["unit"] != "m" or len(stops["values"]) != len(STATIONS):
            msg = f"{path}: stops: allowed: {len(STATIONS)} places in m"
            raise SourceError(msg)
        return TtoLine(
            stops_m=tuple(map(float, stops["values"])),
            limits_kmh=_pairs(path, data, "speed limits", {"position": "m", "velocity": "km/h"}),
            gradients_permil=_pairs(path, data, "gradients", {"position": "m", "slope": "permil"}),
        )
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        msg = f"{path}: {error!r}; allowed: a track of TTOBench with stops, limits and gradients"
        raise SourceError(msg) from error


def _pairs(
    path: Path, data: Mapping[str, Any], part: str, units: Mapping[str, str]
) -> tuple[tuple[float, float], ...]:
    if data[part]["units"] != units:
        msg = f"{path}: {part}: units {data[part]['units']}; allowed: {units}"
        raise SourceError(msg)
    return tuple((float(place_m), float(value)) for place_m, value in data[part]["values"])


def source_tables(source: TtoLine) -> dict[str, Rows]:
    """
    Return the tables that TTOBench gives.

    Parameters
    ----------
    source
        Stops, limits and gradients.

    Returns
    -------
    dict[str, Rows]
        Rows by file, header first.
    """
    stations: Rows = [["id", "name", "name_local", "chainage_km", "lon_deg", "lat_deg"]]
    for names, stop_m in zip(STATIONS, source.stops_m, strict=True):
        share = stop_m / source.stops_m[-1]
        place_deg = (round(a + share * (b - a), 2) for a, b in zip(*ENDS_DEG, strict=True))
        stations.append([*names, _km(stop_m), *place_deg])
    ends_m = (source.stops_m[0] - BEFORE_M, source.stops_m[-1] + BEYOND_M)
    return {
        "stations.csv": stations,
        "limits.csv": _stretches("limit_kmh", source.limits_kmh, ends_m),
        "gradients.csv": _stretches("gradient_permil", source.gradients_permil, ends_m),
    }


def _stretches(
    column: str, values: Sequence[tuple[float, float]], ends_m: tuple[float, float]
) -> Rows:
    edges_m = [ends_m[0], *(place_m for place_m, _ in values[1:]), ends_m[1]]
    rows: Rows = [["start_km", "end_km", column]]
    for (start_m, end_m), (_, value) in zip(pairwise(edges_m), values, strict=True):
        rows.append([_km(start_m), _km(end_m), f"{value:g}"])
    return rows


def wayside_tables(stops_m: Sequence[float]) -> dict[str, Rows]:
    """
    Return the assumed tables of the line.

    Parameters
    ----------
    stops_m
        Stop positions in running order. [m]

    Returns
    -------
    dict[str, Rows]
        Rows by file, header first.
    """
    start_m, end_m = stops_m[0] - BEFORE_M, stops_m[-1] + BEYOND_M
    tracks: Rows = [["section", "id", "start_km", "end_km"]]
    tracks.append([SECTION, TRACK, _km(start_m), _km(end_m)])
    platforms: Rows = [["station", "track", "start_km", "end_km", "stop_km"]]
    for (name, *_), stop_m in zip(STATIONS, stops_m, strict=True):
        edges = (_km(stop_m + edge_m) for edge_m in PLATFORM_M)
        platforms.append([name, TRACK, *edges, _km(stop_m)])
    blocks: Rows = [["id", "track", "start_km", "end_km"]]
    circuits: Rows = [["id", "track", "start_km", "end_km"]]
    for number, (from_m, to_m) in enumerate(pairwise(_block_edges(stops_m)), start=1):
        block = f"{TRACK}.{number:02d}"
        blocks.append([block, TRACK, _km(from_m), _km(to_m)])
        parts = list(pairwise(_circuit_edges(from_m, to_m, stops_m)))
        if len(parts) > 1:
            for index, part_m in enumerate(parts):
                circuits.append([f"{block}{chr(97 + index)}", TRACK, *map(_km, part_m)])
    balises: Rows = [["chainage_km"]]
    balises += [[_km(place_m)] for place_m in _balises(stops_m)]
    return {
        "tracks.csv": tracks,
        "platforms.csv": platforms,
        "blocks.csv": blocks,
        "circuits.csv": circuits,
        "balises.csv": balises,
    }


def _block_edges(stops_m: Sequence[float]) -> list[float]:
    """Return where blocks begin and end: those of platforms, and even parts between. [m]"""
    fixed = {stops_m[0] - BEFORE_M, stops_m[-1] + BEYOND_M, stops_m[0] + PLATFORM_BLOCK_M[1]}
    fixed |= {stop_m + edge_m for stop_m in stops_m[1:] for edge_m in PLATFORM_BLOCK_M}
    edges: list[float] = []
    for start_m, end_m in pairwise(sorted(fixed)):
        parts = ceil((end_m - start_m) / LONGEST_BLOCK_M)
        edges += [round(start_m + (end_m - start_m) * i / parts) for i in range(parts)]
    return [*edges, max(fixed)]


def _circuit_edges(start_m: float, end_m: float, stops_m: Sequence[float]) -> list[float]:
    """Return the ends of the circuits of a block: short ones near a stop, else one. [m]"""
    edges = {start_m, end_m}
    for stop_m in stops_m:
        pieces = round((FINE_M[1] - FINE_M[0]) / CIRCUIT_M)
        fine = (stop_m + FINE_M[0] + CIRCUIT_M * i for i in range(pieces + 1))
        edges |= {edge_m for edge_m in fine if start_m < edge_m < end_m}
    return sorted(edges)


def _balises(stops_m: Sequence[float]) -> Iterator[float]:
    """Yield the places of the balises. [m]"""
    yield stops_m[0] + BALISES_M[-1]
    for leaving_m, stop_m in pairwise(stops_m):
        place_m = leaving_m + BALISE_SPACING_M
        while place_m <= stop_m + BALISES_M[0] - NEAREST_BALISES_M:
            yield place_m
            place_m += BALISE_SPACING_M
        yield from (
            stop_m + edge_m for edge_m in BALISES_M if stop_m + edge_m > leaving_m + CIRCUIT_M
        )


def _km(place_m: float) -> float:
    return round(place_m / 1000.0, 3)
