"""
Harmed scenario folders by the thousand: ``make fuzz``.

Shipped and small drawn scenarios are harmed at random, and each is loaded in a process of its own
with a limit on time and memory; a share of those accepted that are small runs on SUMO under one
controller, results included. Whatever ends in a traceback, hangs, answers with more than a screen,
takes too much memory or lets trains meet is a finding. The same seed makes the same folders:
``--only NUMBER`` repeats one of them, and keeps it.
"""

import argparse
import multiprocessing
import resource
import shutil
import sys
import tempfile
import textwrap
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

from kankaku.controllers import registry
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.randomness import stream
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.cell_texts import printable
from kankaku.scenarios.reading.dependability_files import load_configurations, load_fault_tree
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.scenarios.reading.radio_network import load_radio_plan
from kankaku.studies import study
from tools.mutations import mutate
from tools.small_lines import small_line

PROJECT = Path(__file__).parents[1]
SHIPPED = (
    "sakai_case1",
    "atd_headway",
    "eco_driving",
    "control_map",
    "terminal",
    "single_track",
    "loop_line",
)
BESIDE = ("sakai_case1", "rush_hour", "control_map")
"""Folders that shipped scenarios name."""
LOAD_S, RUN_S = 20.0, 240.0
"""Whoever takes longer hangs, also on a busy machine. [s]"""
MOST_MB = 500.0
"""Beyond what a process takes before it loads anything."""
SCREEN = (24, 200)
"""Lines and columns."""
SHOWN_FAULTS = 10
MOST_TRAINS, MOST_LINE_M, MOST_S = 12, 15_000.0, 5400.0
"""A scenario up to this size is run. [-], [m], [s]"""
BAD = ("traceback", "hang", "long answer", "memory", "violation")


class Answer(NamedTuple):
    """What became of a folder."""

    kind: str
    """``accepted``, ``refused``, ``run``, or one of ``BAD``."""
    told: str = ""


@dataclass(frozen=True)
class FuzzPlan:
    """What to make and what to run."""

    seed: int
    runs: float
    """Share of the accepted small ones that run. [-]"""

    def folder(self, number: int, place: Path) -> Path:
        """
        Write a harmed folder.

        Parameters
        ----------
        number
            Which one.
        place
            Where; made anew.

        Returns
        -------
        Path
            The scenario's folder.
        """
        random = stream(self.seed, "fuzz", number)
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        if random.random() < 0.6:
            folder = place / "drawn"
            folder.mkdir()
            for name, text in small_line(random).items():
                (folder / name).write_text(text, encoding="utf-8")
        else:
            folder = place / SHIPPED[int(random.integers(len(SHIPPED)))]
            shutil.copytree(PROJECT / "scenarios" / folder.name, folder)
            for name in BESIDE:
                if name != folder.name:
                    (place / name).symlink_to(PROJECT / "scenarios" / name)
        done = [mutate(folder, random) for _ in range(int(random.integers(1, 4)))]
        (place / "harm.txt").write_text("\n".join(done), encoding="utf-8")
        return folder

    def is_run(self, number: int) -> bool:
        """Return whether a folder is among those that run."""
        return bool(stream(self.seed, "fuzz", "run", number).random() < self.runs)


def examine(plan: FuzzPlan, number: int, place: Path) -> Iterator[Answer]:
    """
    Load a harmed folder and perhaps run it.

    Parameters
    ----------
    plan
        What to make.
    number
        Which folder.
    place
        Where to write it.

    Yields
    ------
    Answer
        Of the loading, then of the run if there is one.
    """
    folder = plan.folder(number, place)
    try:
        scenario = load(folder)
        _load_others(folder, scenario)
        world = study.world_of(scenario, scenario.step_s)
        for spec in scenario.controllers:
            registry.build(spec, world, scenario.radio)
    except ScenarioError as error:
        yield _refusal([str(mistake) for mistake in error.mistakes])
        return
    except registry.ControllerError as error:
        yield _refusal([str(error)])
        return
    except Exception:  # noqa: BLE001 - this is what is looked for
        yield Answer("traceback", traceback.format_exc())
        return
    long = _refusal(list(scenario.warnings)).kind == "long answer"
    yield Answer("long answer" if long else "accepted")
    if plan.is_run(number) and _is_small(scenario):
        yield _run(scenario, place / "out")


def _load_others(folder: Path, scenario: Scenario) -> None:
    if (folder / "radio_network.toml").exists():
        load_radio_plan(folder, scenario.line)
    if (folder / "availability.toml").exists():
        load_configurations(folder)
    load_fault_tree(folder)


def _refusal(sentences: list[str]) -> Answer:
    shown = ["", *(f"  {printable(text)}" for text in sentences[:SHOWN_FAULTS]), ""]
    lines = sum(max(1, len(textwrap.wrap(text, SCREEN[1]))) for text in shown)
    return Answer("refused" if lines <= SCREEN[0] else "long answer", "\n".join(sentences[:3]))


def _is_small(scenario: Scenario) -> bool:
    services, line = scenario.timetable.services, scenario.line
    times_s = [call.departure_s for service in services for call in service.calls]
    return (
        len(services) <= MOST_TRAINS
        and line.end_m - line.start_m <= MOST_LINE_M
        and max(times_s) - min(times_s) + scenario.patience_s <= MOST_S
    )


def _run(scenario: Scenario, out: Path) -> Answer:
    own = [spec for spec in scenario.controllers if spec.peer is None]
    spec = (own or scenario.controllers)[0]
    sweep = scenario.sweep
    if sweep:
        scenario = replace(scenario, sweep=replace(sweep, delays_s=sweep.delays_s[:1]))
    chosen = study.Study(scenario, (spec,), (scenario.seed,), scenario.step_s)
    try:
        result = study.run_study(chosen, out)
    except study.StudyError as error:
        return Answer("refused", str(error))
    except Exception:  # noqa: BLE001 - this is what is looked for
        return Answer("traceback", traceback.format_exc())
    if result.violations:
        return Answer("violation", "\n".join(result.violations[:3]))
    return Answer("run")


def _serve(door: Connection, plan: FuzzPlan, place: Path) -> None:
    """Answer numbers of folders until there are none; runs in a process of its own."""
    study.world_of(load(PROJECT / "scenarios" / "sakai_case1"), 0.5)
    before_mb = _peak_mb()
    door.send(None)
    while (number := door.recv()) is not None:
        for answer in examine(plan, number, place):
            over_mb = _peak_mb() - before_mb
            heavy = answer.kind in {"accepted", "refused"} and over_mb > MOST_MB
            door.send(Answer("memory", f"{over_mb:.0f} MB") if heavy else answer)
            if answer.kind == "run" or heavy:
                # The peak is of the process; what comes next would be accused of it.
                before_mb = max(before_mb, _peak_mb())
        door.send(None)


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


class FuzzExaminer:
    """A process that examines folders, started anew when it hangs or dies."""

    def __init__(self, plan: FuzzPlan, place: Path) -> None:
        self._plan, self._place = plan, place
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._door, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, self._plan, self._place))
        self._process.start()
        other.close()
        if not self._door.poll(RUN_S) or self._door.recv() is not None:
            msg = "the examining process does not start"
            raise RuntimeError(msg)

    def examine(self, number: int) -> list[Answer]:
        """
        Examine a folder.

        Parameters
        ----------
        number
            Which one.

        Returns
        -------
        list[Answer]
            Of the loading, then of the run if there was one.
        """
        answers: list[Answer] = []
        self._door.send(number)
        while True:
            limit_s = RUN_S if answers else LOAD_S
            try:
                if not self._door.poll(limit_s):
                    found = Answer("hang", f"no answer within {limit_s:g} s")
                else:
                    received: Answer | None = self._door.recv()
                    if received is None:
                        return answers
                    answers.append(received)
                    continue
            except EOFError:
                self._process.join()
                found = Answer("traceback", f"the process died: {self._process.exitcode}")
            self.close()
            self._start()
            return [*answers, found]

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self._door.close()


def main() -> None:
    """Examine folders, print the figures, and end with status 1 if there are findings."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=__doc__)
    parser.add_argument("--folders", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=60.0, help="the longest time to take")
    parser.add_argument("--runs", type=float, default=0.05, help="share of small ones that run")
    parser.add_argument("--first", type=int, default=0, help="number of the first folder")
    parser.add_argument("--only", type=int, help="repeat this one, and keep it")
    chosen = parser.parse_args()
    plan = FuzzPlan(chosen.seed, chosen.runs)
    if chosen.only is not None:
        place = Path(tempfile.mkdtemp(prefix="kankaku-fuzz-"))
        for answer in examine(replace(plan, runs=1.0), chosen.only, place):
            sys.stdout.write(f"{answer.kind}\n{answer.told}\n")
        sys.stdout.write(f"{place}: {(place / 'harm.txt').read_text('utf-8')}\n")
        return
    numbers = range(chosen.first, chosen.first + chosen.folders)
    if _tell(plan, numbers, 60.0 * chosen.minutes):
        sys.exit(1)


def _tell(plan: FuzzPlan, numbers: range, most_s: float) -> int:
    """Print findings as they come and figures at the end; return how many findings there are."""
    kinds: Counter[str] = Counter()
    folders, until = 0, time.monotonic() + most_s
    with tempfile.TemporaryDirectory(prefix="kankaku-fuzz-") as place:
        examiner = FuzzExaminer(plan, Path(place) / "folder")
        try:
            for number in numbers:
                if time.monotonic() > until:
                    break
                folders += 1
                for answer in examiner.examine(number):
                    kinds[answer.kind] += 1
                    if answer.kind in BAD:
                        told = printable(" / ".join(answer.told.strip().splitlines()[-3:]))[:300]
                        again = f"--seed {plan.seed} --only {number}"
                        sys.stdout.write(f"{answer.kind} ({again}): {told}\n")
                        sys.stdout.flush()
        finally:
            examiner.close()
    figures = ", ".join(f"{kinds[kind]} {kind}" for kind in ("accepted", "refused", "run", *BAD))
    sys.stdout.write(f"{folders} folders: {figures}\n")
    return sum(kinds[kind] for kind in BAD)


if __name__ == "__main__":
    main()
