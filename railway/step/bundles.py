"""
Steps in bundles: what layers and engines offer so that steps between events need no Python.

Between two events calls, leaders and grants stand still, and a step is a few formulas. A layer that
offers them compiled, for a state and what it remembers, is asked again in Python when something has
happened, or when the time comes that it names. Whoever offers nothing is asked in every step, and
tables are the same to the last bit either way.

The signatures of compiled steps, with plain tuples throughout (see
:func:`kankaku.railway.compiled.plain`)::

    protection(instant, fields, memory, after, told)
    protection_by_radio(instant, air, fields, memory) -> (authority, memory, asks)
    operation(instant, authority, fields, memory, after, told) -> asks
    drive(instant, authority, advice, fields, told)

``instant`` is the time, the fields of :class:`~kankaku.railway.step.state.Whereabouts`, how far the
way of each train is clear, and the fields of :class:`Lasting`;
``authority`` are the first five fields of :class:`~kankaku.railway.step.state.Authority`,
``advice`` those of :class:`~kankaku.railway.step.state.Advice`. Steps make no arrays: they write
what they tell into ``told``, and what they remember into ``after``, which holds something older;
what is told of trains that are not on the line may stay as it is. The drive tells the speeds at the
end of the step and what bounds them. Beside that they write to nothing, but for what the drive
remembers. ``asks`` says that the operation has to be asked in Python in this step; then nothing of
the step counts.

``air`` is what has arrived by radio, which is carried within the bundle: the cycles of reports, of
telegrams and of acknowledgements. A protection that commands by radio makes arrays, whose sizes
change with the trains on the line, and tells the commanded speeds as a sixth field of the
authority. It asks whenever a train brakes in emergency.
"""

from typing import Any, NamedTuple

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain


class Lasting(NamedTuple):
    """What lasts from event to event; see :class:`~kankaku.railway.step.state.LineState`."""

    leader: IntArray
    follows: BoolArray
    granted_to_m: FloatArray
    granted_by: IntArray
    next_call: IntArray
    stop_m: FloatArray
    arrival_s: FloatArray


class LayerSteps(NamedTuple):
    """The compiled step of a layer, and what it works on."""

    function: Any
    """From :func:`~kankaku.railway.compiled.formula`; with the signature that this module names."""
    fields: Plain
    """What stays until the layer is asked in Python."""
    memory: Plain
    """What may change in every step: arrays, which stay as they are."""
    told: Plain
    """Arrays to write to what it tells; with what is told of trains that are not on the line."""
    until_s: float
    """From this time on the layer wants to be asked in Python. [s]"""
    by_radio: bool = False
    """It is the step of a protection that takes and gives commands by radio."""


class Span(NamedTuple):
    """Steps that an engine leaves to whoever commands its trains."""

    time_s: FloatArray
    """When each of them begins, the first one now. [s], shape (n_steps,)"""
    step_s: float
    """Length of each. [s]"""
    until_s: float
    """A step that begins at this time or later is the engine's. [s]"""
    rows: IntArray
    """Trains that take commands. shape (n_running,)"""
    aim_m: FloatArray
    """Their next stops. [m], shape (n_running,)"""
    end_m: FloatArray
    """Where they leave the line; infinite for those that leave at a stop. [m], (n_running,)"""
    halting_mps: float
    """At this speed or less [m/s] ..."""
    near_m: float
    """... and this near to its stop a train is the engine's. [m]"""
    lead_s: float
    """So is one that runs over the end in this time [s] ..."""
    lead_m: float
    """... and this distance. [m]"""


def offered(thing: object, offer: str, *stands_for: str) -> bool:
    """
    Return whether an offer says what a thing does.

    It does not if a class or an instance has its own way of doing it, which the offer of a class
    above knows nothing of, or if it is another thing's that the thing only hands on.

    Parameters
    ----------
    thing
        A layer or an engine.
    offer
        Name of the method that makes the offer.
    stands_for
        Names of the methods that it stands for.

    Returns
    -------
    bool
        Whether it may be used in place of them.
    """
    classes = type(thing).__mro__
    owners = [place for place, one in enumerate(classes) if offer in vars(one)]
    own = getattr(thing, "__dict__", {})
    if not owners or any(name in own for name in stands_for) or not hasattr(thing, offer):
        return False
    above = classes[owners[0] :]
    return all(
        any(name in vars(one) for one in above)
        and not any(name in vars(one) for one in classes[: owners[0]])
        for name in stands_for
    )
