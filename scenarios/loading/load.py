"""From a scenario folder to a scenario: the one place where field units become SI."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from kankaku.railway.motion.feasibility import assess
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.scenario import (
    MAIN_FILE,
    UNSUPERVISED,
    ControllerSpec,
    Published,
    Scenario,
    Sweep,
)
from kankaku.railway.plan.timetable import Timetable
from kankaku.scenarios.checks.check_line import line_mistakes
from kankaku.scenarios.checks.check_network import network_mistakes
from kankaku.scenarios.checks.check_network_timetable import (
    network_timetable_mistakes,
    order_mistakes,
    standing_mistakes,
    way_mistakes,
)
from kankaku.scenarios.checks.check_running import running_mistakes, running_warnings
from kankaku.scenarios.checks.check_settings import (
    controller_mistakes,
    delay_mistakes,
    driving_mistakes,
    kind_mistakes,
    radio_mistakes,
    step_mistakes,
    sweep_mistakes,
    swept_delays_s,
)
from kankaku.scenarios.checks.check_stock import limit_mistakes
from kankaku.scenarios.checks.check_timetable import (
    TimetableTables,
    timetable_mistakes,
)
from kankaku.scenarios.checks.check_wayside import crossing_mistakes, disruption_mistakes
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.loading.load_driving import driving_style
from kankaku.scenarios.loading.load_line import read_line, to_line
from kankaku.scenarios.loading.load_stock import STOCK_FILE, read_stock, to_train_types
from kankaku.scenarios.loading.load_timetable import to_timetable
from kankaku.scenarios.loading.load_wayside import to_disruptions
from kankaku.scenarios.reading import row_formats, schema
from kankaku.scenarios.reading.files import Reader, Table
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.scenarios.reading.neighbours import folder_mistakes, uncollected, unread


@uncollected()
def load(folder: Path) -> Scenario:
    """
    Read a scenario folder.

    Parameters
    ----------
    folder
        Folder with ``scenario.toml``; it may name other folders for line, rolling stock,
        timetable and dwell delays, relative to itself.

    Returns
    -------
    Scenario
        The scenario, in SI units.

    Raises
    ------
    ScenarioError
        With every mistake of every file.
    """
    reader = Reader()
    main, folders = _read_main(reader, folder)
    line = read_line(reader, folders["line"])
    stock = read_stock(reader, folders["rolling_stock"])
    timetable = _read_timetable(reader, folders["timetable"])
    quantiles = _read_quantiles(reader, folder, main)
    reader.mistakes += _mistakes(line, timetable, stock)
    reader.mistakes += disruption_mistakes(main, line, timetable, MAIN_FILE)
    if main:
        reader.mistakes += kind_mistakes(main, MAIN_FILE, network=line.nodes.present)
    reader.mistakes += delay_mistakes(main, quantiles, timetable)
    reader.mistakes += folder_mistakes(folder)
    if reader.mistakes or main is None or stock is None:
        raise ScenarioError(tuple(dict.fromkeys(reader.mistakes)))
    of_line = to_line(line, folders["line"].resolve().name)
    if line.nodes.present and (lost := way_mistakes(of_line, line, timetable)):
        raise ScenarioError(tuple(lost))
    train_types = to_train_types(stock)
    services = to_timetable(timetable, line, of_line, train_types, main.turn_back.minimum_s)
    _refuse_stuck(of_line, services, train_types, timetable)
    running = assess(of_line, train_types, services)
    if running.shortfalls:
        raise ScenarioError(tuple(running_mistakes(running, STOCK_FILE, train_types)))
    first_come = main.interlocking.order == "first_come"
    release_delay_s = main.train_detection.release_delay_s
    return Scenario(
        name=folder.resolve().name,
        title=main.title,
        line=replace(of_line, release_delay_s=release_delay_s, first_come=first_come),
        train_types=train_types,
        timetable=services,
        dwell_delays=_to_delays(main, quantiles),
        controllers=_to_controllers(main),
        seed=main.seed,
        step_s=main.step_s,
        patience_s=60.0 * main.patience_min,
        digest=reader.digest,
        sweep=_to_sweep(main.sweep),
        published=_to_published(main.published),
        radio=_to_radio(main.radio),
        disruptions=to_disruptions(main, of_line),
        driving=driving_style(main, main.driving),
        warnings=(
            *unread((folder, *folders.values()), has_delays=main.dwell_delays is not None),
            *running_warnings(running, timetable.calls.file),
        ),
    )


def _mistakes(
    line: LineTables, timetable: TimetableTables, stock: schema.RollingStockFile | None
) -> list[Mistake]:
    """Return what is wrong between the files of line, timetable and fleet."""
    mistakes = limit_mistakes(line, stock) if stock else []
    if line.nodes.present:
        mistakes += network_mistakes(line)
        return mistakes + network_timetable_mistakes(timetable, line, stock)
    mistakes += line_mistakes(line) + crossing_mistakes(line)
    return mistakes + timetable_mistakes(timetable, line, stock)


def _refuse_stuck(
    line: Line,
    services: Timetable,
    train_types: Mapping[str, TrainType],
    timetable: TimetableTables,
) -> None:
    """Refuse trains that stand where others pass, or would wait for each other for ever."""
    for mistakes_of in (standing_mistakes, order_mistakes):
        if found := mistakes_of(line, services, train_types, timetable):
            raise ScenarioError(tuple(found))


def _read_main(reader: Reader, folder: Path) -> tuple[schema.ScenarioFile | None, dict[str, Path]]:
    """Return the main file and the folders it names, these even if it has other mistakes."""
    read = reader.toml(folder / MAIN_FILE, "scenario")
    data = read or {}
    main = None
    if read is not None:
        main, mistakes = schema.check(schema.ScenarioFile, data, MAIN_FILE)
        reader.mistakes += mistakes
    if main:
        for mistakes_of in (
            step_mistakes,
            controller_mistakes,
            driving_mistakes,
            radio_mistakes,
            sweep_mistakes,
        ):
            reader.mistakes += mistakes_of(main, MAIN_FILE)
    return main, {
        key: _folder(reader, folder, data.get(key, "."), key)
        for key in ("line", "rolling_stock", "timetable")
    }


def _folder(reader: Reader, folder: Path, named: object, key: str) -> Path:
    if not isinstance(named, str):
        return folder
    if Path(named).is_absolute() or (named != "." and not (folder / named).is_dir()):
        problem, allowed = f"no folder {named!r}", f"a folder relative to that of {MAIN_FILE}"
        reader.mistakes.append(Mistake(MAIN_FILE, key, problem, allowed))
        return folder
    return folder / named


def _read_timetable(reader: Reader, folder: Path) -> TimetableTables:
    return TimetableTables(
        services=reader.csv(folder / "services.csv", "timetable", row_formats.ServiceRow),
        calls=reader.csv(folder / "calls.csv", "timetable", row_formats.CallRow),
        dwell_stations=reader.csv(
            folder / "dwell_stations.csv", "timetable", row_formats.DwellStationRow
        ),
    )


def _read_quantiles(
    reader: Reader, folder: Path, main: schema.ScenarioFile | None
) -> Table[row_formats.QuantileRow] | None:
    if main is None or main.dwell_delays is None:
        return None
    named = _folder(reader, folder, main.dwell_delays.folder, "dwell_delays.folder")
    return reader.csv(named / "dwell_quantiles.csv", "dwell_delays", row_formats.QuantileRow)


def _to_delays(
    main: schema.ScenarioFile,
    quantiles: Table[row_formats.QuantileRow] | None,
) -> DwellDelays:
    overstays = tuple(Overstay(item.train, item.station, item.delay_s) for item in main.overstays)
    if quantiles is None or main.dwell_delays is None:
        return DwellDelays(overstays=overstays)
    return DwellDelays(
        levels=tuple(row.level for row in quantiles),
        delays_s=tuple(row.delay_s for row in quantiles),
        scale=main.dwell_delays.scale,
        cap_s=main.dwell_delays.cap_s,
        trip_correlation=main.dwell_delays.trip_correlation,
        overstays=overstays,
    )


def _to_controllers(main: schema.ScenarioFile) -> tuple[ControllerSpec, ...]:
    return tuple(
        ControllerSpec(
            name,
            item.protection or "",
            item.operation or "",
            item.protection_options,
            item.operation_options,
            item.peer,
            item.by_default,
            item.radio,
            None if item.driving is None else driving_style(main, item.driving),
            item.eco_margin_s,
            item.eco_reserve,
            item.supervision or UNSUPERVISED,
            item.supervision_options,
        )
        for name, item in main.controllers.items()
    )


def _to_radio(entry: schema.RadioEntry | None) -> RadioSpec:
    if entry is None:
        return LOSSLESS
    return RadioSpec(
        cycle_s=entry.cycle_s,
        delay_least_s=entry.delay_least_s,
        delay_most_s=entry.delay_most_s,
        loss_ratio=entry.loss_percent / 100.0,
        burst_factor=entry.burst_factor,
    )


def _to_sweep(entry: schema.SweepEntry | None) -> Sweep | None:
    if entry is None:
        return None
    return Sweep(entry.train, entry.station, swept_delays_s(entry))


def _to_published(entry: schema.PublishedEntry | None) -> Published | None:
    if entry is None:
        return None
    return Published(entry.source, entry.model_dump(exclude={"source"}, exclude_none=True))
