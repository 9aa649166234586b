"""The lines of the live link: what is said to a peer, and what a peer may say."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from kankaku.live.interval_report import IntervalReport
from kankaku.live.line_advice import AdviceError, LineAdvice
from kankaku.live.line_view import LineView
from kankaku.live.simulation import Simulation
from kankaku.railway.arrays import FloatArray
from kankaku.railway.step.state import NO_HOLD_S, Reason

VERSION = 1
"""Of the protocol; another one when a peer that knew this one would not understand."""
LONGEST_LINE = 1_000_000
"""Bytes of a line that a peer may send. [-]"""
VIEWED = (
    *("present", "running", "front_m", "speed_mps", "eoa_m", "eoa_by", "permitted_mps"),
    *("delay_s", "leader", "next_call", "next_stop_m", "booked_arrival_s", "booked_departure_s"),
)
"""Fields of a view that a decision tells; see :class:`~kankaku.live.line_view.LineView`."""
ASKED = ("ceiling_mps", "target_mps", "hold_until_s")
"""What advice may ask for: a number, a list with null for nothing, or an object by train."""
NUMBERED = ("reason", "cause")


class ProtocolError(AdviceError):
    """A line that is no answer: what is wrong with it, and what is allowed."""


def greeting(simulation: Simulation, timeout_s: float) -> dict[str, Any]:
    """
    Return what a peer is told first.

    Parameters
    ----------
    simulation
        What it takes part in.
    timeout_s
        How long it may take for each answer. [s]

    Returns
    -------
    dict[str, Any]
        What JSON can hold.
    """
    world = simulation.world
    services = world.timetable.services
    return {
        "kankaku": VERSION,
        "seed": simulation.seed,
        "interval_s": simulation.interval_s,
        "step_s": world.step_s,
        "timeout_s": timeout_s,
        "trains": list(world.timetable.trains),
        "length_m": world.length_m.tolist(),
        "maximum_speed_mps": world.of_type("maximum_speed_mps").tolist(),
        "stations": [[call.station for call in service.calls] for service in services],
    }


def decision(number: int, view: LineView, report: IntervalReport | None) -> dict[str, Any]:
    """
    Return what a peer is asked.

    Parameters
    ----------
    number
        Which decision, from 0.
    view
        The line.
    report
        What came of the last advice; None before the first.

    Returns
    -------
    dict[str, Any]
        Lists over trains; null where nothing is booked.
    """
    told: dict[str, Any] = {"decision": number, "time_s": view.time_s}
    told |= {name: _finite(getattr(view, name).tolist()) for name in VIEWED}
    if report is not None:
        told["cut_mps"], told["shield_s"] = report.cut_mps.tolist(), report.shield_s.tolist()
        told["reason"] = [Reason(number).name.lower() for number in report.reason.tolist()]
    return told


def _finite(values: list[Any]) -> list[Any]:
    return [
        None if isinstance(value, float) and not math.isfinite(value) else value for value in values
    ]


def parsed(line: bytes) -> dict[str, Any]:
    """
    Return what a line says.

    Parameters
    ----------
    line
        A line, without its end.

    Returns
    -------
    dict[str, Any]
        The object that it holds.

    Raises
    ------
    ProtocolError
        If it holds none.
    """
    where = "line"
    try:
        found = json.loads(line, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        told = "is nested too deep" if isinstance(error, RecursionError) else "is no JSON"
        raise ProtocolError(where, told, "an object in one line") from error
    if not isinstance(found, dict):
        raise ProtocolError(where, f"is a {type(found).__name__}", "an object")
    return found


def _refuse_constant(name: str) -> float:
    msg = f"{name} is no JSON"
    raise ValueError(msg)


def advice_in(message: Mapping[str, Any], number: int, trains: int) -> LineAdvice:
    """
    Return the advice that an answer gives.

    Parameters
    ----------
    message
        The answer.
    number
        The decision that was asked for.
    trains
        Number of trains. [-]

    Returns
    -------
    LineAdvice
        What it asks for; simulations look at the values.

    Raises
    ------
    ProtocolError
        If it answers another decision, has a part that there is not, or one of another kind.
    """
    for name in message:
        if name not in {"decision", *ASKED, *NUMBERED}:
            allowed = ", ".join(("decision", *ASKED, *NUMBERED))
            raise ProtocolError(str(name)[:80], "is no part of an answer", allowed)
    if message.get("decision") != number or isinstance(message.get("decision"), bool):
        where, told = "decision", f"{message.get('decision')!r}"
        raise ProtocolError(where, told[:80], f"{number}")
    usual = {"ceiling_mps": np.inf, "target_mps": np.inf, "hold_until_s": NO_HOLD_S}
    asked = {name: _asked(name, message.get(name), usual[name], trains) for name in ASKED}
    numbers = {name: _numbers(name, message.get(name), trains) for name in NUMBERED}
    return LineAdvice(
        asked["ceiling_mps"],
        asked["target_mps"],
        asked["hold_until_s"],
        numbers["reason"],
        numbers["cause"],
    )


def _asked(
    name: str, value: object, usual: float, trains: int
) -> FloatArray | dict[str, float] | float | None:
    if value is None:
        return None
    if isinstance(value, dict):
        return {train: _number(name, one) for train, one in value.items() if one is not None}
    if isinstance(value, list):
        if len(value) != trains:
            raise ProtocolError(
                name, f"has {len(value)} entries", f"one for each of {trains} trains"
            )
        return np.array([usual if one is None else _number(name, one) for one in value])
    return _number(name, value)


def _number(name: str, value: object) -> float:
    # A whole number may be too great for any float.
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > 1e12:
        raise ProtocolError(name, f"{value!r:.80}", "numbers, null for nothing")
    return float(value)


def _numbers(name: str, value: object, trains: int) -> Any:  # noqa: ANN401 - an array or None
    if value is None:
        return None
    good = isinstance(value, list) and len(value) == trains
    if not good or not all(type(one) is int and abs(one) < 2**31 for one in value):  # type: ignore[attr-defined]
        raise ProtocolError(name, f"{value!r:.80}", f"a whole number for each of {trains} trains")
    return np.array(value, dtype=np.intp)
