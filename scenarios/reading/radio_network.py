"""The file ``radio_network.toml``: cells, systems and published loads of a radio network."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field

from kankaku.railway.plan.line import Line
from kankaku.railway.radio.cells import Cells, Link, PublishedLoad, RadioPlan, RadioSystem
from kankaku.scenarios.reading.fields import Name, Text
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.scenarios.reading.schema import Checked, check

RADIO_FILE = "radio_network.toml"
LEAST_UPDATE_S = 0.05
"""Shorter ones would take longer to simulate than anybody waits. [s]"""
_Whole: TypeAlias = Annotated[int, Field(ge=0, le=1000)]
_Bytes: TypeAlias = Annotated[int, Field(ge=1, le=65507)]
_Share: TypeAlias = Annotated[float | None, Field(ge=0.0, le=100.0, description="a percentage")]
_Seconds: TypeAlias = Annotated[
    float | None, Field(ge=0.0, le=3600.0, description="a number from 0 up to 3600")
]


class RadioSystemEntry(Checked):
    """One way to bring commands to trains."""

    title: Text
    central: bool
    wired_kbps: float = Field(gt=0.0, le=1e8)
    radio_kbps: float = Field(gt=0.0, le=1e6)
    radio_packet_bytes: _Bytes
    wired_packet_bytes: _Bytes
    cycle_s: float = Field(ge=0.05, le=10.0)
    updates_per_cycle: int = Field(ge=1, le=20)
    broadcasts_per_update: _Whole
    own_slots_per_cycle: _Whole
    answer_slots: int = Field(ge=1, le=1000)
    trackside_devices: _Whole
    trackside_devices_max: _Whole
    loss_percent: float = Field(ge=0.0, lt=100.0)
    repeats: int = Field(ge=0, le=10)


class LoadEntry(Checked):
    """A published load."""

    system: Name
    trains: int = Field(ge=1, le=200)
    controller_switch_percent: _Share = None
    switch_controller_percent: _Share = None
    switch_unit_percent: _Share = None
    unit_switch_percent: _Share = None
    antenna_train_percent: _Share = None
    train_antenna_percent: _Share = None
    round_trip_mean_s: _Seconds = None
    round_trip_max_s: _Seconds = None


class PublishedLoads(Checked):
    """Published loads with their source."""

    source: Text
    loads: tuple[LoadEntry, ...] = Field(min_length=1, strict=False)


class RadioFile(Checked):
    """The file ``radio_network.toml``."""

    schema_version: Literal[1]
    cells: int = Field(ge=1, le=200)
    overlap_m: float = Field(ge=0.0, le=100000.0)
    late_s: float = Field(gt=0.0, le=60.0)
    systems: dict[Name, RadioSystemEntry] = Field(min_length=1)
    published: PublishedLoads | None = None


def load_radio_plan(folder: Path, line: Line) -> RadioPlan:
    """
    Read what a scenario folder says about its radio network.

    Parameters
    ----------
    folder
        Folder with ``radio_network.toml``.
    line
        The line that the cells divide.

    Returns
    -------
    RadioPlan
        In SI units.

    Raises
    ------
    ScenarioError
        With every mistake of the file.
    """
    reader = Reader()
    data = reader.toml(folder / RADIO_FILE, "radio_network")
    file = None
    if data is not None:
        file, mistakes = check(RadioFile, data, RADIO_FILE)
        reader.mistakes += mistakes
    if file is not None:
        reader.mistakes += _file_mistakes(file, line)
    if reader.mistakes or file is None:
        raise ScenarioError(tuple(reader.mistakes))
    return RadioPlan(
        cells=Cells(np.linspace(line.start_m, line.end_m, file.cells + 1), file.overlap_m),
        late_s=file.late_s,
        systems=tuple(_to_system(name, entry) for name, entry in file.systems.items()),
        source=file.published.source if file.published else "",
        published=_to_published(file.published),
        digest=reader.digest,
    )


def _file_mistakes(file: RadioFile, line: Line) -> Iterator[Mistake]:
    cell_m = (line.end_m - line.start_m) / file.cells
    if file.overlap_m > cell_m:
        problem = f"{file.overlap_m:g} is longer than a cell"
        allowed = f"up to {cell_m:.0f}, so that two units at most serve a train"
        yield Mistake(RADIO_FILE, "overlap_m", problem, allowed)
    for name, entry in file.systems.items():
        for key, problem, allowed in _system_mistakes(entry, _to_system(name, entry)):
            yield Mistake(RADIO_FILE, f"systems.{name}.{key}", problem, allowed)
    for number, load in enumerate(file.published.loads if file.published else ()):
        if load.system not in file.systems:
            place, problem = f"published.loads.{number}.system", f"no system {load.system!r}"
            yield Mistake(RADIO_FILE, place, problem, ", ".join(file.systems))


def _system_mistakes(
    entry: RadioSystemEntry, system: RadioSystem
) -> Iterator[tuple[str, str, str]]:
    """Yield key, problem and what is allowed."""
    if system.update_s < LEAST_UPDATE_S:
        problem = f"updates of {system.update_s:g} s"
        yield "updates_per_cycle", problem, f"{LEAST_UPDATE_S} s or longer"
    slots = system.slots_per_update
    kept = entry.own_slots_per_cycle + entry.broadcasts_per_update
    if slots <= kept:
        problem = (
            f"an update has {slots} slots of {1000 * system.airtime_s:.1f} ms, "
            f"{kept} of them for the radio unit and broadcasts"
        )
        yield "radio_kbps", problem, "a rate that leaves a slot for a device"
    elif entry.answer_slots > slots:
        yield "answer_slots", f"{entry.answer_slots} is too late", f"1 to {slots}"
    if entry.trackside_devices > entry.trackside_devices_max:
        problem = f"{entry.trackside_devices} is more than trackside_devices_max"
        yield "trackside_devices", problem, f"0 to {entry.trackside_devices_max}"
    least_bytes = (entry.broadcasts_per_update + 1) * entry.radio_packet_bytes
    if entry.central and entry.wired_packet_bytes < least_bytes:
        problem = f"{entry.wired_packet_bytes} bytes leave no room for a command"
        yield "wired_packet_bytes", problem, f"{least_bytes} or more"


def _to_system(name: str, entry: RadioSystemEntry) -> RadioSystem:
    return RadioSystem(
        name=name,
        title=entry.title,
        central=entry.central,
        wired_bps=1000.0 * entry.wired_kbps,
        radio_bps=1000.0 * entry.radio_kbps,
        radio_packet_bytes=entry.radio_packet_bytes,
        wired_packet_bytes=entry.wired_packet_bytes,
        cycle_s=entry.cycle_s,
        updates_per_cycle=entry.updates_per_cycle,
        broadcasts_per_update=entry.broadcasts_per_update,
        own_slots_per_cycle=entry.own_slots_per_cycle,
        answer_slots=entry.answer_slots,
        trackside_devices=entry.trackside_devices,
        trackside_devices_max=entry.trackside_devices_max,
        loss=entry.loss_percent / 100.0,
        repeats=entry.repeats,
    )


def _to_published(published: PublishedLoads | None) -> tuple[PublishedLoad, ...]:
    return tuple(
        PublishedLoad(
            system=load.system,
            trains=load.trains,
            utilisation={
                link: value / 100.0
                for link in Link
                if (value := getattr(load, f"{link.value}_percent")) is not None
            },
            round_trip_mean_s=load.round_trip_mean_s,
            round_trip_max_s=load.round_trip_max_s,
        )
        for load in (published.loads if published else ())
    )
