"""What every command shows: answers, progress, and complaints that fit on one screen."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from kankaku.interrupts import EXIT_INTERRUPTED
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.reading.cell_texts import printable

if TYPE_CHECKING:
    from kankaku.studies.outcomes import Study

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_VIOLATION = 3
SIDE_BY_SIDE = 4
"""Controllers in one table, the first one in all; more do not fit on a screen."""
LOG_EVERY_S = 10.0
"""A log file is written to at most so often, but for runs that are finished. [s]"""
SHOWN_SENTENCES = 10
"""So that the first ones stay on the screen."""
LONGEST_SENTENCE = 600
"""Characters; longer ones are cut off. [-]"""

# A name between colons is no picture.
console = Console(stderr=True, emoji=False)
answers = Console(emoji=False)


def bars(*columns: ProgressColumn) -> Progress:
    """
    Return progress bars.

    Parameters
    ----------
    columns
        What a bar tells beside its share and the time taken.

    Returns
    -------
    Progress
        On the error stream.
    """
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        *columns,
        TimeElapsedColumn(),
        console=console,
    )


class Log:
    """Lines now and then, for a log file; nobody wants bars there."""

    def __init__(self, every_s: float = LOG_EVERY_S) -> None:
        self._every_s = every_s
        self._begun_s = time.monotonic()
        self._told_s = self._begun_s

    def tell(self, sentence: str, *, always: bool = False) -> None:
        """
        Write a line with the time taken so far.

        Parameters
        ----------
        sentence
            What to tell.
        always
            Even if it is not long since the last one.
        """
        now_s = time.monotonic()
        if always or now_s - self._told_s >= self._every_s:
            self._told_s = now_s
            minutes, seconds = divmod(int(now_s - self._begun_s), 60)
            told = f"{sentence}, {minutes:02d}:{seconds:02d}"
            console.print(escape(told), soft_wrap=True, highlight=False)


@contextmanager
def counted(name: str) -> Iterator[Callable[[int, int], None]]:
    """
    Show how many of several tasks are finished.

    Parameters
    ----------
    name
        What is done.

    Yields
    ------
    Callable[[int, int], None]
        To be called with the number of finished tasks, and of all.
    """
    if console.is_terminal:
        with bars() as shown:
            bar = shown.add_task(name)
            yield lambda done, total: shown.update(bar, completed=done, total=total)
    else:
        log = Log()
        yield lambda done, total: log.tell(f"{name}: {done} of {total}", always=done == total)


@contextmanager
def refusals(scenario: Path | str, out: Path) -> Iterator[None]:
    """
    Tell what of a scenario cannot be used or run, and end.

    Parameters
    ----------
    scenario
        Its folder or name; of several all of them.
    out
        Where results go.
    """
    try:
        yield
    except KankakuError as error:
        complain(f"{scenario} {error.verdict}", error.sentences, error.pointer)
    except OSError as error:
        told = f"{error.filename or out}: {error.strerror}" if error.strerror else str(error)
        complain(f"{scenario} cannot be run", [told])
    except KeyboardInterrupt:
        console.print("Interrupted: nothing new was written.")
        raise typer.Exit(EXIT_INTERRUPTED) from None


def chosen_of(scenario: Path, choices: Mapping[str, Any]) -> "Study":
    """
    Choose what to run, and tell what is doubtful in it.

    Parameters
    ----------
    scenario
        Folder or name of a scenario.
    choices
        As of :func:`kankaku.studies.study.choose`.

    Returns
    -------
    Study
        What to run.
    """
    from kankaku.studies import study  # noqa: PLC0415 - takes long to import

    chosen = study.choose(scenario, **choices)
    show_warnings(chosen.scenario.warnings)
    return chosen


def show_doubts(chosen: "Study") -> None:
    """
    Tell what is doubtful in how controllers fit the line.

    Parameters
    ----------
    chosen
        What is run.
    """
    from kankaku.controllers import registry  # noqa: PLC0415 - the same
    from kankaku.studies import study  # noqa: PLC0415 - the same

    world = study.world_of(chosen.scenario, chosen.step_s)
    show_warnings(registry.warnings(chosen.specs, world, chosen.scenario.radio))


def end_with(failures: Sequence[str]) -> int:
    """
    Tell what failed.

    Parameters
    ----------
    failures
        Sentences.

    Returns
    -------
    int
        How the command ends.
    """
    show_group(counted_text(len(failures), "failure", "failures"), failures)
    return exit_status(violations=False, failures=bool(failures), interrupted=False)


def complain(title: str, sentences: Sequence[str], pointer: str = "") -> NoReturn:
    """
    Tell what is wrong, and end.

    Parameters
    ----------
    title
        What cannot be done.
    sentences
        Why.
    pointer
        Where more is told.

    Raises
    ------
    typer.Exit
        Always.
    """
    console.print(f"[bold red]{_harmless(title)}[/]", soft_wrap=True)
    list_sentences(sentences)
    if pointer:
        console.print(_harmless(pointer), soft_wrap=True, highlight=False)
    raise typer.Exit(EXIT_BAD_INPUT)


def _harmless(text: str) -> str:
    """Return a short text without markup or anything that moves a cursor."""
    kept = text if len(text) <= LONGEST_SENTENCE else f"{text[:LONGEST_SENTENCE]}..."
    return escape(printable(kept))


def list_sentences(sentences: Sequence[str]) -> None:
    """
    Write the first of some sentences.

    Parameters
    ----------
    sentences
        To the error stream.
    """
    for sentence in sentences[:SHOWN_SENTENCES]:
        console.print(f"  {_harmless(sentence)}", soft_wrap=True)
    if len(sentences) > SHOWN_SENTENCES:
        console.print(f"  and {len(sentences) - SHOWN_SENTENCES} more")


def show_warnings(sentences: Sequence[str]) -> None:
    """
    Tell what is allowed but doubtful.

    Parameters
    ----------
    sentences
        To the error stream.
    """
    if sentences:
        console.print(f"[yellow]{len(sentences)} doubtful[/]")
        list_sentences(sentences)


def show_group(title: str, sentences: Sequence[str], style: str = "bold red") -> None:
    """
    Tell some sentences under their own heading; nothing if there are none.

    Parameters
    ----------
    title
        The heading.
    sentences
        To the error stream.
    style
        Of the heading.
    """
    if sentences:
        console.print(f"[{style}]{escape(title)}[/]", soft_wrap=True)
        list_sentences(sentences)


def counted_text(number: int, one: str, many: str) -> str:
    """
    Return a number with its noun.

    Parameters
    ----------
    number
        How many.
    one
        The noun for one.
    many
        The noun for others.

    Returns
    -------
    str
        For example "2 runs failed".
    """
    return f"{number} {one if number == 1 else many}"


def exit_status(*, violations: bool, failures: bool, interrupted: bool) -> int:
    """
    Return how a command ends.

    Parameters
    ----------
    violations
        Safety was violated.
    failures
        A run failed.
    interrupted
        The user gave up.

    Returns
    -------
    int
        The gravest of them.
    """
    if violations:
        return EXIT_VIOLATION
    if failures:
        return EXIT_FAILED
    return EXIT_INTERRUPTED if interrupted else 0


def show_table(header: Sequence[str], *rows: Sequence[str]) -> None:
    """
    Write a table of numbers.

    Parameters
    ----------
    header
        Names of the columns, the first one of texts.
    rows
        Cells.
    """
    # Names with spaces wrap where a reader expects it.
    table = Table(*(escape(name.replace("_", " ")) for name in header))
    table.columns[0].overflow = "fold"
    for column in table.columns[1:]:
        column.justify, column.overflow = "right", "fold"
    for row in rows:
        table.add_row(*map(escape, row))
    answers.print(table)


def show_side_by_side(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, kept: int, shown: int
) -> None:
    """
    Write a table of controllers, as many tables as it takes.

    Parameters
    ----------
    header
        Names of the columns.
    rows
        Cells.
    kept
        The first columns, which are in every table. [-]
    shown
        How many others fit beside them. [-]
    """
    for first in range(kept, max(len(header), kept + 1), shown):
        columns = [*range(kept), *range(first, min(first + shown, len(header)))]
        show_table(*([line[column] for column in columns] for line in (header, *rows)))
