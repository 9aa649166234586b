"""Cross-checks of train types, controllers and dwell delays."""

from itertools import pairwise

from scenarios.check_timetable import TimetableTables, calls_by_train
from scenarios.faults import Fault, meant
from scenarios.files import Table
from scenarios.schema import QuantileRow, RollingStockFile, ScenarioFile


def rolling_stock_faults(stock: RollingStockFile, file: str) -> list[Fault]:
    """
    Return contradictions within the train types.

    Parameters
    ----------
    stock
        The train types.
    file
        Name of their file.

    Returns
    -------
    list[Fault]
        The faults.
    """
    faults = []
    for name, train in stock.train.items():
        if train.motor_mass_t > train.mass_t:
            problem = f"{train.motor_mass_t:g} is more than the mass of the train"
            place = f"train.{name}.motor_mass_t"
            faults.append(Fault(file, place, problem, f"up to {train.mass_t:g}"))
        if train.emergency_brake_kmhps < train.service_brake_kmhps:
            problem = f"{train.emergency_brake_kmhps:g} is weaker than the service brake"
            place = f"train.{name}.emergency_brake_kmhps"
            faults.append(Fault(file, place, problem, f"from {train.service_brake_kmhps:g}"))
        if train.traction.characteristic_speed_kmh < train.traction.power_speed_kmh:
            problem = f"{train.traction.characteristic_speed_kmh:g} lies below power_speed_kmh"
            place = f"train.{name}.traction.characteristic_speed_kmh"
            faults.append(Fault(file, place, problem, f"from {train.traction.power_speed_kmh:g}"))
    return faults


def step_faults(settings: ScenarioFile, file: str) -> list[Fault]:
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
    list[Fault]
        The faults.
    """
    if float(f"{settings.step_s:.3f}") == settings.step_s:
        return []
    return [Fault(file, "step_s", f"{settings.step_s:g} s", "whole milliseconds")]


def controller_faults(settings: ScenarioFile, file: str) -> list[Fault]:
    """
    Return names of controllers that would share one folder of results.

    Parameters
    ----------
    settings
        The main file.
    file
        Its name.

    Returns
    -------
    list[Fault]
        The faults.
    """
    first: dict[str, str] = {}
    faults = []
    for name in settings.controllers:
        other = first.setdefault(name.lower(), name)
        if other != name:
            problem = f"differs from {other!r} only by capital letters"
            faults.append(Fault(file, f"controllers.{name}", problem, "every name once"))
    return faults


def delay_faults(
    settings: ScenarioFile | None,
    quantiles: Table[QuantileRow] | None,
    timetable: TimetableTables,
) -> list[Fault]:
    """
    Return everything that is wrong with dwell delays and overstays.

    Parameters
    ----------
    settings
        The main file; nothing if it has faults of its own.
    quantiles
        Measured delays; nothing if the scenario has none.
    timetable
        The files of the timetable.

    Returns
    -------
    list[Fault]
        The faults.
    """
    faults = _quantile_faults(quantiles) if quantiles else []
    calls = calls_by_train(timetable)
    known = timetable.services.complete and timetable.calls.complete
    for index, entry in enumerate(settings.overstays if settings and known else ()):
        place = f"overstays.{index}"
        if entry.train not in calls:
            problem, allowed = f"unknown train {entry.train!r}", meant(entry.train, calls)
            faults.append(Fault("scenario.toml", f"{place}.train", problem, allowed))
            continue
        stations = [call.station for call in calls[entry.train]]
        if entry.station not in stations:
            problem = f"train {entry.train!r} does not call at {entry.station!r}"
            allowed = meant(entry.station, stations)
            faults.append(Fault("scenario.toml", f"{place}.station", problem, allowed))
    return faults


def _quantile_faults(table: Table[QuantileRow]) -> list[Fault]:
    faults = []
    for before, after in pairwise(table):
        if after.level <= before.level:
            problem, allowed = f"{after.level:g} does not rise", f"above {before.level:g}"
            faults.append(table.fault(after, "level", problem, allowed))
        if after.delay_s < before.delay_s:
            problem, allowed = f"{after.delay_s:g} falls", f"from {before.delay_s:g}"
            faults.append(table.fault(after, "delay_s", problem, allowed))
    if table.complete and table.rows:
        for row, wanted in ((table.rows[0], 0.0), (table.rows[-1], 1.0)):
            if row.level != wanted:
                problem = f"{row.level:g} is not the end of the distribution"
                faults.append(table.fault(row, "level", problem, f"{wanted:g}"))
    return faults
