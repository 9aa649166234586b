"""What a name of a shipped scenario means, where a command could as well mean something else."""

import os
from pathlib import Path

from kankaku.commands.shared_options import OUT
from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.scenarios.shipped import folder_of, shipped_scenarios


def is_scenario(place: Path, *, only: bool = False) -> bool:
    """
    Return whether a scenario is meant, not results.

    Parameters
    ----------
    place
        A folder, or a name.
    only
        Whether results would make no sense.

    Returns
    -------
    bool
        A shipped one by its name only where there is no folder of that name, and no results.
    """
    if os.path.lexists(place):
        return os.path.lexists(place / MAIN_FILE)
    return str(place) in shipped_scenarios() and (only or not (OUT / place).exists())


def refuse_shipped(folder: Path) -> None:
    """
    Refuse to write into what comes with the program.

    Parameters
    ----------
    folder
        Folder of a scenario that is to be written into.

    Raises
    ------
    ScenarioError
        If it is no folder, but the name of a shipped scenario.
    """
    if not os.path.lexists(folder) and str(folder) in shipped_scenarios():
        problem = "comes with the program, whose own files are not rewritten"
        allowed = f"a copy of {folder_of(folder)}"
        raise ScenarioError((Mistake(str(folder), "", problem, allowed),))
