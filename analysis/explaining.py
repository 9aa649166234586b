"""Why was a train slow? One question, answered in words, as a table and as a figure."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from kankaku.analysis.asked_results import NotInResultsError, ResultsError, known_name, train_of
from kankaku.analysis.results import Results
from kankaku.analysis.tables.causes import Seen
from kankaku.analysis.tables.delay_tree import DelayTree, delay_tree
from kankaku.analysis.tables.explained import Explained, explained, explanations_frame
from kankaku.analysis.tables.run_tables import DWELLING, RunTables
from kankaku.analysis.texts.explanation_texts import explanation_text
from kankaku.analysis.words import DAY_S, clock, time_of_day_s

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTE_S = 60.0
LARGEST_S = 10.0 * DAY_S
"""Nobody asks for a later time; what is larger is a slip. [s]"""


@dataclass(eq=False)
class Explanation:
    """Why a train was slow at a moment, under each controller."""

    found: tuple[Explained, ...]
    """One for each controller, the one that was asked for first."""
    stations: pd.DataFrame
    """The table ``stations``."""
    seen: tuple[Seen, ...] = field(repr=False)
    """The runs, in the same order."""
    trees: tuple[DelayTree, ...] = field(repr=False)
    """Whence their delays come, in the same order."""

    @cached_property
    def texts(self) -> dict[str, str]:
        """A paragraph by controller."""
        names = dict(zip(self.stations["station"], self.stations["name"], strict=True))
        return {one.controller: explanation_text(one, names) for one in self.found}

    @property
    def text(self) -> str:
        """The paragraph about the controller that was asked for."""
        return self.texts[self.found[0].controller]

    @cached_property
    def table(self) -> pd.DataFrame:
        """A row for each controller, columns ``EXPLANATIONS``."""
        return explanations_frame(self.found)

    def figure(self, controller: str | None = None) -> "Figure":
        """
        Draw what happened around the moment.

        Parameters
        ----------
        controller
            Under which controller; the one that was asked for if None.

        Returns
        -------
        Figure
            Time-distance diagram, speed, and what bound it.

        Raises
        ------
        ResultsError
            If the train was not on the line then.
        """
        # Here, because it takes half a second that words do not need.
        from kankaku.analysis.figures.moment_figure import moment_figure  # noqa: PLC0415

        number = 0
        if controller is not None:
            number = [one.controller for one in self.found].index(controller)
        one = self.found[number]
        if one.sample is None:
            told = f"train {one.train} was not on the line at {clock(one.time_s, seconds=True)}"
            where = f"controller {one.controller}"
            raise ResultsError(where, told, "a moment on its way")
        return moment_figure(self.seen[number], one, self.stations)

    def __str__(self) -> str:
        return self.text


class Explainer:
    """Results that are asked more than once; reads each run once."""

    def __init__(
        self, results: Results, controllers: Sequence[str] = (), *, seed: int | None = None
    ) -> None:
        self._stations = results.stations
        self._runs = _runs(results, controllers, seed)
        self._seen = {run.controller: Seen(run) for run in self._runs}
        self._trees = {name: delay_tree(seen) for name, seen in self._seen.items()}

    def explain(self, train: str, at: str | float, controller: str | None = None) -> Explanation:
        """
        Tell why a train was slow at a moment.

        Parameters
        ----------
        train, at, controller
            As of :func:`explain`.

        Returns
        -------
        Explanation
            As of :func:`explain`.

        Raises
        ------
        ResultsError
            As of :func:`explain`.
        """
        names = list(self._seen)
        if controller is not None:
            names.remove(known_name("controller", controller, names))
            names.insert(0, controller)
        number = train_of(self._runs, train)
        time_s = _moment_s(at, self._runs, number)
        if isinstance(at, str) and at.count(":") == 1:
            time_s = _slowest_s(self._seen[names[0]], number, time_s)
        seen = tuple(self._seen[name] for name in names)
        trees = tuple(self._trees[name] for name in names)
        found = tuple(
            explained(one, tree, number, time_s) for one, tree in zip(seen, trees, strict=True)
        )
        return Explanation(found, self._stations, seen, trees)


def explain(
    results: Results,
    train: str,
    at: str | float,
    controller: str | None = None,
    *,
    seed: int | None = None,
) -> Explanation:
    """
    Tell why a train was slow at a moment: what bound it, who was ahead and why, and what it cost.

    Parameters
    ----------
    results
        What :func:`kankaku.analysis.results.read_results` returned, with trajectories.
    train
        Train number.
    at
        Time of day, ``"07:36:20"``, or seconds after midnight; ``"07:36"`` is when the train was
        slowest in that minute, but for its dwells, as on the page. [s]
    controller
        Whose explanation comes first, and in words; the first of the results if None.
    seed
        Of which seed; the first of the results if None.

    Returns
    -------
    Explanation
        As words (``text``, ``texts``), as a ``table`` of all controllers, and as a ``figure()``.

    Raises
    ------
    ResultsError
        If there is no such train, time, controller or seed, or if the train was on the line then
        under no controller.
    """
    return Explainer(results, seed=seed).explain(train, at, controller)


def _runs(results: Results, controllers: Sequence[str], seed: int | None) -> list[RunTables]:
    """Return a run of each controller, those that are named first."""
    known = list(results.controllers)
    for name in controllers:
        known_name(f"{results.folder}: controller", name, known)
    if seed is not None:
        seeds = list(dict.fromkeys(run.seed for run in results.runs))
        known_name(f"{results.folder}: seed", seed, seeds)
    first: dict[str, RunTables] = {}
    for run in results.runs:
        if seed in {None, run.seed}:
            first.setdefault(run.controller, run)
    names = dict.fromkeys([*controllers, *known])
    runs = [first[name] for name in names if name in first]
    if not any(len(run.trajectory) for run in runs):
        where = str(results.folder)
        raise ResultsError(where, "was read without trajectories", "trajectories=True")
    return runs


def _moment_s(at: str | float, runs: Sequence[RunTables], train: str) -> float:
    time_s = time_of_day_s(at) if isinstance(at, str) else float(at)
    where = "time"
    if time_s is None or not -LARGEST_S < time_s < LARGEST_S:
        raise NotInResultsError(where, f"{str(at)[:40]!r} is no time of day", "07:36 or 07:36:20")
    own = [run.trajectory.loc[run.trajectory["train"] == train, "time_s"] for run in runs]
    times_s = pd.concat(own)
    if times_s.empty or times_s.min() <= time_s <= times_s.max():
        return time_s
    # After midnight the clock of a run goes on.
    if times_s.min() <= time_s + DAY_S <= times_s.max():
        return time_s + DAY_S
    first, last = (clock(float(moment), seconds=True) for moment in (times_s.min(), times_s.max()))
    told = f"train {train} was not on the line at {clock(time_s, seconds=True)}"
    raise NotInResultsError(where, told, f"from {first} to {last}")


def _slowest_s(seen: Seen, train: str, minute_s: float) -> float:
    """Return when a train was slowest in a minute, but for its dwells; its begin if it made one."""
    samples = seen.samples(train)
    inside = (samples["time_s"] >= minute_s) & (samples["time_s"] < minute_s + MINUTE_S)
    under_way = np.flatnonzero(inside & (samples["reason"] != DWELLING))
    if not under_way.size:
        return minute_s
    return float(samples["time_s"][under_way[np.argmin(samples["speed_mps"][under_way])]])
