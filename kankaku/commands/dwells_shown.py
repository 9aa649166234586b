"""What the command ``dwells`` shows: dwells by station, their correlation, and what was written."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kankaku.commands.screen import answers, complain, counted_text, show_table
from kankaku.commands.shipped_names import refuse_shipped
from kankaku.commands.told_tables import path_line
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.draft import DraftError, refuse_there, write_files
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.observing.dwell_files import (
    NOTES_FILE,
    WrittenDwells,
    delay_settings,
    statistics_text,
    write_dwells,
    write_into_scenario,
)
from kankaku.scenarios.observing.dwell_statistics import DwellStatistics, dwell_statistics
from kankaku.scenarios.observing.event_sources import observed
from kankaku.scenarios.observing.observed_dwells import dwells_of

BESIDE = "observed_dwells"
"""Folder of figures and of the table for people, beside the files that a scenario reads."""


def work_out_dwells(
    events: Path,
    out: Path | None,
    scenario: Path | None,
    line: str,
    timezone: str,
    longest_s: float,
    *,
    force: bool,
) -> int:
    """
    Work out dwells and tell them.

    Parameters
    ----------
    events
        Observed events.
    out
        Folder to write into; nothing is written if there is neither this nor a scenario.
    scenario
        Scenario to write into.
    line
        Only events of this line.
    timezone
        Of the line.
    longest_s
        What lasts longer is no dwell. [s]
    force
        Whether files may be replaced.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        if out and scenario:
            where, problem = "--out and --scenario", "both are named"
            raise DraftError(where, problem, "one of the two")
        if scenario:
            refuse_shipped(scenario)
        folder = scenario or out
        if folder:
            refuse_there(folder, [BESIDE], "another folder, or --force", force=force)
        found = dwell_statistics(dwells_of(observed(events, line, timezone), longest_s))
        written = _written(found, out, scenario, force=force)
    except KankakuError as error:
        complain(f"{events} {error.verdict}", error.sentences, error.pointer)
    _tell(found)
    if folder and written:
        _draw(found, folder / BESIDE, force=force)
        path_line("Written", folder)
        answers.print(f"{', '.join(written.files)}; figures in {BESIDE}.", soft_wrap=True)
        answers.print(f"What was assumed and left out: {NOTES_FILE}.")
        if written.kept:
            told = counted_text(len(written.kept), "station keeps", "stations keep")
            answers.print(f"{told} the rows of before: {', '.join(written.kept)}.")
        if written.shortened:
            told = ", ".join(written.shortened)
            answers.print(f"Booked for less than the observed minimum dwell: {told}.")
    return 0


def _written(
    found: DwellStatistics, out: Path | None, scenario: Path | None, *, force: bool
) -> WrittenDwells | None:
    if out:
        return write_dwells(found, out, force=force)
    if scenario:
        written = write_into_scenario(found, scenario, force=force)
        try:
            load(scenario)
        except KankakuError as error:
            # What a run would refuse is told now.
            complain(f"{scenario} was written, and {error.verdict}", error.sentences, error.pointer)
        return written
    return None


def _tell(found: DwellStatistics) -> None:
    sample = found.sample
    # As a scenario has them: the whole of a day, then hours.
    header = ("station", "hour", "dwells", "10 %", "50 %", "90 %", "minimum", "booked", "scale")
    rows = [
        (
            sample.names[group.station],
            "" if group.hour is None else f"{group.hour:02d}",
            str(group.dwells),
            *(f"{group.quantiles_s[at]:.0f}" for at in (0, 2, 4)),
            *(f"{group.minimum_s:.0f}", f"{group.booked_s:.0f}", f"{group.delay_scale:.2f}"),
        )
        for group in found.groups
    ]
    show_table(header, *rows)
    answers.print(
        f"{len(sample.dwells)} dwells of {sample.visits} visits, in seconds; left out: "
        f"{'; '.join(note.what for note in sample.notes.missing if note.effect == 'left out')}.",
        highlight=False,
    )
    one = found.correlation
    answers.print(
        f"Along a trip: correlation {one.value:.2f}, {one.low:.2f} to {one.high:.2f} with 95 % "
        f"({one.pairs} pairs); trip_correlation = {delay_settings(found)['trip_correlation']}.",
        highlight=False,
    )
    for whole in found.headways[:1]:
        answers.print(
            f"By headway: {60.0 * whole.slope:+.1f} s for each minute, standard error "
            f"{60.0 * whole.slope_error:.1f} ({whole.dwells} dwells).",
            highlight=False,
        )


def _draw(found: DwellStatistics, folder: Path, *, force: bool) -> None:
    from kankaku.analysis.figures.dwell_figures import (  # noqa: PLC0415 - takes long to import
        StationSample,
        station_dwell_figure,
    )
    from kankaku.analysis.figures.style import write_figure  # noqa: PLC0415 - the same

    write_files({"stations.csv": statistics_text(found)}, folder, force=force)
    sample = found.sample
    by_station = {
        group.station: [one.dwell_s for one in sample.dwells if one.station == group.station]
        for group in found.groups
    }
    stations = [
        StationSample(sample.names[name], np.array(dwells_s))
        for name, dwells_s in by_station.items()
    ]
    figure = station_dwell_figure(stations, title="Observed dwells")
    write_figure(figure, folder / "station_dwells")
    points = [
        (one.headway_s, one.dwell_s - float(np.median(by_station[one.station])))
        for one in sample.dwells
        if one.headway_s is not None and one.station in by_station
    ]
    if points and found.headways:
        _draw_headways(points, found.headways[0].slope, folder / "dwell_headway")


def _draw_headways(points: Sequence[tuple[float, float]], slope: float, stem: Path) -> None:
    from kankaku.analysis.figures.dwell_figures import (  # noqa: PLC0415 - takes long to import
        dwell_headway_figure,
    )
    from kankaku.analysis.figures.style import write_figure  # noqa: PLC0415 - the same

    headways_s, beyond_s = np.array(points).T
    title = "Dwells and the interval to the train before"
    write_figure(dwell_headway_figure(headways_s, beyond_s, slope=slope, title=title), stem)
