"""Services and their calls."""

from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True, slots=True)
class Call:
    """
    A booked stop of a train.

    Times are seconds after midnight. The first call's arrival is the time at which the
    train stands ready at its origin.
    """

    station: str
    track: str
    stop_m: float
    arrival_s: float
    departure_s: float
    minimum_dwell_s: float
    delay_scale: float = 1.0
    """Factor on the measured dwell delays. [-]"""


@dataclass(frozen=True, slots=True)
class Service:
    """
    One train.

    ``route`` names one track per section, from the section of the first call to the end of
    the line, or to the section of the last call for a train that leaves the line there. In a
    network it names the tracks from the first call on, in the running direction.
    """

    train: str
    origin: str
    train_type: str
    route: tuple[str, ...]
    calls: tuple[Call, ...]
    leaves_at_last_call: bool = False
    """
    It is taken off the line when its last stop is over, to a siding that is not modelled.

    Otherwise it runs on and leaves at the end of the line.
    """
    next_train: str = ""
    """The train that the same stock works next, from where this one ends; empty for none."""
    turn_back_s: float = 0.0
    """Least time from the arrival of the train whose stock it takes over to its departure. [s]"""


@dataclass(frozen=True)
class Timetable:
    """Services in the order in which they leave the line, first train first."""

    services: tuple[Service, ...]

    @cached_property
    def trains(self) -> tuple[str, ...]:
        """Train names, first train first."""
        return tuple(service.train for service in self.services)
