"""From a scenario folder to a scenario: the one place where field units become SI."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from kankaku.railway.motion.feasibility import assess
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.line import (
    Block,
    Gradient,
    Line,
    Platform,
    Section,
    SpeedLimit,
    Station,
    Track,
    TrackCurve,
)
from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec
from kankaku.railway.plan.rolling_stock import PowerSupply, Traction, TrainType, handbook_resistance
from kankaku.railway.plan.scenario import ControllerSpec, Published, Scenario, Sweep
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.scenarios.checks.check_line import LineTables, line_mistakes
from kankaku.scenarios.checks.check_running import running_mistakes, running_warnings
from kankaku.scenarios.checks.check_settings import (
    controller_mistakes,
    delay_mistakes,
    radio_mistakes,
    rolling_stock_mistakes,
    step_mistakes,
    sweep_mistakes,
    swept_delays_s,
)
from kankaku.scenarios.checks.check_timetable import (
    TimetableTables,
    calls_by_train,
    seconds,
    timetable_mistakes,
)
from kankaku.scenarios.checks.check_wayside import crossing_mistakes, disruption_mistakes
from kankaku.scenarios.checks.ways import ends_on_the_way, route_of
from kankaku.scenarios.loading.load_wayside import to_crossings, to_disruptions, to_turnouts
from kankaku.scenarios.reading import schema
from kankaku.scenarios.reading.files import Reader, Table
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.scenarios.reading.neighbours import folder_mistakes, uncollected, unread
from kankaku.scenarios.reading.units import metres

MAIN_FILE = "scenario.toml"
STOCK_FILE = "rolling_stock.toml"


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
    reader.mistakes += line_mistakes(line) + crossing_mistakes(line)
    reader.mistakes += timetable_mistakes(timetable, line, stock)
    reader.mistakes += disruption_mistakes(main, line, timetable, MAIN_FILE)
    reader.mistakes += delay_mistakes(main, quantiles, timetable)
    reader.mistakes += folder_mistakes(folder)
    if reader.mistakes or main is None or stock is None:
        raise ScenarioError(tuple(dict.fromkeys(reader.mistakes)))
    of_line = to_line(line, folders["line"].resolve().name)
    train_types, services = to_train_types(stock), _to_timetable(timetable, line)
    running = assess(of_line, train_types, services)
    if running.shortfalls:
        raise ScenarioError(tuple(running_mistakes(running, STOCK_FILE)))
    return Scenario(
        name=folder.resolve().name,
        title=main.title,
        line=replace(of_line, release_delay_s=main.train_detection.release_delay_s),
        train_types=train_types,
        timetable=services,
        dwell_delays=_to_delays(main, quantiles, timetable),
        controllers=_to_controllers(main),
        seed=main.seed,
        step_s=main.step_s,
        patience_s=60.0 * main.patience_min,
        digest=reader.digest,
        sweep=_to_sweep(main.sweep),
        published=_to_published(main.published),
        radio=_to_radio(main.radio),
        disruptions=to_disruptions(main, of_line),
        warnings=(
            *unread((folder, *folders.values()), has_delays=main.dwell_delays is not None),
            *running_warnings(running, timetable.calls.file),
        ),
    )


def _read_main(reader: Reader, folder: Path) -> tuple[schema.ScenarioFile | None, dict[str, Path]]:
    """Return the main file and the folders it names, these even if it has other mistakes."""
    read = reader.toml(folder / MAIN_FILE, "scenario")
    data = read or {}
    main = None
    if read is not None:
        main, mistakes = schema.check(schema.ScenarioFile, data, MAIN_FILE)
        reader.mistakes += mistakes
    if main:
        for mistakes_of in (step_mistakes, controller_mistakes, radio_mistakes, sweep_mistakes):
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


def read_line(reader: Reader, folder: Path) -> LineTables:
    """
    Read the files of a line.

    Parameters
    ----------
    reader
        Collects mistakes.
    folder
        Their folder.

    Returns
    -------
    LineTables
        What they hold.
    """
    return LineTables(
        stations=reader.csv(folder / "stations.csv", "line", schema.StationRow),
        tracks=reader.csv(folder / "tracks.csv", "line", schema.TrackRow),
        platforms=reader.csv(folder / "platforms.csv", "line", schema.PlatformRow),
        turnouts=reader.csv(folder / "turnouts.csv", "line", schema.TurnoutRow, optional=True),
        crossings=reader.csv(folder / "crossings.csv", "line", schema.CrossingRow, optional=True),
        limits=reader.csv(folder / "limits.csv", "line", schema.LimitRow, optional=True),
        gradients=reader.csv(folder / "gradients.csv", "line", schema.GradientRow, optional=True),
        curves=reader.csv(folder / "curves.csv", "line", schema.CurveRow, optional=True),
        balises=reader.csv(folder / "balises.csv", "line", schema.BaliseRow, optional=True),
        blocks=reader.csv(folder / "blocks.csv", "line", schema.BlockRow, optional=True),
        circuits=reader.csv(folder / "circuits.csv", "line", schema.CircuitRow, optional=True),
        geometry=reader.csv(folder / "geometry.csv", "line", schema.GeometryRow, optional=True),
    )


def read_stock(reader: Reader, folder: Path) -> schema.RollingStockFile | None:
    """
    Read the train types.

    Parameters
    ----------
    reader
        Collects mistakes.
    folder
        Their folder.

    Returns
    -------
    RollingStockFile | None
        The train types; nothing if they have mistakes.
    """
    data = reader.toml(folder / STOCK_FILE, "rolling_stock")
    if data is None:
        return None
    stock, mistakes = schema.check(schema.RollingStockFile, data, STOCK_FILE)
    reader.mistakes += mistakes
    if stock:
        reader.mistakes += rolling_stock_mistakes(stock, STOCK_FILE)
    return stock


def _read_timetable(reader: Reader, folder: Path) -> TimetableTables:
    return TimetableTables(
        services=reader.csv(folder / "services.csv", "timetable", schema.ServiceRow),
        calls=reader.csv(folder / "calls.csv", "timetable", schema.CallRow),
        dwell_stations=reader.csv(
            folder / "dwell_stations.csv", "timetable", schema.DwellStationRow
        ),
    )


def _read_quantiles(
    reader: Reader, folder: Path, main: schema.ScenarioFile | None
) -> Table[schema.QuantileRow] | None:
    if main is None or main.dwell_delays is None:
        return None
    named = _folder(reader, folder, main.dwell_delays.folder, "dwell_delays.folder")
    return reader.csv(named / "dwell_quantiles.csv", "dwell_delays", schema.QuantileRow)


def to_line(tables: LineTables, name: str) -> Line:
    """
    Convert a line to SI units.

    Parameters
    ----------
    tables
        Files without mistakes.
    name
        Name of the line.

    Returns
    -------
    Line
        The line.
    """
    return Line(
        name=name,
        stations=tuple(
            Station(
                row.id, row.name, row.name_local, metres(row.chainage_km), row.lon_deg, row.lat_deg
            )
            for row in tables.stations
        ),
        sections=tuple(_to_section(tracks) for tracks in tables.sections),
        platforms=tuple(
            Platform(
                row.station,
                row.track,
                metres(row.start_km),
                metres(row.end_km),
                metres(row.stop_km),
            )
            for row in tables.platforms
        ),
        turnouts=to_turnouts(tables),
        limits=tuple(
            SpeedLimit(metres(row.start_km), metres(row.end_km), row.limit_kmh / 3.6)
            for row in sorted(tables.limits, key=lambda row: row.start_km)
        ),
        gradients=tuple(
            Gradient(metres(row.start_km), metres(row.end_km), row.gradient_permil / 1000.0)
            for row in sorted(tables.gradients, key=lambda row: row.start_km)
        ),
        curves=tuple(
            TrackCurve(metres(row.start_km), metres(row.end_km), row.radius_m)
            for row in sorted(tables.curves, key=lambda row: row.start_km)
        ),
        balises_m=tuple(metres(row.chainage_km) for row in tables.balises),
        blocks=_to_blocks(tables.blocks),
        circuits=_to_blocks(tables.circuits),
        geometry_lon_lat_deg=tuple(
            (metres(row.chainage_km), row.lon_deg, row.lat_deg) for row in tables.geometry
        ),
        crossings=to_crossings(tables),
    )


def _to_blocks(rows: Iterable[schema.BlockRow]) -> tuple[Block, ...]:
    return tuple(
        Block(row.id, row.track, metres(row.start_km), metres(row.end_km))
        for row in sorted(rows, key=lambda row: (row.start_km, row.row))
    )


def _to_section(rows: Sequence[schema.TrackRow]) -> Section:
    tracks = tuple(Track(row.id, metres(row.start_km), metres(row.end_km)) for row in rows)
    return Section(tracks[0].start_m, tracks[0].end_m, tracks)


def to_train_types(stock: schema.RollingStockFile) -> Mapping[str, TrainType]:
    """
    Convert train types to SI units.

    Parameters
    ----------
    stock
        File without mistakes.

    Returns
    -------
    Mapping[str, TrainType]
        Train types by identifier.
    """
    return {name: _to_train_type(name, entry) for name, entry in stock.train.items()}


def _to_train_type(name: str, entry: schema.TrainEntry) -> TrainType:
    traction, supply = entry.traction, entry.supply
    motor_kg, mass_kg = 1000.0 * entry.motor_mass_t, 1000.0 * entry.mass_t
    return TrainType(
        id=name,
        cars=entry.cars,
        length_m=entry.length_m,
        mass_kg=mass_kg,
        rotating_mass_ratio=entry.rotating_mass_percent / 100.0,
        traction=Traction(
            starting_force_n=1000.0 * traction.starting_force_kn,
            power_speed_mps=traction.power_speed_kmh / 3.6,
            characteristic_speed_mps=traction.characteristic_speed_kmh / 3.6,
        ),
        resistance=handbook_resistance(motor_kg, mass_kg - motor_kg, entry.cars),
        service_brake_mps2=entry.service_brake_kmhps / 3.6,
        emergency_brake_mps2=entry.emergency_brake_kmhps / 3.6,
        maximum_speed_mps=entry.maximum_speed_kmh / 3.6,
        supply=PowerSupply(
            traction_efficiency=supply.traction_efficiency_percent / 100.0,
            regeneration_efficiency=supply.regeneration_efficiency_percent / 100.0,
            regeneration_force_n=1000.0 * supply.regeneration_force_kn,
            regeneration_power_w=1000.0 * supply.regeneration_power_kw,
            regeneration_cutoff_mps=supply.regeneration_cutoff_kmh / 3.6,
            auxiliary_w=1000.0 * supply.auxiliary_kw,
        ),
    )


def _to_timetable(timetable: TimetableTables, line: LineTables) -> Timetable:
    minimum_s = {row.station: row.minimum_dwell_s for row in timetable.dwell_stations}
    stop_m = {place: metres(platform.stop_km) for place, platform in line.platform_at.items()}
    calls = calls_by_train(timetable)
    sections = line.sections
    return Timetable(
        tuple(
            Service(
                train=service.train,
                origin=calls[service.train][0].station,
                train_type=service.train_type,
                route=tuple(
                    sections[number][index].id
                    for number, index in route_of(line, calls[service.train])
                ),
                calls=tuple(
                    Call(
                        station=call.station,
                        track=call.track,
                        stop_m=stop_m[call.station, call.track],
                        arrival_s=float(seconds(call.arrival)),
                        departure_s=float(seconds(call.departure)),
                        minimum_dwell_s=minimum_s[call.station],
                    )
                    for call in calls[service.train]
                ),
                leaves_at_last_call=ends_on_the_way(line, calls[service.train]),
            )
            for service in timetable.services
        )
    )


def _to_delays(
    main: schema.ScenarioFile,
    quantiles: Table[schema.QuantileRow] | None,
    timetable: TimetableTables,
) -> DwellDelays:
    overstays = tuple(Overstay(item.train, item.station, item.delay_s) for item in main.overstays)
    if quantiles is None or main.dwell_delays is None:
        return DwellDelays(overstays=overstays)
    return DwellDelays(
        levels=tuple(row.level for row in quantiles),
        delays_s=tuple(row.delay_s for row in quantiles),
        station_scale={row.station: row.delay_scale for row in timetable.dwell_stations},
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
