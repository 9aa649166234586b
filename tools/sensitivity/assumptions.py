"""The ten most doubtful assumptions of the rush hour: their ranges, and what they change."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from kankaku.controllers.protection.moving_block import MovingBlockOptions
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.scenario import Option, Scenario
from kankaku.railway.plan.timetable import Call

CONTROLLERS = ("close_up", "two_stage")
"""Baseline first."""
DOUBTED_STATION = "kawaguchi"
PROTECTION, MARGIN = "moving_block", "margin_m"
SHORTEST_DWELL_S = 5.0
"""No minimum dwell is lowered below this. [s]"""
MPS2_PER_KMHPS = 1.0 / 3.6


class Assumption(NamedTuple):
    """Something that is assumed, how far it may be wrong, and why."""

    key: str
    title: str
    unit: str
    low: float
    """Least value that is as good as the one assumed. In the unit"""
    high: float
    """Greatest such value. In the unit"""
    reason: str
    changed: Callable[[Scenario, float], Scenario]
    """The scenario with another value, nothing else changed."""
    said: Callable[[Scenario], float]
    """What the scenario says. In the unit"""

    def value_at(self, place: float) -> float:
        """
        Return a value within the range.

        Parameters
        ----------
        place
            From 0, the low end, to 1, the high end. [-]

        Returns
        -------
        float
            In the unit.
        """
        return self.low + place * (self.high - self.low)


def changed(scenario: Scenario, places: Sequence[float]) -> Scenario:
    """
    Return the scenario with every assumption at a place of its range.

    Parameters
    ----------
    scenario
        The centre.
    places
        From 0 to 1, one per assumption; none for the centre itself. [-]

    Returns
    -------
    Scenario
        With the two controllers that are compared.
    """
    named = {spec.name: spec for spec in scenario.controllers}
    scenario = replace(scenario, controllers=tuple(named[name] for name in CONTROLLERS))
    if not places:
        return scenario
    for assumption, place in zip(ASSUMPTIONS, places, strict=True):
        scenario = assumption.changed(scenario, assumption.value_at(place))
    return scenario


def _with_delay_factor(scenario: Scenario, factor: float) -> Scenario:
    delays = scenario.dwell_delays
    return replace(scenario, dwell_delays=replace(delays, scale=factor * delays.scale))


def _with_cap(scenario: Scenario, cap_s: float) -> Scenario:
    return replace(scenario, dwell_delays=replace(scenario.dwell_delays, cap_s=cap_s))


def _with_correlation(scenario: Scenario, correlation: float) -> Scenario:
    delays = replace(scenario.dwell_delays, trip_correlation=correlation)
    return replace(scenario, dwell_delays=delays)


def _calls(scenario: Scenario, change: Callable[[int, Call], Call]) -> Scenario:
    services = tuple(
        replace(service, calls=tuple(change(at, call) for at, call in enumerate(service.calls)))
        for service in scenario.timetable.services
    )
    return replace(scenario, timetable=replace(scenario.timetable, services=services))


def _trains(scenario: Scenario, change: Callable[[TrainType], TrainType]) -> Scenario:
    kinds = {name: change(kind) for name, kind in scenario.train_types.items()}
    return replace(scenario, train_types=kinds)


def _first_train(scenario: Scenario) -> TrainType:
    return next(iter(scenario.train_types.values()))


def _with_doubted_factor(scenario: Scenario, factor: float) -> Scenario:
    def change(_: int, call: Call) -> Call:
        return replace(call, delay_scale=factor) if call.station == DOUBTED_STATION else call

    return _calls(scenario, change)


def _doubted_factor(scenario: Scenario) -> float:
    calls = (call for service in scenario.timetable.services for call in service.calls)
    return next(call.delay_scale for call in calls if call.station == DOUBTED_STATION)


def _with_shifted_dwells(scenario: Scenario, shift_s: float) -> Scenario:
    """Shift all minimum dwells but those at origins; none beyond what is booked."""

    def change(at: int, call: Call) -> Call:
        least_s = min(SHORTEST_DWELL_S, call.minimum_dwell_s)
        most_s = max(call.departure_s - call.arrival_s, call.minimum_dwell_s)
        dwell_s = min(max(call.minimum_dwell_s + shift_s, least_s), most_s)
        return replace(call, minimum_dwell_s=dwell_s) if at else call

    return _calls(scenario, change)


def _with_station_brake(scenario: Scenario, rate_kmhps: float) -> Scenario:
    driving = replace(scenario.driving, station_brake_mps2=MPS2_PER_KMHPS * rate_kmhps)
    return replace(scenario, driving=driving)


def _station_brake_kmhps(scenario: Scenario) -> float:
    driven = scenario.driving.train(_first_train(scenario))
    return driven.service_brake_mps2 / MPS2_PER_KMHPS


def _with_hurry(scenario: Scenario, late_after_s: float) -> Scenario:
    return replace(scenario, driving=replace(scenario.driving, late_after_s=late_after_s))


def _with_brake_rise(scenario: Scenario, rise_s: float) -> Scenario:
    """Let brake and traction rise at the pace that makes the whole service brake in this time."""

    def change(kind: TrainType) -> TrainType:
        jerk_mps3 = kind.service_brake_mps2 / rise_s if rise_s > 0.0 else float("inf")
        return replace(kind, brake_build_up_s=rise_s, jerk_mps3=jerk_mps3)

    return _trains(scenario, change)


def _with_margin(scenario: Scenario, margin_m: float) -> Scenario:
    def widened(options: Mapping[str, Option]) -> Mapping[str, Option]:
        return {**options, MARGIN: margin_m}

    specs = tuple(
        replace(spec, protection_options=widened(spec.protection_options))
        if spec.protection == PROTECTION
        else spec
        for spec in scenario.controllers
    )
    return replace(scenario, controllers=specs)


def _margin_m(scenario: Scenario) -> float:
    spec = next(spec for spec in scenario.controllers if spec.name == CONTROLLERS[0])
    value = spec.protection_options.get(MARGIN, MovingBlockOptions().margin_m)
    if not isinstance(value, float | int):
        msg = f"controllers.{spec.name}: {MARGIN} is {value!r}; allowed: a number"
        raise TypeError(msg)
    return float(value)


def _with_regeneration(scenario: Scenario, percent: float) -> Scenario:
    def change(kind: TrainType) -> TrainType:
        return replace(kind, supply=replace(kind.supply, regeneration_efficiency=percent / 100.0))

    return _trains(scenario, change)


ASSUMPTIONS = (
    Assumption(
        "delay_scale",
        "dwell delays, factor on all",
        "",
        0.75,
        1.25,
        "fitted to one figure of an unnamed line; the spread published of Tokyo asks for less",
        _with_delay_factor,
        lambda _: 1.0,
    ),
    Assumption(
        "doubted_factor",
        "delay factor of Kawaguchi",
        "",
        1.0,
        2.4,
        "judged from reports of crowding; from an ordinary station to twice the excess",
        _with_doubted_factor,
        _doubted_factor,
    ),
    Assumption(
        "cap",
        "longest dwell delay",
        "s",
        90.0,
        180.0,
        "that of the measured delays; longer stays are called incidents, which is a convention",
        _with_cap,
        lambda scenario: scenario.dwell_delays.cap_s,
    ),
    Assumption(
        "correlation",
        "correlation along a trip",
        "",
        0.0,
        0.6,
        "from one morning in Boston; a late, full train may stay longer at every station",
        _with_correlation,
        lambda scenario: scenario.dwell_delays.trip_correlation,
    ),
    Assumption(
        "recovery",
        "minimum dwells, shifted by",
        "s",
        -10.0,
        5.0,
        "no dwell in seconds is public: from nothing in reserve to 15 s at each stop",
        _with_shifted_dwells,
        lambda _: 0.0,
    ),
    Assumption(
        "station_brake",
        "brake into stations",
        "km/h/s",
        2.0,
        4.0,
        "assumed as usual; drivers and lines differ by so much",
        _with_station_brake,
        _station_brake_kmhps,
    ),
    Assumption(
        "hurry",
        "late trains hurry after",
        "s",
        0.0,
        180.0,
        "nobody says from when drivers make up for lost time; from always to hardly ever",
        _with_hurry,
        lambda scenario: scenario.driving.late_after_s,
    ),
    Assumption(
        "brake_rise",
        "brake is whole after",
        "s",
        1.0,
        3.0,
        "neither jerk limit nor build-up is published; limits of 0.5 to 1.4 m/s3 are usual",
        _with_brake_rise,
        lambda scenario: _first_train(scenario).brake_rise_s,
    ),
    Assumption(
        "margin",
        "margin of the moving block",
        "m",
        10.0,
        100.0,
        "assumed; it stands for position errors, radio delay and whatever a supplier adds",
        _with_margin,
        _margin_m,
    ),
    Assumption(
        "regeneration",
        "efficiency of regeneration",
        "%",
        40.0,
        90.0,
        "assumed that all current finds a taker; of the other trains nobody knows how many do",
        _with_regeneration,
        lambda scenario: 100.0 * _first_train(scenario).supply.regeneration_efficiency,
    ),
)
