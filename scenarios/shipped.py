"""The scenarios that come with the program, by their names."""

import os
from pathlib import Path

from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError, meant

PLACE = Path(__file__).parent


def shipped_scenarios() -> tuple[str, ...]:
    """
    Return the names of the scenarios that come with the program.

    Returns
    -------
    tuple[str, ...]
        In alphabetical order.
    """
    return tuple(sorted(file.parent.name for file in PLACE.glob(f"*/{MAIN_FILE}")))


def folder_of(scenario: str | Path) -> Path:
    """
    Return the folder of a scenario.

    Parameters
    ----------
    scenario
        Its folder, or the name of a shipped one; a folder of that name comes first.

    Returns
    -------
    Path
        A folder with a main file.

    Raises
    ------
    ScenarioError
        If there is neither.
    """
    named = str(scenario)
    for folder in (Path(scenario), PLACE / named):
        if os.path.lexists(folder / MAIN_FILE) and (
            folder == Path(scenario) or named in shipped_scenarios()
        ):
            return folder
    allowed = f"a scenario folder, or {meant(named, shipped_scenarios())}"
    problem = f"no such folder with a {MAIN_FILE}"
    raise ScenarioError((Mistake(named, "", problem, allowed),))
