"""The files of a scenario of MATSim railsim: what stands in them, checked."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

from kankaku.scenarios.importing.formats import SourceError
from kankaku.scenarios.importing.source_keys import MOST_TOLD
from kankaku.scenarios.reading.cell_texts import printable, shown
from kankaku.scenarios.reading.mistakes import Mistake

PARTS = {"network": "network", "transitSchedule": "schedule", "vehicleDefinitions": "vehicles"}
"""Roots of the three files, and what they hold."""
_CLOCK = re.compile(r"(\d{1,2}):([0-5]\d):([0-5]\d)(?:\.0*)?")


@dataclass(frozen=True, slots=True)
class RailsimLink:
    """A link from a node to another."""

    id: str
    from_node: str
    to_node: str
    length_m: float
    speed_mps: float
    resource: str
    capacity: int
    """Trains that its resource holds at a time. [-]"""
    moving: bool
    """Trains on it are kept apart by a moving block."""
    least_s: float
    speed_of_mps: Mapping[str, float]
    """By train type, where it has one of its own. [m/s]"""

    @property
    def turns(self) -> bool:
        """It ends where it begins: a stop, no way."""
        return self.from_node == self.to_node


class RailsimFacility(NamedTuple):
    """A stop at the end of a link."""

    name: str
    link: str


class RailsimStop(NamedTuple):
    """A call of a route; times are since the departure. [s]"""

    facility: str
    arrival_s: int
    departure_s: int
    least_stay_s: int


class RailsimDeparture(NamedTuple):
    """A train of a route."""

    id: str
    time_s: int
    vehicle: str


@dataclass(frozen=True, slots=True)
class RailsimRoute:
    """A route of a line, with its trains."""

    line: str
    id: str
    stops: tuple[RailsimStop, ...]
    links: tuple[str, ...]
    departures: tuple[RailsimDeparture, ...]


class RailsimVehicle(NamedTuple):
    """A type of train."""

    length_m: float
    speed_mps: float
    acceleration_mps2: float
    deceleration_mps2: float


@dataclass
class RailsimSource:
    """All three files."""

    links: dict[str, RailsimLink] = field(default_factory=dict)
    facilities: dict[str, RailsimFacility] = field(default_factory=dict)
    routes: list[RailsimRoute] = field(default_factory=list)
    """Those with departures."""
    types: dict[str, RailsimVehicle] = field(default_factory=dict)
    vehicles: dict[str, str] = field(default_factory=dict)
    """Type by vehicle."""


class _Tag:
    """An element of a file with its place; mistakes are gathered."""

    def __init__(self, element: ET.Element, file: str, where: str, mistakes: list[str]) -> None:
        self._element, self.file, self.where, self.mistakes = element, file, where, mistakes

    def wrong(self, key: str, problem: str, allowed: str) -> None:
        where = f"{self.where} {key}".strip()
        self.mistakes.append(str(Mistake(self.file, where, problem, allowed)))

    def each(self, path: str) -> Iterator["_Tag"]:
        """Yield elements below this one, named by identifier where they have one."""
        for number, element in enumerate(self._element.iterfind(path)):
            name = element.get("id") or element.get("refId") or f"[{number}]"
            where = f"{self.where}/{_plain(element.tag)} {name}"
            yield _Tag(element, self.file, where, self.mistakes)

    def one(self, path: str) -> "_Tag | None":
        """Return an element that must be there."""
        found = next(self.each(path), None)
        if found is None:
            self.wrong("", f"has no <{path}>", f"one element <{path}>")
        return found

    def text(self, key: str, *, otherwise: str | None = None) -> str:
        value = self._element.get(key)
        if not value:
            if otherwise is not None:
                return otherwise
            self.wrong(key, "is missing", "a text")
        return value or ""

    def number(self, key: str, low: float, high: float) -> float:
        return self._number(key, self._element.get(key), low, high)

    def _number(self, key: str, told: str | None, low: float, high: float) -> float:
        try:
            value = float(told or "")
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            self.wrong(key, f"is {shown(told)}", f"a number from {low:g} to {high:g}")
            return low
        return value

    def clock_s(self, key: str, *, otherwise_s: int | None = None) -> int:
        told = self._element.get(key)
        if told is None and otherwise_s is not None:
            return otherwise_s
        found = _CLOCK.fullmatch(told or "")
        if not found:
            self.wrong(key, f"is {shown(told)}", "a time as HH:MM:SS")
            return 0
        hours, minutes, seconds = map(int, found.groups())
        return 3600 * hours + 60 * minutes + seconds

    def attribute(self, name: str) -> str | None:
        """Return the text of a MATSim attribute of this element."""
        for element in self._element.iterfind("attributes/attribute"):
            if element.get("name") == name:
                return (element.text or "").strip()
        return None

    def attributes(self, stem: str) -> dict[str, str]:
        """Return MATSim attributes whose names begin so, by the rest of the name."""
        return {
            name[len(stem) :]: (element.text or "").strip()
            for element in self._element.iterfind("attributes/attribute")
            if (name := element.get("name") or "").startswith(stem)
        }

    def attribute_number(self, name: str, low: float, high: float) -> float | None:
        told = self.attribute(name)
        return None if told is None else self._number(name, told, low, high)


def read_railsim(folder: Path) -> RailsimSource:
    """
    Read network, schedule and vehicles.

    Parameters
    ----------
    folder
        With one file of each, whatever they are called.

    Returns
    -------
    RailsimSource
        What they hold.

    Raises
    ------
    SourceError
        With everything that is wrong with them.
    """
    mistakes: list[str] = []
    roots = _roots(folder, mistakes)
    _refuse(mistakes)
    told = RailsimSource()
    for tag in roots["network"].each("links/link"):
        _read_link(tag, told)
    for tag in roots["vehicles"].each("vehicleType"):
        _read_type(tag, told)
    for tag in roots["vehicles"].each("vehicle"):
        kind = _known(tag, "type", told.types, "vehicle type")
        told.vehicles[tag.text("id")] = kind
    for tag in roots["schedule"].each("transitStops/stopFacility"):
        name, link = tag.text("id"), _known(tag, "linkRefId", told.links, "link")
        told.facilities[name] = RailsimFacility(tag.text("name", otherwise=name), link)
    for line in roots["schedule"].each("transitLine"):
        for tag in line.each("transitRoute"):
            route = _route(tag, line.text("id"), told)
            if route.departures:
                told.routes.append(route)
    _refuse(mistakes)
    return told


def _refuse(mistakes: list[str]) -> None:
    if mistakes:
        more = len(mistakes) - MOST_TOLD
        raise SourceError((*mistakes[:MOST_TOLD], *([f"{more} more mistakes"] if more > 0 else [])))


def _roots(folder: Path, mistakes: list[str]) -> dict[str, _Tag]:
    """Return the roots of the three files; there must be one of each."""
    roots: dict[str, _Tag] = {}
    if not folder.is_dir():
        allowed = "a folder with network, schedule and vehicles in XML"
        raise SourceError((str(Mistake(folder.name, "", "is no folder", allowed)),))
    for path in sorted(folder.glob("*.xml")):
        root = _root(path, mistakes)
        part = PARTS.get(_plain(root.tag)) if root is not None else None
        if root is None or part is None:
            continue
        if part in roots:
            problem = f"is a second file of {part}, beside {roots[part].file}"
            mistakes.append(str(Mistake(path.name, "", problem, "one of each")))
        _unnamed(root)
        roots[part] = _Tag(root, path.name, "", mistakes)
    for root_name, part in PARTS.items():
        if part not in roots and not mistakes:
            problem, allowed = f"has no file of {part}", f"an XML file with the root <{root_name}>"
            mistakes.append(str(Mistake(folder.name, "", problem, allowed)))
    return roots


def _root(path: Path, mistakes: list[str]) -> ET.Element | None:
    allowed = "a well-formed file in XML, without entities"
    try:
        data = path.read_bytes()
        if b"<!ENTITY" in data or b"<\0!\0E" in data:
            mistakes.append(str(Mistake(path.name, "", "declares entities", allowed)))
            return None
        return ET.fromstring(data)  # noqa: S314 - no entities, and nothing is fetched
    except OSError as error:
        mistakes.append(str(Mistake(path.name, "", f"cannot be read: {error.strerror}", allowed)))
    except (ET.ParseError, ValueError, LookupError) as error:
        mistakes.append(str(Mistake(path.name, "", printable(str(error)), allowed)))
    return None


def _plain(tag: object) -> str:
    return str(tag).rpartition("}")[2]


def _unnamed(root: ET.Element) -> None:
    """Drop namespaces: one file has one, the others have none."""
    for element in root.iter():
        element.tag = _plain(element.tag)


def _known(tag: _Tag, key: str, known: Mapping[str, object], what: str) -> str:
    name = tag.text(key)
    if name and name not in known:
        tag.wrong(key, f"is {shown(name)}", f"a {what} of the files")
    return name


def _read_link(tag: _Tag, told: RailsimSource) -> None:
    name = tag.text("id")
    if name in told.links:
        tag.wrong("id", f"is {shown(name)} once more", "every link once")
    capacity = tag.attribute_number("railsimTrainCapacity", 1, 1e9)
    told.links[name] = RailsimLink(
        id=name,
        from_node=tag.text("from"),
        to_node=tag.text("to"),
        length_m=tag.number("length", 0.01, 1e6),
        speed_mps=tag.number("freespeed", 3.0 / 3.6, 1e4),
        resource=tag.attribute("railsimResourceId") or f"link {name}",
        capacity=1 if capacity is None else int(capacity),
        moving=tag.attribute("railsimResourceType") == "movingBlock",
        least_s=tag.attribute_number("railsimMinimumTime", 0.0, 86400.0) or 0.0,
        speed_of_mps={
            kind: tag.attribute_number(f"railsimSpeed_{kind}", 3.0 / 3.6, 1e4) or 0.0
            for kind in tag.attributes("railsimSpeed_")
        },
    )


def _read_type(tag: _Tag, told: RailsimSource) -> None:
    rates = []
    for name in ("railsimAcceleration", "railsimDeceleration"):
        low = 0.14 if name.endswith("Deceleration") else 0.01
        rate = tag.attribute_number(name, low, 3.3)
        if rate is None:
            tag.wrong(name, "is missing", "an attribute with a number, in m/s2")
        rates.append(rate or low)
    length, speed = tag.one("length"), tag.one("maximumVelocity")
    told.types[tag.text("id")] = RailsimVehicle(
        length.number("meter", 10.0, 900.0) if length else 10.0,
        speed.number("meterPerSecond", 5.0 / 3.6, 400.0 / 3.6) if speed else 10.0,
        *rates,
    )


def _route(tag: _Tag, line: str, told: RailsimSource) -> RailsimRoute:
    stops: list[RailsimStop] = []
    for number, stop in enumerate(tag.each("routeProfile/stop")):
        facility = _known(stop, "refId", told.facilities, "stop facility")
        arrival_s = stop.clock_s("arrivalOffset", otherwise_s=None if number else 0)
        departure_s = stop.clock_s("departureOffset", otherwise_s=arrival_s)
        if stops and arrival_s < stops[-1].departure_s:
            stop.wrong("arrivalOffset", "lies before the last departure", "rising times")
        least_s = stop.clock_s("minimumStopDuration", otherwise_s=0)
        stops.append(RailsimStop(facility, arrival_s, max(departure_s, arrival_s), least_s))
    links = tuple(_known(link, "refId", told.links, "link") for link in tag.each("route/link"))
    departures: dict[str, RailsimDeparture] = {}
    for item in tag.each("departures/departure"):
        name = item.text("id")
        if name in departures:
            item.wrong("id", "stands in this route already", "every departure once")
        vehicle = _known(item, "vehicleRefId", told.vehicles, "vehicle")
        departures[name] = RailsimDeparture(name, item.clock_s("departureTime"), vehicle)
    ways = [told.links[name] for name in links if name in told.links]
    for before, after in pairwise(ways):
        if before.to_node != after.from_node:
            tag.wrong("", f"link {after.id!r} does not go on from {before.id!r}", "links in order")
    if not links and departures:
        tag.wrong("", "has no links", "links from the first stop to the last")
    name = tag.text("id")
    if (line, name) in {(other.line, other.id) for other in told.routes}:
        tag.wrong("id", "stands in this line already", "every route once")
    return RailsimRoute(line, name, tuple(stops), links, tuple(departures.values()))
