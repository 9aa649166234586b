"""
A step of the control map, compiled: what centre and trains do where all units do what they should.

Between two maps trains keep the bands that they have heard of. When the time of a map has come the
centre plans it, tests it and sends it. Whatever has to be told to anybody else, a refused map or a
train without commands, is left to :mod:`kankaku.controllers.control_map.map_protection`.
"""

from typing import Any

import numpy as np

from kankaku.controllers.ceiling import ceilings_ahead_mps
from kankaku.controllers.centre.reports import arrived, spoken
from kankaku.controllers.control_map.onboard import behind_bands, keep_bands
from kankaku.controllers.control_map.planner import make_map
from kankaku.controllers.control_map.telegrams import (
    COMMANDS,
    acknowledged_in,
    added,
    commands_of,
    covered_of,
)
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.boxed import Box
from kankaku.railway.compiled import Plain, compiled, formula
from kankaku.railway.plan.radio_spec import (
    TOLERANCE_S,
    cycle_at,
    telegram_cycle_at,
    telegram_sent_s,
)
from kankaku.railway.safety.second_channel import excludes
from kankaku.railway.step.state import Whereabouts

UPDATE_S = 0.5
"""Time between maps, and between the moments of a map (Sugiyama 2018, section 3.1.3). [s]"""


@formula
def next_map_s(now_s: float) -> float:
    """
    Return when the next map is made.

    Parameters
    ----------
    now_s
        The time. [s]

    Returns
    -------
    float
        The next multiple of ``UPDATE_S``. [s]
    """
    return UPDATE_S * (cycle_at(now_s, UPDATE_S) + 1)


@compiled
def protect(
    instant: Plain,
    air: tuple[IntArray, IntArray, IntArray],
    fields: Any,  # noqa: ANN401 - a box
    memory: Any,  # noqa: ANN401 - a box
) -> tuple[Plain, Any, bool]:
    """
    Return the authority of every train.

    Parameters
    ----------
    instant
        As :mod:`kankaku.railway.step.bundles` says.
    air
        What has arrived: cycles of reports, of telegrams and of those that are acknowledged.
    fields
        What maps are made from and tested with, in a box of its own; obstructions, what maps are
        sent by, and what trains keep them with.
    memory
        Reports, those that may still arrive, map, telegrams and what is covered, in a box of their
        own; when trains report next, when the next map is made, and what trains hold.

    Returns
    -------
    tuple[Plain, Any, bool]
        Authority and commanded speeds; the memory after the step; and whether Python has to be
        asked, because a map is refused or a train brakes in emergency.
    """
    now_s, whereabouts, _, lasting = instant
    mapping, (obstructions, sending, keeping) = fields.inside
    ceiling, _, _, delay_s, nothing, nobody = keeping
    box, (next_report_s, next_s, held, held_m, braking) = memory.inside
    trains, cycle_s, asks = Whereabouts(*whereabouts), sending[0], False
    if now_s + TOLERANCE_S >= next_report_s:
        felt, calls = (trains.front_m, trains.speed_mps, trains.running), (lasting[4], lasting[6])
        next_report_s, box = _report(now_s, felt, calls, box, cycle_s)
    if now_s + TOLERANCE_S >= next_s:
        next_s = next_map_s(now_s)
        line = whereabouts, lasting[2], lasting[3]
        beside = obstructions, sending
        asks, box = _update(now_s, line, (air[0], air[2]), box, mapping, beside)
    kept, held, stops = _keep(instant, (air[1], held, held_m), box, keeping, cycle_s)
    eoa_m, eoa_by, commanded_mps = kept
    for train in trains.rows:
        still = braking[train] and trains.speed_mps[train] > 0.0
        asks = asks or (trains.running[train] and (still or stops[train]))
    ceiling_mps = ceilings_ahead_mps(whereabouts, ceiling)
    authority = eoa_m, ceiling_mps, delay_s, eoa_by, nothing, commanded_mps
    return authority, Box((box, (next_report_s, next_s, held, eoa_m, nobody))), asks  # type: ignore[no-untyped-call]


@compiled
def _report(
    now_s: float,
    felt: Plain,
    calls: tuple[IntArray, FloatArray],
    box: Any,  # noqa: ANN401 - a box
    cycle_s: float,
) -> tuple[float, Any]:
    """Let trains report; return when they do next, and what is remembered."""
    told, said, plan, sent, covered_m = box.inside
    next_s, said = spoken(now_s, felt, calls, said, cycle_s)
    return next_s, Box((told, said, plan, sent, covered_m))  # type: ignore[no-untyped-call]


@compiled
def _update(
    now_s: float,
    line: Plain,
    arrived_now: tuple[IntArray, IntArray],
    before: Any,  # noqa: ANN401 - a box
    mapping: Any,  # noqa: ANN401 - a box
    beside: tuple[Plain, tuple[float, float]],
) -> tuple[bool, Any]:
    """Return whether the map is refused, and what is remembered."""
    obstructions, (cycle_s, tolerance_m) = beside
    (trains, order, horizon), checks, brakes = mapping.inside
    told, said, plan, sent, _ = before.inside
    # What has arrived since the last map is looked at by the next one.
    told = arrived(arrived_now[0], told, said, cycle_s)
    fixed = trains, order, obstructions, horizon
    made = make_map(UPDATE_S * np.round(now_s / UPDATE_S), told, line, fixed, plan)
    commands = commands_of(made, brakes, tolerance_m)
    (seen_m, _, _, present, _, _), granted_to_m, _ = line
    reported = now_s, told[0], told[1], told[2], np.zeros(present.size)
    mapped = made[1], made[8], made[5], made[6], commands[2]
    if not excludes(reported, (seen_m, present, granted_to_m), mapped, checks):
        return True, before
    cycle = telegram_cycle_at(now_s, cycle_s)
    if cycle > sent[0].max():
        sent = added(sent, (cycle, telegram_sent_s(cycle, cycle_s)), commands, made)
    sent = acknowledged_in(sent, arrived_now[1])
    return False, Box((told, said, made, sent, covered_of(sent, present)))  # type: ignore[no-untyped-call]


@compiled
def _keep(
    instant: Plain,
    knows: tuple[IntArray, IntArray, FloatArray],
    box: Any,  # noqa: ANN401 - a box
    keeping: Plain,
    cycle_s: float,
) -> tuple[Plain, IntArray, BoolArray]:
    """Return what trains keep and are commanded, by which commands, and who is without any."""
    now_s, whereabouts, _, lasting = instant
    (heard, held, held_m), tempo, brakes = knows, keeping[1], keeping[2]
    size, sent = held.size, box.inside[3]
    clock_s, to_stop_m = np.full(size, now_s), lasting[5] - whereabouts[0]
    stops = np.zeros(size, dtype=np.bool_)
    aboard = clock_s, to_stop_m, heard, held, held_m
    eoa_m, commanded_mps, held = keep_bands(whereabouts, aboard, sent, tempo, brakes)
    rows, behind = whereabouts[5], (sent[9], sent[10])
    eoa_by = behind_bands(rows, eoa_m, sent[0], sent[4], behind, held)
    oldest_s = now_s - UPDATE_S * COMMANDS - TOLERANCE_S
    for train in rows:
        stops[train] = telegram_sent_s(held[train], cycle_s) < oldest_s
    return (eoa_m, eoa_by, commanded_mps), held, stops
