"""What the command ``timetable`` shows: trains, and what they take."""

from pathlib import Path

from rich.markup import escape

from kankaku.commands.screen import answers, complain, show_warnings
from kankaku.commands.shipped_names import refuse_shipped
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.draft import refuse_there
from kankaku.scenarios.drafts.new_timetable import (
    CALLS,
    SERVICES,
    MadeTimetable,
    TimetableAnswers,
    made_timetable,
)
from kankaku.scenarios.drafts.rewriting import ANEW, refuse_borrowed, rewritten
from kankaku.scenarios.loading.reconstruct import write_calls
from kankaku.scenarios.reading.units import clock_of

NO_BRANCHES = "tracks.csv: trains cannot run through all stations; allowed: a line without branches"


def make_timetable(folder: Path, said: TimetableAnswers, *, force: bool) -> int:
    """
    Make services and calls of a scenario anew.

    Parameters
    ----------
    folder
        Of the scenario.
    said
        What options said.
    force
        Whether files may be replaced.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        refuse_shipped(folder)
        refuse_borrowed(folder, "timetable")
        refuse_there(folder, [SERVICES, CALLS], ANEW, force=force)
        made = made_timetable(folder, said)
        scenario = rewritten(folder, made.files, (), _note(made))
    except KankakuError as error:
        told = error.sentences
        if any("no way leads" in sentence for sentence in told):
            told = (NO_BRANCHES, *told)
        complain(f"{folder} gets no timetable", told)
    booked, asked = made.booked, made.asked
    starts_s = [trip.calls[0].departure_s for trip in booked.trips]
    turns = ", ".join(
        f"{name} {turn_s} s on {made.tracks.get(name, 1)} tracks"
        for name, turn_s in sorted(booked.turns_s.items())
    )
    answers.print(
        escape(
            f"{len(booked.trips)} runs from {clock_of(min(starts_s))} to "
            f"{clock_of(max(starts_s))}, {asked.headway_s} s apart, by {booked.sets} trains; "
            f"turn-backs {turns or 'none'}."
        ),
        soft_wrap=True,
    )
    show_warnings(scenario.warnings)
    return 0


def _note(made: MadeTimetable) -> str:
    asked = made.asked
    return (
        f"## Timetable\n\n`{SERVICES}` and `{CALLS}` were made by `kankaku timetable`: one train "
        f"every {asked.headway_s} s, least run times and {100.0 * asked.supplement:g} %, "
        f"turn-backs of {asked.turn_back_s} s or more. No train is that of a real timetable."
    )


def seconds_from_minutes(folder: Path, *, force: bool) -> int:
    """
    Make calls to the second from whole public minutes.

    Parameters
    ----------
    folder
        With ``public_timetable.csv``.
    force
        Whether ``calls.csv`` may be replaced.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        refuse_shipped(folder)
        written = write_calls(folder, force=force)
    except KankakuError as error:
        complain(f"{folder} gets no timetable", error.sentences)
    except OSError as error:
        told = f"{error.filename}: {error.strerror}" if error.strerror else str(error)
        complain(f"{folder} gets no timetable", [told])
    except ValueError as error:
        complain(f"{folder} gets no timetable", [str(error)])
    answers.print(f"Written: {escape(str(written))}", soft_wrap=True)
    return 0
