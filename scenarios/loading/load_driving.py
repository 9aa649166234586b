"""Driving styles of the main file to SI units."""

import math
from pathlib import Path

from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.checks.check_settings import driving_mistakes
from kankaku.scenarios.reading import schema
from kankaku.scenarios.reading.files import Reader


def driving_style(main: schema.ScenarioFile, name: str) -> DrivingStyle:
    """
    Return a driving style by its name.

    Parameters
    ----------
    main
        File without mistakes.
    name
        Of one of its styles, or of the fastest one, which needs no table.

    Returns
    -------
    DrivingStyle
        In SI units.
    """
    entry = main.driving_styles.get(name)
    if entry is None:
        return FASTEST
    brake_kmhps = entry.station_brake_kmhps
    return DrivingStyle(
        name=name,
        traction_share=entry.traction_percent / 100.0,
        station_brake_mps2=math.inf if brake_kmhps is None else brake_kmhps / 3.6,
        below_limit_mps=entry.below_limit_kmh / 3.6,
        coasting_band_mps=entry.coasting_band_kmh / 3.6,
        departure_reaction_s=entry.departure_reaction_s,
        driven_speeds=entry.driven_speeds,
        late_after_s=math.inf if entry.late_after_s is None else entry.late_after_s,
    )


def read_driving(reader: Reader, folder: Path) -> DrivingStyle:
    """
    Read the driving style of a scenario, whatever else it has.

    Parameters
    ----------
    reader
        Collects mistakes.
    folder
        The scenario; one without a main file is driven as fast as it can be.

    Returns
    -------
    DrivingStyle
        In SI units.
    """
    if not (folder / MAIN_FILE).is_file():
        return FASTEST
    data = reader.toml(folder / MAIN_FILE, "scenario")
    main, mistakes = schema.check(schema.ScenarioFile, data or {}, MAIN_FILE)
    reader.mistakes += mistakes
    if main is None:
        return FASTEST
    reader.mistakes += driving_mistakes(main, MAIN_FILE)
    return driving_style(main, main.driving)
