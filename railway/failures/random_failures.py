"""Failures drawn at random for a campaign: the same number is the same failure."""

import numpy as np

from kankaku.railway.failures.unit_failures import (
    CENTRE,
    VARIANTS,
    FailureMode,
    UnitFailure,
    Variant,
)
from kankaku.railway.plan.world import World
from kankaku.railway.randomness import stream

DURATION_S: dict[FailureMode, tuple[float, float]] = {
    FailureMode.POSITION: (1.0, 10.0),
    FailureMode.STATE: (10.0, 120.0),
    FailureMode.CLOCK: (10.0, 90.0),
    FailureMode.SILENCE: (1.0, 60.0),
    FailureMode.MAP: (2.0, 60.0),
    FailureMode.CENTRE_CLOCK: (2.0, 60.0),
    FailureMode.CENTRE_SILENCE: (1.0, 30.0),
}
"""Shortest and longest. [s]"""
WHEEL_S = (20.0, 120.0)
"""Wheels of a wrong diameter turn wrongly for longer. [s]"""
SIZE: dict[Variant, tuple[float, float]] = {
    Variant.SLIDE: (0.2, 8.0),
    Variant.SLIP: (0.2, 8.0),
    Variant.WHEEL: (0.003, 0.05),
    Variant.JUMP: (0.1, 20.0),
    Variant.DRIFT: (0.1, 20.0),
    Variant.BAND: (50.0, 300.0),
    Variant.RUN: (50.0, 300.0),
    Variant.CENTRE_JUMP: (0.1, 20.0),
}
"""Least and greatest, in the unit of the variant; as many small ones as great ones."""
EITHER_WAY = frozenset({Variant.WHEEL, Variant.JUMP, Variant.DRIFT, Variant.CENTRE_JUMP})
"""Their size may be negative."""

OF_EQUIPMENT = frozenset({Variant.STATE, Variant.EQUIPMENT})


def draw_failure(world: World, seed: int, number: int) -> UnitFailure:
    """
    Return the failure of a run.

    Every kind comes as often as any other, and so does every variant of a kind.

    Parameters
    ----------
    world
        Line and timetable; a train has its failure while it is booked to be on its way.
    seed
        Seed of the campaign.
    number
        Number of the run.

    Returns
    -------
    UnitFailure
        One failure of one unit.
    """
    random = stream(seed, "fault", number)
    equipped = bool(world.line.turnouts or world.line.crossings)
    possible = {
        kind: [variant for variant in variants if equipped or variant not in OF_EQUIPMENT]
        for kind, variants in VARIANTS.items()
    }
    kinds = [kind for kind, variants in possible.items() if variants]
    kind = kinds[int(random.integers(len(kinds)))]
    variant = possible[kind][int(random.integers(len(possible[kind])))]
    unit, (first_s, last_s) = _unit(world, variant, random)
    onset_s = float(random.uniform(first_s, last_s))
    shortest_s, longest_s = WHEEL_S if variant is Variant.WHEEL else DURATION_S[kind]
    duration_s = float(random.uniform(shortest_s, longest_s))
    size = 0.0
    if variant in SIZE:
        least, most = SIZE[variant]
        size = float(least * (most / least) ** random.random())
        if variant in EITHER_WAY and random.random() < 0.5:
            size = -size
    return UnitFailure(variant, unit, onset_s, onset_s + duration_s, size)


def _unit(
    world: World, variant: Variant, random: np.random.Generator
) -> tuple[str, tuple[float, float]]:
    """Return a unit, and from when to when it is in use. [s]"""
    services, line = world.timetable.services, world.line
    used_s = [(service.calls[0].departure_s, service.calls[-1].arrival_s) for service in services]
    always_s = min(begin for begin, _ in used_s), max(end for _, end in used_s)
    if variant in {Variant.CENTRE_JUMP, Variant.CENTRE_SILENT}:
        return CENTRE, always_s
    if variant in OF_EQUIPMENT:
        equipment = [item.id for item in line.turnouts] + [item.id for item in line.crossings]
        return equipment[int(random.integers(len(equipment)))], always_s
    row = int(random.integers(world.size))
    return services[row].train, used_s[row]
