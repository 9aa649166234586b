"""The scenarios that come with the program, by their names."""

from pathlib import Path

PLACE = Path(__file__).parent
MAIN_FILE = "scenario.toml"


def shipped() -> tuple[str, ...]:
    """Return the names of the shipped scenarios, in order."""
    return tuple(sorted(file.parent.name for file in PLACE.glob(f"*/{MAIN_FILE}")))


def folder_of(named: str | Path) -> Path:
    """
    Return the folder of a scenario.

    Parameters
    ----------
    named
        Its folder, or the name of a shipped one; a folder of that name comes first.

    Returns
    -------
    Path
        A folder; it may be missing where nothing has that name.
    """
    place = Path(named)
    if not place.exists() and str(place) in shipped():
        return PLACE / place
    return place
