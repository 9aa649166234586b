"""Driving styles of the main file to SI units."""

import math

from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.scenarios.reading import schema


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
