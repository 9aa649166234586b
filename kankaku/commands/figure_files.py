"""Where a command writes a figure that somebody asks for."""

from pathlib import Path
from typing import TYPE_CHECKING

from kankaku.analysis.asked_results import ResultsError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = ("png", "svg", "pdf")


def refuse_ending(file: Path) -> None:
    """
    Raise an error if nobody can draw into a file.

    Parameters
    ----------
    file
        Any path.

    Raises
    ------
    ResultsError
        If its ending is none of ``ENDINGS``.
    """
    if file.suffix.removeprefix(".").lower() not in ENDINGS:
        where = str(file)
        told = f"{file.suffix or 'no ending'} is no kind of figure"
        raise ResultsError(where, told, ", ".join(f".{ending}" for ending in ENDINGS))


def file_of_figure(figure: "Figure", file: Path) -> Path:
    """
    Write a figure into a file; its folder is made if it is missing.

    Parameters
    ----------
    figure
        The figure.
    file
        Its ending says of which kind.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ResultsError
        If there is no such kind.
    """
    from kankaku.analysis.figures.style import write_figure  # noqa: PLC0415 - takes long to import

    refuse_ending(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    (written,) = write_figure(figure, file.with_suffix(""), [file.suffix.removeprefix(".").lower()])
    return written
