"""What the public face does beyond handing on what the rooms offer."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.controllers import registry
from kankaku.controllers.choosing import named
from kankaku.controllers.layers import (
    Layer,
    Medium,
    OperationFactory,
    ProtectionFactory,
    RadioFactory,
    SupervisionFactory,
)
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.loading import load as loading
from kankaku.scenarios.shipped import folder_of
from kankaku.studies import study
from kankaku.studies.across_study import AcrossResult, choose_across, run_across

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def load(scenario: str | Path) -> Scenario:
    """
    Read a scenario.

    Parameters
    ----------
    scenario
        Its folder, or the name of a shipped one.

    Returns
    -------
    Scenario
        The scenario, in SI units.

    Raises
    ------
    ScenarioError
        With every mistake of every file, or if there is no such scenario.
    """
    return loading.load(folder_of(scenario))


def run_once(
    scenario: str | Path | Scenario,
    controller: str,
    *,
    seed: int | None = None,
    step_s: float | None = None,
) -> RunTables:
    """
    Run one controller in this process, and keep nothing on disk.

    Parameters
    ----------
    scenario
        A scenario, its folder, or the name of a shipped one.
    controller
        One of the scenario's, ``protection+operation`` or ``protection+operation+supervision``.
    seed
        Seed of the dwell delays; the scenario's own if None.
    step_s
        Length of a step; the scenario's own if None. [s]

    Returns
    -------
    RunTables
        Calls, trajectory, stops between stations, energy, violations and more, as frames.

    Raises
    ------
    ScenarioError
        If the files cannot be used.
    ControllerError
        If there is no such controller.
    StudyError
        If a train cannot run as it is booked.
    """
    chosen = scenario if isinstance(scenario, Scenario) else load(scenario)
    return run_tables(
        study.run_once(
            chosen,
            named(chosen.controllers, controller),
            chosen.seed if seed is None else seed,
            chosen.step_s if step_s is None else step_s,
        )
    )


def across(  # noqa: PLR0913 - one argument per choice of the user
    scenarios: Sequence[str | Path],
    out: str | Path = "out",
    *,
    names: Sequence[str] = (),
    settings: Sequence[str] = (),
    seed: int | None = None,
    seeds: int = 1,
    step_s: float | None = None,
    jobs: int = 1,
    fresh: bool = False,
    formats: Sequence[str] = (),
) -> AcrossResult:
    """
    Run the same controllers in several scenarios, and compare them in one table.

    Parameters
    ----------
    scenarios
        Their folders, or names of shipped ones; no two of one name.
    out
        Folder that will hold a results folder for each scenario, and ``across`` for the table.
    names
        Controllers to run, baseline first; those that run by default in every scenario if empty.
    settings
        Other values of their options, ``<controller>.<option>=<value>`` each.
    seed
        First seed; each scenario's own if None.
    seeds
        How many seeds, counting up.
    step_s
        Length of a step; each scenario's own if None. [s]
    jobs
        Processes to use.
    fresh
        Run what is finished in the results folders, too.
    formats
        What figures are written as, ``png`` and ``svg``; both if empty, no figures for ``none``.

    Returns
    -------
    AcrossResult
        The table, and what was found in each scenario. A scenario that failed is named.

    Raises
    ------
    KankakuError
        Before any run, with every reason: files that cannot be used, a controller that a scenario
        has not, a sweep, two scenarios of one name, a folder that holds something else.
    """
    choices = {
        "names": names,
        "settings": settings,
        "seed": seed,
        "seeds": seeds,
        "step_s": step_s,
        "jobs": jobs,
        "fresh": fresh,
        "formats": formats,
    }
    return run_across(choose_across(scenarios, choices), Path(out))


def register_protection(
    name: str,
    build: ProtectionFactory | RadioFactory,
    options: "type[DataclassInstance]",
    summary: str,
    *,
    medium: Medium = Medium.TRACK,
) -> None:
    """
    Offer a protection under a name for as long as the program runs.

    Parameters
    ----------
    name
        As in ``name+close_up``.
    build
        Called with the world and an object of ``options``.
    options
        A frozen dataclass whose fields are numbers, switches or tuples of numbers.
    summary
        What it does, in a line.
    medium
        How its permissions reach the trains.

    Raises
    ------
    PluginError
        If the name is taken.
    """
    registry.PROTECTIONS.register(name, Layer(build, options, summary, medium))


def register_operation(
    name: str, build: OperationFactory, options: "type[DataclassInstance]", summary: str
) -> None:
    """
    Offer an operation under a name for as long as the program runs.

    Parameters
    ----------
    name
        As in ``moving_block+name``.
    build
        Called with the world, an object of ``options``, and what the protection will permit.
    options
        A frozen dataclass whose fields are numbers, switches or tuples of numbers.
    summary
        What it does, in a line.

    Raises
    ------
    PluginError
        If the name is taken.
    """
    registry.OPERATIONS.register(name, Layer(build, options, summary))


def register_supervision(
    name: str, build: SupervisionFactory, options: "type[DataclassInstance]", summary: str
) -> None:
    """
    Offer a supervision under a name for as long as the program runs.

    Parameters
    ----------
    name
        As in ``moving_block+close_up+name``.
    build
        Called with the world and an object of ``options``.
    options
        A frozen dataclass whose fields are numbers, switches or tuples of numbers.
    summary
        What it does, in a line.

    Raises
    ------
    PluginError
        If the name is taken.
    """
    registry.SUPERVISIONS.register(name, Layer(build, options, summary))
