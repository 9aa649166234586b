"""Rolling stock in RailJSON: forces by speed, resistance, masses, brake."""

from pathlib import Path
from typing import Any

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.importing.source_keys import KeyPlace, SafeIds, read_json

STOCK_VERSIONS = ("3.2",)
"""Of rolling stock that is read."""


def railjson_stock(path: Path, notes: SourceNotes) -> dict[str, dict[str, Any]]:
    """
    Read a train.

    Its brake rate is one that it reaches on any gradient: ``brake_rate`` is ``net``.

    Parameters
    ----------
    path
        JSON file.
    notes
        What was taken, assumed and left out is added.

    Returns
    -------
    dict[str, dict[str, Any]]
        One table ``[train.NAME]`` by name.

    Raises
    ------
    SourceError
        With everything that is wrong with the file.
    """
    stock = read_json(path)
    version = stock.at("railjson_version" if stock.has("railjson_version") else "version")
    version.one_of(STOCK_VERSIONS)
    stock.refuse()
    name = SafeIds().of(stock.at("name").text() or path.stem)
    top_mps = stock.at("max_speed").number(5.0 / 3.6, 400.0 / 3.6)
    gamma = stock.at("gamma")
    gamma.at("type").one_of(("CONST", "MAX"))
    resistance = stock.at("rolling_resistance")
    resistance.at("type").one_of(("davis",))
    entry: dict[str, Any] = {
        "length_m": stock.at("length").number(10.0, 900.0),
        "mass_t": stock.at("mass").number(1000.0, 2e7) / 1000.0,
        "rotating_mass_percent": round(
            100.0 * (stock.at("inertia_coefficient").number(1.0, 1.3) - 1.0), 6
        ),
        "maximum_speed_kmh": round(3.6 * top_mps, 6),
        "service_brake_kmhps": round(3.6 * gamma.at("value").number(0.14, 3.3), 6),
        "resistance": {
            "a_n": resistance.at("A").number(0.0, 1e6),
            "b_nspm": resistance.at("B").number(0.0, 1e5),
            "c_ns2pm2": resistance.at("C").number(0.0, 1e4),
        },
        "traction": {"force_speed": _forces(stock, top_mps, notes)},
    }
    stock.refuse()
    what = "length, mass, greatest speed, brake, resistance, forces"
    notes.take(f"train {name!r}: {what}", path.name)
    for key, told in (
        ("startup_time", "time until a train starts"),
        ("startup_acceleration", "limit of acceleration at the start"),
        ("comfort_acceleration", "limit of acceleration for comfort"),
        ("power_restrictions", "power restrictions"),
        ("energy_sources", "energy sources on board"),
        ("electrical_power_startup_time", "time until power comes back"),
        ("raise_pantograph_time", "time to raise the pantograph"),
    ):
        if stock.has(key) and stock.at(key).value not in ({}, [], 0):
            effect = "the whole force of the curve acts at once, everywhere"
            notes.miss(f"{told} of {name!r} ({key})", effect)
    notes.assume(
        f"efficiencies and auxiliaries of {name!r}",
        "those of an electric multiple unit",
        "the source has none; only energy depends on them",
    )
    return {name: entry}


def _forces(stock: KeyPlace, top_mps: float, notes: SourceNotes) -> list[list[float]]:
    """Return speeds [km/h] and forces [kN] of the default curve of the default mode."""
    curves = stock.at("effort_curves")
    modes = curves.at("modes")
    names = [name for name, _ in modes.pairs()]
    chosen = curves.at("default_mode").one_of(names)
    if not chosen:
        return []
    mode = modes.at(chosen)
    curve = mode.at("default_curve")
    speeds, efforts = curve.at("speeds"), curve.at("max_efforts")
    found_mps = [place.number(0.0, 400.0 / 3.6) for place in speeds.items()]
    forces_n = [place.number(0.0, 5e6) for place in efforts.items()]
    if not found_mps or len(found_mps) != len(forces_n):
        problem = f"has {len(forces_n)} forces for {len(found_mps)} speeds"
        efforts.wrong(problem, "one force for each of one or more speeds")
        return []
    if found_mps[0] != 0.0 or found_mps != sorted(set(found_mps)):
        speeds.wrong("does not rise from 0", "rising speeds, the first of them 0")
    if forces_n[0] == 0.0:
        efforts.wrong("begins with 0", "a first force above 0")
    points = [
        [round(3.6 * speed_mps, 6), round(force_n / 1000.0, 6)]
        for speed_mps, force_n in zip(found_mps, forces_n, strict=True)
    ]
    if points[-1][0] < round(3.6 * top_mps, 6):
        value = f"that of {points[-1][0]:g} km/h"
        notes.assume("force up to the greatest speed", value, "the curve ends before it")
        points.append([round(3.6 * top_mps, 6), points[-1][1]])
    notes.take(f"default curve of the mode {chosen!r}", f"effort_curves.modes.{chosen}")
    others = [name for name in names if name != chosen]
    if others:
        what, effect = f"modes {', '.join(others)}", f"{chosen!r} holds everywhere"
        notes.miss(what, effect)
    conditional = len(mode.parts("curves"))
    if conditional:
        what = f"{conditional} curves that hold under conditions (comfort, electrical profile)"
        notes.miss(what, "the default curve holds always")
    return points
