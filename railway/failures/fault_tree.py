"""Fault trees: minimal cut sets, and the probability of a top event."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple, TypeAlias

from kankaku.railway.errors import KankakuError

CutSet: TypeAlias = frozenset[str]
MOST_CUT_SETS = 1_000
"""A tree with more of them, at any gate, is refused before time and memory end. [-]"""
_TOO_MANY = f"more than {MOST_CUT_SETS} minimal cut sets; allowed: a smaller tree"


class FaultTreeError(KankakuError):
    """A fault tree that cannot be worked out."""


class Event(NamedTuple):
    """Something that happens or not, independent of all other events."""

    title: str
    probability: float


class Gate(NamedTuple):
    """Happens if any of its inputs does, or only if all of them do."""

    title: str
    needs_all: bool
    inputs: tuple[str, ...]
    """Names of events or gates."""


@dataclass(frozen=True, slots=True)
class FaultTree:
    """Events, gates without circles, and the gates on top."""

    events: Mapping[str, Event]
    gates: Mapping[str, Gate]
    tops: tuple[str, ...]
    period_s: float = 3600.0
    """All probabilities hold for so long an operation. [s]"""
    digest: str = ""
    """Content hash of the file."""


def minimal_cut_sets(tree: FaultTree, top: str) -> tuple[CutSet, ...]:
    """
    Return the smallest sets of events that bring about a top event.

    Parameters
    ----------
    tree
        The fault tree.
    top
        Name of a gate or an event.

    Returns
    -------
    tuple[CutSet, ...]
        Likeliest first. None contains another one.

    Raises
    ------
    FaultTreeError
        If there are too many of them.

    References
    ----------
    .. [1] Vesely et al., *Fault Tree Handbook*, NUREG-0492, 1981, section VII: substitution from
       below and the law of absorption.
    """

    @cache
    def sets_of(name: str) -> tuple[CutSet, ...]:
        if name in tree.events:
            return (frozenset([name]),)
        gate = tree.gates[name]
        if not gate.needs_all:
            return _absorbed([found for part in gate.inputs for found in sets_of(part)])
        together: tuple[CutSet, ...] = (frozenset(),)
        for part in gate.inputs:
            others = sets_of(part)
            if len(together) * len(others) > MOST_CUT_SETS**2 // 4:
                raise FaultTreeError(_TOO_MANY)
            together = _absorbed([one | other for one in together for other in others])
        return together

    found = sets_of(top)
    return tuple(sorted(found, key=lambda it: (-joint_probability(tree, it), sorted(it))))


def _absorbed(sets: list[CutSet]) -> tuple[CutSet, ...]:
    """Leave out every set that contains another one."""
    kept: list[CutSet] = []
    for candidate in sorted(set(sets), key=lambda it: (len(it), sorted(it))):
        if not any(smaller <= candidate for smaller in kept):
            kept.append(candidate)
        if len(kept) > MOST_CUT_SETS:
            raise FaultTreeError(_TOO_MANY)
    return tuple(kept)


def joint_probability(tree: FaultTree, events: CutSet) -> float:
    """
    Return the probability that some events happen together.

    Parameters
    ----------
    tree
        The fault tree.
    events
        Names of events.

    Returns
    -------
    float
        Product of their probabilities. [-]
    """
    product = 1.0
    for name in sorted(events):
        product *= tree.events[name].probability
    return product


def top_probability(tree: FaultTree, top: str) -> float:
    """
    Return the probability of a top event.

    Parameters
    ----------
    tree
        The fault tree.
    top
        Name of a gate or an event.

    Returns
    -------
    float
        Exact for independent events, also where cut sets share them. [-]

    References
    ----------
    .. [1] Shannon expansion ``P = p P(event happens) + (1 - p) P(it does not)``, as by a binary
       decision diagram: Rauzy, *New algorithms for fault trees analysis*, 1993.
    """

    @cache
    def probability(sets: frozenset[CutSet]) -> float:
        if not sets:
            return 0.0
        if frozenset() in sets:
            return 1.0
        # Cut sets without a common event are independent; what is shared must be told apart.
        counts: dict[str, int] = {}
        for found in sets:
            for name in found:
                counts[name] = counts.get(name, 0) + 1
        pivot = min(counts, key=lambda name: (-counts[name], name))
        if counts[pivot] == 1:
            either = 0.0
            for found in sorted(sets, key=sorted):
                either += (1.0 - either) * joint_probability(tree, found)
            return either
        chance = tree.events[pivot].probability
        without = frozenset(found for found in sets if pivot not in found)
        given = frozenset(_absorbed([found - {pivot} for found in sets]))
        return chance * probability(given) + (1.0 - chance) * probability(without)

    return probability(frozenset(minimal_cut_sets(tree, top)))
