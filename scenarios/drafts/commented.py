"""TOML files with a comment where somebody will want to change something."""

from collections.abc import Mapping
from typing import Any

import tomlkit
from tomlkit.items import Table

from kankaku.scenarios.drafts.draft import Draft

SETTINGS: Mapping[str, str] = {
    "title": "what results and the page call it",
    "seed": "of the dwell delays; there are none until [dwell_delays] is here",
    "step_s": "of the simulation",
    "patience_min": "the run ends so long after the last booked call",
    "turn_back.minimum_s": "from an arrival to the departure of the same stock",
    "controllers.close_up.protection": "trains follow each other at braking distance",
    "controllers.two_stage.operation": "brakes early behind a train that stands",
    "controllers.atc.protection": "blocks of blocks.csv, and a speed code in each",
    "controllers.atd.protection": "a brake pattern to the last free block",
}
STOCK: Mapping[str, str] = {
    "mass_t": "as loaded",
    "rotating_mass_percent": "of the mass",
    "service_brake_kmhps": "kilometres per hour and second",
    "jerk_mps3": "of traction and service brake",
    "brake_build_up_s": "from nothing to the whole brake",
    "traction.starting_force_kn": "of the whole train, at the wheel",
    "traction.power_speed_kmh": "constant power from here on",
    "traction.characteristic_speed_kmh": "and less from here on",
    "traction.power_kw": "at the wheel",
}


def commented(draft: Draft, source: str) -> Draft:
    """
    Give the TOML files of a draft comments.

    Parameters
    ----------
    draft
        Its settings and stock become documents with comments; what they say stays.
    source
        Of the train, in a sentence.

    Returns
    -------
    Draft
        The same one.
    """
    settings = tomlkit.document()
    settings.add(tomlkit.comment("Made by kankaku new; change what you like. SOURCES.md says what"))
    settings.add(
        tomlkit.comment("was assumed, the guide's page on scenario files what else there is.")
    )
    _fill(settings, draft.settings, SETTINGS, "")
    stock = tomlkit.document()
    stock.add(tomlkit.comment(source))
    stock.add("schema_version", tomlkit.item(draft.stock["schema_version"]))
    trains = tomlkit.table(is_super_table=True)
    for name, entry in draft.stock["train"].items():
        own = tomlkit.table()
        _fill(own, entry, STOCK, "")
        trains.add(name, own)
    stock.add("train", trains)
    draft.settings, draft.stock = settings, stock
    return draft


def _fill(
    into: tomlkit.TOMLDocument | Table,
    told: Mapping[str, Any],
    comments: Mapping[str, str],
    path: str,
) -> None:
    for key, value in told.items():
        where = f"{path}{key}"
        if isinstance(value, Mapping):
            nothing_own = all(isinstance(part, Mapping) for part in value.values())
            own = tomlkit.table(is_super_table=nothing_own)
            _fill(own, value, comments, f"{where}.")
            into.add(key, own)
            continue
        item = tomlkit.item(value)
        if where in comments:
            item.comment(comments[where])
        into.add(key, item)
