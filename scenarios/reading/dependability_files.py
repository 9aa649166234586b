"""The files ``availability.toml`` and ``fault_tree.toml``: failures, repairs and their logic."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Field

from kankaku.railway.failures.availability import Configuration, DeviceGroup
from kankaku.railway.failures.fault_tree import Event, FaultTree, Gate
from kankaku.scenarios.reading.fields import Name, OptionalText, Text
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError, meant
from kankaku.scenarios.reading.schema import Checked, check

AVAILABILITY_FILE = "availability.toml"
FAULT_TREE_FILE = "fault_tree.toml"
HOUR_S = 3600.0
_FRACTION = re.compile(r"(\d{1,6})/([1-9]\d{0,5})")


def _fraction(value: object) -> object:
    found = _FRACTION.fullmatch(value) if isinstance(value, str) else None
    return int(found[1]) / int(found[2]) if found else value


_FractionText: TypeAlias = Annotated[str, Field(pattern=f"^{_FRACTION.pattern}$")]
_Count: TypeAlias = Annotated[
    float,
    BeforeValidator(_fraction, json_schema_input_type=float | _FractionText),
    Field(gt=0.0, le=10000.0, description='a number above 0 up to 10000, or a fraction as "2/3"'),
]
_Effect: TypeAlias = Annotated[
    float,
    BeforeValidator(_fraction, json_schema_input_type=float | _FractionText),
    Field(ge=0.0, le=1.0, description='a number from 0 up to 1, or a fraction as "1/3"'),
]
_Published: TypeAlias = Annotated[float | None, Field(ge=0.0, description="a number from 0")]


class DeviceEntry(Checked):
    """A kind of device."""

    failures_per_hour: float = Field(ge=0.0, le=0.1)
    repair_h: float = Field(gt=0.0, le=8760.0)


class GroupEntry(Checked):
    """Devices of one kind in a system; ``effect`` is the share of the line that one stops."""

    count: _Count
    effect: _Effect


class PublishedAvailability(Checked):
    """Published results of a system, as printed."""

    failures_per_year: _Published = None
    stopped_h_per_year: _Published = None
    mean_repair_h: _Published = None
    availability_percent: Annotated[
        float | None, Field(ge=0.0, le=100.0, description="a percentage")
    ] = None


class ControlSystemEntry(Checked):
    """A system."""

    title: Text
    devices: dict[Name, GroupEntry] = Field(min_length=1)
    published: PublishedAvailability = PublishedAvailability()


class AvailabilityFile(Checked):
    """The file ``availability.toml``."""

    schema_version: Literal[1]
    source: OptionalText = ""
    devices: dict[Name, DeviceEntry] = Field(min_length=1)
    systems: dict[Name, ControlSystemEntry] = Field(min_length=1)


class EventEntry(Checked):
    """Something that happens or not."""

    title: Text
    probability: float = Field(ge=0.0, le=1.0)


class GateEntry(Checked):
    """What follows from others: ``any_of`` or ``all_of`` of them."""

    title: Text
    any_of: tuple[Name, ...] | None = Field(
        None, min_length=1, strict=False, description="a list of names of events or gates"
    )
    all_of: tuple[Name, ...] | None = Field(
        None, min_length=1, strict=False, description="a list of names of events or gates"
    )


class FaultTreeFile(Checked):
    """The file ``fault_tree.toml``."""

    schema_version: Literal[1]
    period_h: float = Field(gt=0.0, le=8760.0)
    tops: tuple[Name, ...] = Field(
        min_length=1, strict=False, description="a list of names of gates"
    )
    events: dict[Name, EventEntry] = Field(min_length=1)
    gates: dict[Name, GateEntry] = Field(min_length=1)


def load_configurations(folder: Path) -> tuple[tuple[Configuration, ...], str, str]:
    """
    Read what a scenario folder says about failures and repairs.

    Parameters
    ----------
    folder
        Folder with ``availability.toml``.

    Returns
    -------
    tuple[tuple[Configuration, ...], str, str]
        The systems in SI units, the source of published results, and the hash of the file.

    Raises
    ------
    ScenarioError
        With every mistake of the file.
    """
    reader = Reader()
    data = reader.toml(folder / AVAILABILITY_FILE, "availability")
    file = None
    if data is not None:
        file, mistakes = check(AvailabilityFile, data, AVAILABILITY_FILE)
        reader.mistakes += mistakes
    for name, system in file.systems.items() if file else ():
        for device in system.devices:
            if file and device not in file.devices:
                place = f"systems.{name}.devices.{device}"
                problem = f"no device {device!r}"
                allowed = meant(device, file.devices)
                reader.mistakes.append(Mistake(AVAILABILITY_FILE, place, problem, allowed))
    if reader.mistakes or file is None:
        raise ScenarioError(tuple(reader.mistakes))
    systems = tuple(
        Configuration(
            name=name,
            title=system.title,
            groups=tuple(
                DeviceGroup(
                    device,
                    group.count,
                    group.effect,
                    file.devices[device].failures_per_hour / HOUR_S,
                    file.devices[device].repair_h * HOUR_S,
                )
                for device, group in system.devices.items()
            ),
            published=system.published.model_dump(exclude_none=True),
        )
        for name, system in file.systems.items()
    )
    return systems, file.source, reader.digest


def load_fault_tree(folder: Path) -> FaultTree | None:
    """
    Read the fault tree of a scenario folder.

    Parameters
    ----------
    folder
        Folder that may hold ``fault_tree.toml``.

    Returns
    -------
    FaultTree | None
        Nothing if there is no such file.

    Raises
    ------
    ScenarioError
        With every mistake of the file.
    """
    if not os.path.lexists(folder / FAULT_TREE_FILE):
        return None
    reader = Reader()
    data = reader.toml(folder / FAULT_TREE_FILE, "fault_tree")
    file = None
    if data is not None:
        file, mistakes = check(FaultTreeFile, data, FAULT_TREE_FILE)
        reader.mistakes += mistakes
    if file is not None:
        reader.mistakes += _tree_mistakes(file)
    if reader.mistakes or file is None:
        raise ScenarioError(tuple(reader.mistakes))
    return FaultTree(
        events={name: Event(it.title, it.probability) for name, it in file.events.items()},
        gates={
            name: Gate(it.title, it.all_of is not None, it.any_of or it.all_of or ())
            for name, it in file.gates.items()
        },
        tops=file.tops,
        period_s=file.period_h * HOUR_S,
        digest=reader.digest,
    )


def _tree_mistakes(file: FaultTreeFile) -> list[Mistake]:
    mistakes = [*_gate_mistakes(file)]
    for top in file.tops:
        if top not in file.gates:
            allowed = meant(top, file.gates)
            mistakes.append(Mistake(FAULT_TREE_FILE, "tops", f"no gate {top!r}", allowed))
    if mistakes:
        return mistakes
    inputs = {name: (*(it.any_of or ()), *(it.all_of or ())) for name, it in file.gates.items()}
    circle = _circle(inputs)
    if circle:
        problem = f"follows from itself: {' <- '.join(circle)}"
        return [Mistake(FAULT_TREE_FILE, f"gates.{circle[0]}", problem, "no circles")]
    allowed = "an input of a gate below a top"
    return [
        Mistake(FAULT_TREE_FILE, place, "leads to no top event", allowed)
        for place in _unused(file, inputs)
    ]


def _gate_mistakes(file: FaultTreeFile) -> Iterator[Mistake]:
    known = [*file.events, *file.gates]
    for name, gate in file.gates.items():
        place = f"gates.{name}"
        if name in file.events:
            yield Mistake(FAULT_TREE_FILE, place, "there is an event of that name", "another name")
        if (gate.any_of is None) == (gate.all_of is None):
            told = "has neither any_of nor all_of" if gate.any_of is None else "has both"
            yield Mistake(FAULT_TREE_FILE, place, told, "any_of or all_of")
        for part in (*(gate.any_of or ()), *(gate.all_of or ())):
            if part not in known:
                problem = f"no event or gate {part!r}"
                yield Mistake(FAULT_TREE_FILE, place, problem, meant(part, known))


def _unused(file: FaultTreeFile, inputs: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Return the places of events and gates that lead to no top event."""
    reached, open_ends = set(), list(file.tops)
    while open_ends:
        name = open_ends.pop()
        if name not in reached:
            reached.add(name)
            open_ends += inputs.get(name, ())
    return [
        f"{kind}.{name}"
        for kind, names in (("events", file.events), ("gates", file.gates))
        for name in names
        if name not in reached
    ]


def _circle(inputs: Mapping[str, tuple[str, ...]]) -> Sequence[str]:
    """Return gates that follow from each other; nothing if there are none."""
    done: set[str] = set()
    for start in inputs:
        path: list[str] = []
        # Entries are names to visit; None says that the last gate of the path is finished.
        stack: list[str | None] = [start]
        while stack:
            name = stack.pop()
            if name is None:
                done.add(path.pop())
            elif name in path:
                return [*path[path.index(name) :], name]
            elif name in inputs and name not in done:
                path.append(name)
                stack += [None, *inputs[name]]
    return ()
