"""What the command ``blocks`` shows: the headway that a layout reaches, station by station."""

from collections.abc import Mapping
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from kankaku.commands.screen import answers, complain
from kankaku.commands.shipped_names import refuse_shipped
from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.control import Separation
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.drafts.block_design import BlockTrial, blocks_of
from kankaku.scenarios.drafts.draft import csv_text, refuse_there
from kankaku.scenarios.drafts.line_answers import RANGES, figure_of
from kankaku.scenarios.drafts.own_line import OwnLineError
from kankaku.scenarios.drafts.rewriting import ANEW, refuse_borrowed, rewritten
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.loading.load_line import read_line
from kankaku.scenarios.reading.files import Reader
from kankaku.studies.block_study import BlockLayout, chosen_spec, design

BLOCKS, CIRCUITS = "blocks.csv", "circuits.csv"
FIRST = BlockTrial(250.0, 250.0, at_platforms=False)
"""What a line without blocks is loaded with. [m]"""


class _Said:
    def __init__(self, headway: str) -> None:
        self.headway = headway


def lay_blocks(folder: Path, name: str, headway: str, *, force: bool) -> int:
    """
    Lay blocks, and track circuits if the protection uses them, for a headway.

    Parameters
    ----------
    folder
        Of the scenario.
    name
        Controller or protection for which.
    headway
        As typed. [s]
    force
        Whether files may be replaced.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        mistakes: list[str] = []
        headway_s = figure_of(_Said(headway), "headway", mistakes)
        if headway_s is None:
            least, most, kind = RANGES["headway"]
            raise OwnLineError(mistakes or [f"--headway: allowed: {kind}, {least:g} to {most:g}"])
        refuse_shipped(folder)
        refuse_borrowed(folder, "line")
        refuse_there(folder, [BLOCKS, CIRCUITS], ANEW, force=force)
        scenario, line = _loaded(folder)
        spec = chosen_spec(scenario, name)
        layout = design(scenario, line, spec, headway_s)
        files, note = _files(layout, spec.name, headway_s)
        rewritten(folder, files, () if CIRCUITS in files else (CIRCUITS,), note)
    except KankakuError as error:
        complain(f"{folder} {error.verdict}", error.sentences)
    _tell(folder, scenario, layout, files)
    return 0


def _loaded(folder: Path) -> tuple[Scenario, LineTables]:
    line = read_line(Reader(), folder)
    if (folder / BLOCKS).exists() or not folder.is_dir():
        return load(folder), line
    rows = blocks_of(line, (), FIRST)
    scenario = rewritten(folder, {BLOCKS: csv_text(rows)} if rows else {})
    (folder / BLOCKS).unlink(missing_ok=True)
    return scenario, line


def _files(layout: BlockLayout, name: str, headway_s: float) -> tuple[dict[str, str], str]:
    files = {BLOCKS: csv_text(layout.blocks)}
    if layout.circuits:
        files[CIRCUITS] = csv_text(layout.circuits)
    trial = layout.trial
    near = "track circuits" if layout.separation is Separation.CIRCUITS else "blocks"
    note = (
        f"## Blocks\n\n`{BLOCKS}` was made by `kankaku blocks --for {name} --headway "
        f"{headway_s:g}`: blocks of {trial.far_m:g} m or less, {near} by platforms of "
        f"{trial.near_m:g} m or less, the longest that were tried and reach that headway by "
        "blocking-time theory (UIC Code 406; Pachl, Railway Operation and Control, 2018). No "
        "signal is that of a real line."
    )
    return files, note


def _tell(folder: Path, scenario: Scenario, layout: BlockLayout, files: Mapping[str, str]) -> None:
    names = {station.id: station.name for station in scenario.line.stations}
    table = Table("into", "headway [s]", "decided at", "trains")
    worst = max(layout.reached, key=lambda name: layout.reached[name].headway_s)
    for station, found in layout.reached.items():
        mark = " critical" if station == worst else ""
        table.add_row(
            escape(names[station]),
            f"{found.headway_s:.1f}{mark}",
            f"km {found.place_km:.3f}",
            "falling" if found.falling else "rising",
        )
    answers.print(table)
    trial = layout.trial
    counted = f"{len(layout.blocks)} blocks of {trial.far_m:g} m or less"
    if layout.circuits:
        counted += f", divided into {len(layout.circuits)} track circuits by platforms"
    elif trial.near_m < trial.far_m:
        counted += f", {trial.near_m:g} m by platforms"
    answers.print(f"{counted}. Written: {', '.join(escape(str(folder / f)) for f in files)}")
    answers.print(
        "Points of terminals and junctions, where trains meet others, are not part of it.",
        soft_wrap=True,
    )
