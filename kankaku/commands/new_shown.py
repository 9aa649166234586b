"""What the command ``new`` asks and shows: a line of one's own, and what its timetable takes."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer
from rich.markup import escape

from kankaku.commands.screen import answers, complain, console
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.commented import commented
from kankaku.scenarios.drafts.draft import DraftError, write_files
from kankaku.scenarios.drafts.line_answers import DEFAULT_TRAIN, LineAnswers, wish_of
from kankaku.scenarios.drafts.own_line import OwnLine, OwnLineError, drafted, own_line
from kankaku.scenarios.drafts.provenance_notes import SOURCES_FILE
from kankaku.scenarios.drafts.stock_library import library_names
from kankaku.scenarios.drafts.train_figures import EXAMPLE
from kankaku.scenarios.reading.neighbours import KNOWN
from kankaku.scenarios.reading.units import clock_of

NOBODY_ASKED = (
    '--stations: was not said, and there is no terminal to ask at; allowed: "Airport 0, Park 1.1, '
    'City 2.3" in km, or a CSV file with a name and a chainage in each row'
)
ASKED_AGAIN = 5
"""So often, at most. [-]"""
Ask = Callable[[str, str], str]
"""Asks a question with what holds if nothing is answered; returns the answer."""


def make_line(folder: Path, said: LineAnswers, *, force: bool) -> int:
    """
    Make a scenario of a list of stations and a few figures.

    Parameters
    ----------
    folder
        Where it is written.
    said
        What options said; without stations the rest is asked at the terminal.
    force
        Whether files may be replaced.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        if said.stations:
            line = own_line(wish_of(said, folder.resolve().name))
        elif sys.stdin.isatty():
            line = asked_line(said, folder.resolve().name, _prompt)
        else:
            raise OwnLineError([NOBODY_ASKED])
        (train,) = line.sketch.train_types
        draft = commented(drafted(line), f"{train}: see SOURCES.md for where its figures stand.")
        files = draft.files()
        _refuse_others(folder, files)
        write_files(files, folder, force=force)
    except KankakuError as error:
        complain(f"{folder} cannot be made", error.sentences)
    _tell(folder, line)
    return 0


def _refuse_others(folder: Path, files: Mapping[str, str]) -> None:
    """Refuse a folder with files that a scenario would read, and that would not be replaced."""
    others = [name for name in KNOWN if name not in files and (folder / name).exists()]
    if others:
        where, problem = str(folder / others[0]), "would be read, and is of another line"
        raise DraftError(where, problem, "another folder, or to remove it")


def _prompt(question: str, usual: str) -> str:
    told: str = typer.prompt(question, default=usual or None, err=True)
    return told


def asked_line(said: LineAnswers, name: str, ask: Ask) -> OwnLine:
    """
    Ask for a line until the answers make one.

    Parameters
    ----------
    said
        What options said; only the rest is asked.
    name
        Title where none was said.
    ask
        Asks one question.

    Returns
    -------
    OwnLine
        The line.

    Raises
    ------
    KankakuError
        With what is still wrong after some rounds.
    """
    trains = ", ".join(library_names())
    questions = {
        "stations": ("Stations with km (Airport 0, Park 1.1, ...), or a CSV file", ""),
        "headway": ("Headway, in seconds", "300"),
        "from_time": ("First trains, from", "07:00"),
        "until_time": ("Last trains, until", "08:00"),
        "pattern": ("Which trains run where (full, or City to Zoo; several take turns)", "full"),
        "turn_back": ("Least time to turn back, in seconds", "120"),
        "dwell": ("Stop at a station, in seconds", "30"),
        "train": (f"Train ({trains}; or {EXAMPLE})", DEFAULT_TRAIN),
    }
    if said.train_figures:
        del questions["train"]
    for left in range(ASKED_AGAIN - 1, -1, -1):
        known = {key: getattr(said, key) for key in questions}
        told: dict[str, Any] = {
            key: known[key] or ask(text, usual).strip() for key, (text, usual) in questions.items()
        }
        try:
            return own_line(wish_of(replace(said, **told), name))
        except KankakuError as error:
            if not left:
                raise
            console.print("[bold red]That makes no line yet:[/]")
            for sentence in error.sentences:
                console.print(f"  {escape(sentence)}", soft_wrap=True)
            wrong = " ".join(error.sentences)
            # What was right holds now if nothing else is answered.
            questions = {
                key: (text, "" if f"--{_option(key)}:" in wrong else told[key] or usual)
                for key, (text, usual) in questions.items()
            }
            blank: dict[str, Any] = dict.fromkeys(questions, "")
            said = replace(said, **blank)
    msg = "somebody is asked at least once"
    raise AssertionError(msg)


def _option(key: str) -> str:
    return key.removesuffix("_time").replace("_", "-")


def _tell(folder: Path, line: OwnLine) -> None:
    sketch, booked = line.sketch, line.booked
    first, last = sketch.stops[0], sketch.stops[-1]
    turns = ", ".join(f"{name} {turn_s} s" for name, turn_s in sorted(booked.turns_s.items()))
    starts_s = [trip.calls[0].departure_s for trip in booked.trips]
    answers.print(
        escape(
            f"{sketch.title}: {len(sketch.stops)} stations from {first.name} to {last.name}, "
            f"{last.chainage_km - first.chainage_km:g} km; {len(booked.trips)} runs from "
            f"{clock_of(min(starts_s))} to {clock_of(max(starts_s))} by {booked.sets} trains; "
            f"turn-backs {turns or 'none'}."
        ),
        soft_wrap=True,
    )
    notes = sketch.notes
    answers.print(
        f"{len(notes.taken)} things taken, {len(notes.assumed)} assumed, {len(notes.missing)} "
        f"missing: see {escape(str(folder / SOURCES_FILE))}.",
        soft_wrap=True,
    )
    answers.print(
        f"Next: kankaku check {escape(str(folder))}; kankaku run {escape(str(folder))}",
        soft_wrap=True,
    )
