"""Sources of observed events by their form."""

from pathlib import Path

from kankaku.scenarios.observing.event_table import read_event_table
from kankaku.scenarios.observing.vehicle_positions import ENDINGS, read_vehicle_positions
from kankaku.scenarios.observing.visits import ObservedEvents


def observed(path: Path, line: str = "", timezone: str = "") -> ObservedEvents:
    """
    Read observed events.

    Parameters
    ----------
    path
        A CSV file, or messages of vehicle positions: a file, a folder or an archive.
    line
        Only events of this line; of all where it is empty.
    timezone
        Of the line.

    Returns
    -------
    ObservedEvents
        What was seen.

    Raises
    ------
    EventsError
        With everything that is wrong with the source.
    """
    name = path.name.casefold().removesuffix(".gz")
    if path.is_dir() or name.endswith((*ENDINGS, ".zip")):
        return read_vehicle_positions(path, line, timezone)
    return read_event_table(path, line, timezone)
