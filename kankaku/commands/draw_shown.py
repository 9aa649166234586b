"""What the command ``draw`` shows: the files of a figure."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from kankaku.analysis.asked_results import NotInResultsError, known_name, read_asked
from kankaku.analysis.words import time_of_day_s
from kankaku.commands.figure_files import file_of_figure, refuse_ending
from kankaku.commands.screen import refusals, show_warnings
from kankaku.commands.told_tables import path_line


def draw_figure(
    folder: Path,
    figure: str,
    files: Sequence[Path],
    chosen: Mapping[str, Sequence[str]],
    seed: int | None,
    *,
    window: tuple[str | None, str | None] = (None, None),
    title: str = "",
) -> int:
    """
    Draw a figure of saved results.

    Parameters
    ----------
    folder
        Results folder.
    figure
        Name of the figure.
    files
        Where to write it; its name with .png, .svg and .pdf in the folder ``figures`` of the
        results if empty.
    chosen
        Names of ``controllers``, ``trains`` and ``stations``; everything where none is named.
    seed
        Of which seed; the first one if None.
    window
        From when to when; None for the beginning, or the end.
    title
        Of the figure; the scenario and what is chosen if empty.

    Returns
    -------
    int
        How the command ends.
    """
    from kankaku.analysis.figures.drawing import (  # noqa: PLC0415 - takes long to import
        FIGURES,
        Choice,
        draw,
    )

    with refusals(folder, folder):
        known_name("figure", figure, list(FIGURES))
        for file in files:
            refuse_ending(file)
        asked = read_asked(folder, controllers=chosen["controllers"], seed=seed)
        show_warnings(asked.notes)
        results = asked.results
        choice = Choice(**chosen, window_s=_window_s(window), seed=seed)
        drawn = draw(results, figure, choice, title=title)
        usual = [results.folder / "figures" / f"{figure}.{kind}" for kind in ("png", "svg", "pdf")]
        for file in files or usual:
            path_line("Figure", file_of_figure(drawn, file))
    return 0


def _window_s(window: tuple[str | None, str | None]) -> tuple[float, float] | None:
    if window == (None, None):
        return None
    ends_s = [0.0, 1e6]
    for number, (option, text) in enumerate(zip(("--from", "--to"), window, strict=True)):
        if text is None:
            continue
        time_s = time_of_day_s(text)
        if time_s is None:
            raise NotInResultsError(option, f"{text[:40]!r} is no time of day", "07:30 or 07:30:20")
        ends_s[number] = time_s
    return ends_s[0], ends_s[1]
