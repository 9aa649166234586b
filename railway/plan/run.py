"""A run: a world, what goes wrong in it, and for how long it may go on."""

from dataclasses import dataclass

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.disruptions import UNDISTURBED, Disruptions
from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec
from kankaku.railway.plan.world import World


@dataclass(frozen=True, slots=True)
class Run:
    """What happens whoever controls the trains."""

    world: World
    dwell_delay_s: FloatArray
    """What the engine injects, for the record. [s], shape (n_trains, n_calls_max)"""
    seed: int
    """Of those delays, for the record, of what fails at random and of what radio loses."""
    patience_s: float
    """It ends this long after the last booked call, whoever is still under way. [s]"""
    disruptions: Disruptions = UNDISTURBED
    """What goes wrong beside the track."""
    radio: RadioSpec = LOSSLESS
    """What a controller's commands go by if they go by radio."""
