"""On how many examples a property is tried."""

from collections.abc import Sequence
from typing import TypeVar

from hypothesis import HealthCheck, settings

Case = TypeVar("Case")

SHARE = 5
LEAST = 3
_asked = {"deep": False}


def ask_for_all() -> None:
    """Try all examples from now on, as ``--deep`` says; modules of tests are imported later."""
    _asked["deep"] = True


def all_if_deep(cases: Sequence[Case], some: Sequence[Case]) -> Sequence[Case]:
    """Return all cases if ``--deep`` asks for them, else those that say most."""
    return cases if _asked["deep"] else some


def examples(most: int, *unhealthy: HealthCheck) -> settings:
    """
    Return the settings of a property of whole runs.

    Every property is tried in every run of the tests; a fifth of the examples, and at least three,
    is what a change of the program can wait for.

    Parameters
    ----------
    most
        How many examples ``--deep`` tries.
    unhealthy
        What Hypothesis is not to complain of beside examples that take long.

    Returns
    -------
    settings
        Decorates the test.
    """
    return settings(
        max_examples=most if _asked["deep"] else max(most // SHARE, min(LEAST, most)),
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, *unhealthy],
    )
