"""Cross-checks of controllers, dwell delays and sweeps."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from kankaku.railway.places import name_problem
from kankaku.railway.plan.driving_style import FASTEST
from kankaku.railway.plan.radio_spec import keeps_pace
from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.checks.check_timetable import TimetableTables, calls_by_train
from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import CallRow, QuantileRow
from kankaku.scenarios.reading.schema import (
    ControllerEntry,
    RadioEntry,
    RandomDisruptions,
    ScenarioFile,
    SweepEntry,
)

PAIR_OR_PEER = "both protection and operation, or peer alone"
MOST_DELAYS = 1000
"""Runs of one controller in a sweep. [-]"""


def step_mistakes(settings: ScenarioFile, file: str) -> list[Mistake]:
    """
    Return what is wrong with the step: SUMO counts in whole milliseconds.

    Parameters
    ----------
    settings
        The main file.
    file
        Its name.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    if float(f"{settings.step_s:.3f}") == settings.step_s:
        return []
    return [Mistake(file, "step_s", f"{settings.step_s:g} s", "whole milliseconds")]


def controller_mistakes(settings: ScenarioFile, file: str) -> list[Mistake]:
    """
    Return controllers that are no whole pair of layers, or would share one folder of results.

    Parameters
    ----------
    settings
        The main file.
    file
        Its name.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    first: dict[str, str] = {}
    mistakes = []
    for name in settings.controllers:
        other = first.setdefault(name.lower(), name)
        if other != name:
            problem = f"differs from {other!r} only by capital letters"
            mistakes.append(Mistake(file, f"controllers.{name}", problem, "every name once"))
        problem = name_problem(name)
        if problem:
            allowed = "another name, for example 'moving_block'"
            mistakes.append(Mistake(file, f"controllers.{name}", f"{name!r} {problem}", allowed))
    for name, controller in settings.controllers.items():
        mistakes += [
            Mistake(file, f"controllers.{name}.{key}", problem, PAIR_OR_PEER)
            for key, problem in _layer_problems(controller)
        ]
        if controller.eco_reserve and controller.eco_margin_s is None:
            key, problem = f"controllers.{name}.eco_reserve", "stands without eco_margin_s"
            mistakes.append(Mistake(file, key, problem, "both, or eco_margin_s alone"))
    if not any(controller.by_default for controller in settings.controllers.values()):
        problem, allowed = "none runs by default", "one without by_default = false"
        mistakes.append(Mistake(file, "controllers", problem, allowed))
    return mistakes


def _layer_problems(controller: ControllerEntry) -> Iterator[tuple[str, str]]:
    """Yield the keys of a controller that are missing or too many."""
    for key in ("protection", "operation"):
        if controller.peer is None and getattr(controller, key) is None:
            yield key, "is missing"
    for key in ("protection", "operation", "supervision"):
        if controller.peer is not None:
            named = (key, f"{key}_options")
            yield from ((name, "stands beside peer") for name in named if getattr(controller, name))
    if controller.peer is not None and controller.radio:
        yield "radio", "stands beside peer"
    if controller.peer is not None and controller.eco_margin_s is not None:
        yield "eco_margin_s", "stands beside peer"


def driving_mistakes(settings: ScenarioFile, file: str) -> list[Mistake]:
    """
    Return driving styles that are named and not there, or there under a name that is taken.

    Parameters
    ----------
    settings
        The main file.
    file
        Its name.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes = []
    known = (FASTEST.name, *settings.driving_styles)
    if FASTEST.name in settings.driving_styles:
        place, problem = f"driving_styles.{FASTEST.name}", "the name of the style without a table"
        mistakes.append(Mistake(file, place, problem, "another name"))
    named = {"driving": settings.driving} | {
        f"controllers.{name}.driving": entry.driving
        for name, entry in settings.controllers.items()
        if entry.driving is not None
    }
    for place, style in named.items():
        if style not in known:
            mistakes.append(Mistake(file, place, f"unknown style {style!r}", meant(style, known)))
    return mistakes


def radio_mistakes(settings: ScenarioFile, file: str) -> list[Mistake]:
    """
    Return what is wrong with the times of the radio.

    Parameters
    ----------
    settings
        The main file.
    file
        Its name.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    used = any(controller.radio for controller in settings.controllers.values())
    if settings.radio is None and not used:
        return []
    radio, mistakes = settings.radio or RadioEntry(), []
    if radio.delay_most_s < radio.delay_least_s:
        problem = f"{radio.delay_most_s:g} lies below delay_least_s"
        allowed = f"from {radio.delay_least_s:g}"
        mistakes.append(Mistake(file, "radio.delay_most_s", problem, allowed))
    if not keeps_pace(radio.cycle_s, settings.step_s):
        problem = f"half of {radio.cycle_s:g} s is not a whole number of steps"
        allowed = f"a multiple of {2.0 * settings.step_s:g} s"
        mistakes.append(Mistake(file, "radio.cycle_s", problem, allowed))
    return mistakes


def sweep_mistakes(settings: ScenarioFile, file: str) -> list[Mistake]:
    """
    Return what is wrong with the delays of a sweep, or with published results of none.

    Parameters
    ----------
    settings
        The main file.
    file
        Its name.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    sweep = settings.sweep
    if sweep is None:
        told = "are the results of a sweep that the scenario has not"
        return [Mistake(file, "published", told, "beside [sweep]")] if settings.published else []
    values = {"first_s": sweep.first_s, "last_s": sweep.last_s, "step_s": sweep.step_s}
    # Results lie in folders named by the delay, to a tenth of a second.
    mistakes = [
        Mistake(file, f"sweep.{key}", f"{value:g} s", "whole tenths of a second")
        for key, value in values.items()
        if round(value, 1) != value
    ]
    if sweep.last_s < sweep.first_s:
        problem = f"{sweep.last_s:g} lies below first_s"
        mistakes.append(Mistake(file, "sweep.last_s", problem, f"from {sweep.first_s:g}"))
    return mistakes or _count_mistakes(sweep, file)


def _count_mistakes(sweep: SweepEntry, file: str) -> list[Mistake]:
    range_s = sweep.last_s - sweep.first_s
    if round(10.0 * range_s) % round(10.0 * sweep.step_s):
        problem = f"{range_s:g} s is not a whole number of steps of {sweep.step_s:g} s"
        return [Mistake(file, "sweep.step_s", problem, "a step that divides last_s - first_s")]
    count = len(swept_delays_s(sweep))
    if count > MOST_DELAYS:
        problem, allowed = f"makes {count} delays", f"a step of up to {MOST_DELAYS} delays"
        return [Mistake(file, "sweep.step_s", problem, allowed)]
    return []


def swept_delays_s(sweep: SweepEntry) -> tuple[float, ...]:
    """
    Return the delays of a sweep.

    Parameters
    ----------
    sweep
        A sweep without mistakes.

    Returns
    -------
    tuple[float, ...]
        From the first to the last, exact to a tenth of a second. [s]
    """
    first, last, step = (
        round(10.0 * value) for value in (sweep.first_s, sweep.last_s, sweep.step_s)
    )
    return tuple(tenths / 10.0 for tenths in range(first, last + 1, step))


def delay_mistakes(
    settings: ScenarioFile | None,
    quantiles: Table[QuantileRow] | None,
    timetable: TimetableTables,
) -> list[Mistake]:
    """
    Return everything that is wrong with dwell delays, overstays and the train of a sweep.

    Parameters
    ----------
    settings
        The main file; nothing if it has mistakes of its own.
    quantiles
        Measured delays; nothing if the scenario has none.
    timetable
        The files of the timetable.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes = _quantile_mistakes(quantiles) if quantiles else []
    if settings is None or not (timetable.services.complete and timetable.calls.complete):
        return mistakes
    calls = calls_by_train(timetable)
    for index, entry in enumerate(settings.overstays):
        mistakes += _call_mistakes(entry.train, entry.station, f"overstays.{index}", calls)
    if settings.sweep:
        sweep = settings.sweep
        unknown = _call_mistakes(sweep.train, sweep.station, "sweep", calls)
        mistakes += unknown or _follower_mistakes(sweep, calls)
    return mistakes


def _call_mistakes(
    train: str, station: str, place: str, calls: Mapping[str, Sequence[CallRow]]
) -> list[Mistake]:
    if train not in calls:
        problem, allowed = f"unknown train {train!r}", meant(train, calls)
        return [Mistake(MAIN_FILE, f"{place}.train", problem, allowed)]
    stations = [call.station for call in calls[train]]
    if station not in stations:
        problem, allowed = f"train {train!r} does not call at {station!r}", meant(station, stations)
        return [Mistake(MAIN_FILE, f"{place}.station", problem, allowed)]
    return []


def _follower_mistakes(sweep: SweepEntry, calls: Mapping[str, Sequence[CallRow]]) -> list[Mistake]:
    own = next(call for call in calls[sweep.train] if call.station == sweep.station)
    # A train that starts at the platform does not arrive there.
    for others in calls.values():
        for call in others[1:]:
            same = (call.station, call.track) == (own.station, own.track)
            if same and call.arrival > own.arrival:
                return []
    problem = f"no train arrives after {sweep.train!r} at its platform track {own.track!r}"
    allowed = "a call where another train follows to the same track"
    return [Mistake(MAIN_FILE, "sweep.station", problem, allowed)]


def _quantile_mistakes(table: Table[QuantileRow]) -> list[Mistake]:
    mistakes = []
    for before, after in pairwise(table):
        if after.level <= before.level:
            problem, allowed = f"{after.level:g} does not rise", f"above {before.level:g}"
            mistakes.append(table.mistake(after, "level", problem, allowed))
        if after.delay_s < before.delay_s:
            problem, allowed = f"{after.delay_s:g} falls", f"from {before.delay_s:g}"
            mistakes.append(table.mistake(after, "delay_s", problem, allowed))
    if table.complete and table.rows:
        for row, wanted in ((table.rows[0], 0.0), (table.rows[-1], 1.0)):
            if row.level != wanted:
                problem = f"{row.level:g} is not the end of the distribution"
                mistakes.append(table.mistake(row, "level", problem, f"{wanted:g}"))
    return mistakes


def kind_mistakes(main: ScenarioFile, file: str, *, network: bool) -> list[Mistake]:
    """
    Return settings that this kind of line does not have.

    Parameters
    ----------
    main
        The main file.
    file
        Its name.
    network
        The line is a network, not a chain.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    if not network:
        if main.interlocking.order == "timetable":
            return []
        problem, allowed = "a chain has no turns to give", "timetable, or a line with nodes.csv"
        return [Mistake(file, "interlocking.order", problem, allowed)]
    unsupported = ("work_zones", "equipment_faults", "points_failures", "crossing_obstacles")
    given = [key for key in unsupported if getattr(main, key)]
    if main.random_disruptions != RandomDisruptions():
        given.append("random_disruptions")
    problem, allowed = "a network has no disruptions", "none, or a line without nodes.csv"
    return [Mistake(file, key, problem, allowed) for key in given]
