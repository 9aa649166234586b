"""What a run leaves behind, and the declared columns of every raw table."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.obstructions import Obstruction


class Column(NamedTuple):
    """A column of a result table."""

    name: str
    dtype: str
    unit: str
    meaning: str
    clock: bool = False
    """A time of day: files show it as a clock does, too."""


CALLS = (
    Column("train", "str", "", "train number"),
    Column("sequence", "int64", "", "number of the call along the trip, from 0"),
    Column("station", "str", "", "station identifier"),
    Column("track", "str", "", "platform track"),
    Column("stop_m", "float64", "m", "chainage of the stop position"),
    Column(
        "booked_arrival_s", "float64", "s", "booked arrival, seconds after midnight", clock=True
    ),
    Column(
        "booked_departure_s", "float64", "s", "booked departure, seconds after midnight", clock=True
    ),
    Column("arrival_s", "float64", "s", "actual arrival; empty if never reached", clock=True),
    Column(
        "departure_s",
        "float64",
        "s",
        "actual departure (first movement); empty if never",
        clock=True,
    ),
    Column(
        "arrival_delay_s",
        "float64",
        "s",
        "actual minus booked arrival; early is negative; if never reached, at least until the end",
    ),
    Column(
        "departure_delay_s",
        "float64",
        "s",
        "actual minus booked departure; if never, at least until the end of the run",
    ),
    Column("minimum_dwell_s", "float64", "s", "minimum dwell"),
    Column("dwell_delay_s", "float64", "s", "injected dwell beyond the minimum"),
    Column("primary_delay_s", "float64", "s", "injected dwell beyond the booked slack"),
    Column(
        "unhindered_arrival_s",
        "float64",
        "s",
        "arrival were no other train on the line",
        clock=True,
    ),
    Column(
        "arrival_bound_s",
        "float64",
        "s",
        "no control over this protection arrives sooner; order and driving as they were",
        clock=True,
    ),
    Column(
        "secondary_delay_s",
        "float64",
        "s",
        "lateness at arrival beyond the unhindered; if never reached, at least until the end",
    ),
    Column("stop_error_m", "float64", "m", "front minus stop position while standing"),
    Column("held_open_s", "float64", "s", "by how much supervision extended the stop, doors open"),
    Column(
        "held_closed_s",
        "float64",
        "s",
        "how long supervision kept the train at its platform after its stop, doors closed",
    ),
    Column(
        "closed_doors_s",
        "float64",
        "s",
        "how long the train stood at its platform after its stop, whoever kept it; 1 s or more",
    ),
)
TRAJECTORY = (
    Column("time_s", "float64", "s", "seconds after midnight", clock=True),
    Column("train", "str", "", "train number"),
    Column("front_m", "float64", "m", "chainage of the front"),
    Column("speed_mps", "float64", "m/s", "speed"),
    Column("limit_m", "float64", "m", "end of authority, or far ahead"),
    Column("track", "str", "", "track under the front"),
    Column(
        "reason",
        "str",
        "",
        "what bound the speed: traction, line_limit, train_ahead, obstruction_ahead, "
        "station_stop, plan, emergency, peer; dwelling while the stop holds the train; held while "
        "supervision keeps it at its platform, doors closed",
    ),
    Column("plan", "str", "", "the operation's own word for its plan; empty for other reasons"),
    Column(
        "cause",
        "str",
        "",
        "train, points, level crossing or closure ahead for which it is so; empty if nothing is",
    ),
)
INTERSTATION_STOPS = (
    Column("train", "str", "", "train number"),
    Column(
        "start_s",
        "float64",
        "s",
        "when the train came to a stand, seconds after midnight",
        clock=True,
    ),
    Column("duration_s", "float64", "s", "how long it stood"),
    Column("front_m", "float64", "m", "chainage of the front"),
    Column("next_station", "str", "", "station it was running to"),
)
REMAINING_STOPS = (
    *INTERSTATION_STOPS,
    Column("cause", "str", "", "train or place for which it stood when it began; empty for none"),
    Column(
        "cause_state",
        "str",
        "",
        "at_platform, between_stations (at a stand), running, or beside_track",
    ),
    Column("cause_station", "str", "", "where the train in cause stood, or had stopped last"),
    Column("links", "int64", "", "trains between it and the first cause, the latter included"),
    Column("first_cause", "str", "", "where the chain of causes ends; cause itself without links"),
    Column("first_cause_state", "str", "", "of that one, as cause_state"),
    Column("first_cause_station", "str", "", "of that one, as cause_station"),
    Column("overstay_s", "float64", "s", "injected dwell of the first cause there, in all"),
    Column(
        "overstay_beyond_booked_s", "float64", "s", "what of it the booked dwell did not absorb"
    ),
    Column(
        "overstay_began_s",
        "float64",
        "s",
        "from when on the first cause, booked and ready, would have left",
        clock=True,
    ),
    Column("departed_s", "float64", "s", "when the train had left its last stop", clock=True),
    Column(
        "slowed_s",
        "float64",
        "s",
        "when it was first slow on this leg for something ahead",
        clock=True,
    ),
    Column(
        "overstayed_at_departure_s",
        "float64",
        "s",
        "how long the overstay had lasted when the train departed; below 0 it had not begun",
    ),
    Column("overstayed_when_slowed_s", "float64", "s", "the same when it was first slow"),
)
ENERGY = (
    Column("train", "str", "", "train number"),
    Column("distance_m", "float64", "m", "distance run"),
    Column("traction_work_kwh", "float64", "kWh", "work of traction at the wheel"),
    Column("braking_work_kwh", "float64", "kWh", "work of braking at the wheel"),
    Column("resistance_work_kwh", "float64", "kWh", "work against running and curve resistance"),
    Column("potential_energy_kwh", "float64", "kWh", "rise of potential energy"),
    Column("kinetic_energy_kwh", "float64", "kWh", "rise of kinetic energy"),
    Column("balance_error_kwh", "float64", "kWh", "work in minus work out; 0 if nothing is lost"),
    Column("auxiliary_kwh", "float64", "kWh", "auxiliaries while on the line"),
    Column("gross_kwh", "float64", "kWh", "traction work / efficiency + auxiliaries"),
    Column("recovered_kwh", "float64", "kWh", "recovered braking work x efficiency"),
    Column("net_kwh", "float64", "kWh", "gross minus recovered"),
    Column("interstation_crawl_time_s", "float64", "s", "below 10 km/h off platforms, with stops"),
    Column(
        "jerk_mps3", "float64", "m/s3", "change of acceleration, root mean square while running"
    ),
    Column("completed", "bool", "", "left where its service ends"),
)
VIOLATIONS = (
    Column("time_s", "float64", "s", "seconds after midnight", clock=True),
    Column("train", "str", "", "train number"),
    Column(
        "kind",
        "str",
        "",
        "authority, spacing, block, band, fouling, obstruction, points, crossing, stop, limit, "
        "acceleration or collision",
    ),
    Column("excess", "float64", "m, m/s, m/s2 or s", "by how much the bound was passed"),
    Column("message", "str", "", "the same in a sentence"),
)
UNFINISHED = (
    Column("train", "str", "", "train number"),
    Column(
        "cause",
        "str",
        "",
        "stalled, train_ahead, obstruction, dwelling, running, standing or never_entered",
    ),
    Column("by", "str", "", "train, obstruction or station that held it; empty if nothing did"),
    Column("front_m", "float64", "m", "chainage of the front when the run ended"),
    Column("message", "str", "", "the same in a sentence"),
)
OBSTRUCTIONS = (
    Column("obstruction", "str", "", "turnout, level crossing, work zone or equipment"),
    Column("cause", "str", "", "points, obstacle, work or fault"),
    Column("tracks", "str", "", "tracks that it lies across, separated by blanks"),
    Column("start_m", "float64", "m", "chainage that fronts must stop short of"),
    Column("end_m", "float64", "m", "chainage that tails must have passed"),
    Column(
        "requested_s",
        "float64",
        "s",
        "no train is let in any more that can stop short of it",
        clock=True,
    ),
    Column("established_s", "float64", "s", "no train may enter; empty if never", clock=True),
    Column("lifted_s", "float64", "s", "trains may enter again; empty if never", clock=True),
)
RAW_TABLES: Mapping[str, tuple[Column, ...]] = {
    "calls": CALLS,
    "trajectory": TRAJECTORY,
    "interstation_stops": INTERSTATION_STOPS,
    "remaining_stops": REMAINING_STOPS,
    "energy": ENERGY,
    "violations": VIOLATIONS,
    "obstructions": OBSTRUCTIONS,
    "unfinished": UNFINISHED,
}


class Violation(NamedTuple):
    """A safety invariant that did not hold; consecutive steps are one violation."""

    time_s: float
    row: int
    kind: str
    excess: float
    message: str


class Unfinished(NamedTuple):
    """A train that had not finished when the run ended; no violation."""

    row: int
    cause: str
    """stalled, train_ahead, obstruction, dwelling, running, standing or never_entered."""
    by: str
    """The train, obstruction or station that held it; empty where nothing did."""
    front_m: float
    sentence: str


class Trajectory(NamedTuple):
    """Samples of running and dwelling trains, ordered by time; shape (n_samples,)."""

    time_s: FloatArray
    row: IntArray
    front_m: FloatArray
    speed_mps: FloatArray
    eoa_m: FloatArray
    """End of authority. [m]"""
    reason: IntArray
    """A :class:`~kankaku.railway.step.state.Reason`."""
    plan: IntArray
    """Which of ``plans`` it is under ``Reason.PLAN``; ``NO_REASON`` otherwise."""
    cause: IntArray
    """
    Row of a train, one of ``places`` as from :func:`kankaku.railway.step.state.beside`, or
    ``NOTHING``.
    """
    plans: tuple[str, ...] = ()
    """The operation's own words."""
    places: tuple[str, ...] = ()
    """Turnouts, level crossings and closures by column."""


class HoldTimes(NamedTuple):
    """How long supervision held trains at platforms; [s], shape (n_trains, n_calls_max)."""

    open_s: FloatArray
    """By how much it extended each stop, doors open. [s]"""
    closed_s: FloatArray
    """How long a train stayed after its stop was over, doors closed. [s]"""


class Standstills(NamedTuple):
    """Running trains at a stand away from a booked stop; shape (n_standstills,)."""

    row: IntArray
    start_s: FloatArray
    duration_s: FloatArray
    front_m: FloatArray
    next_call: IntArray


class EnergyAccount(NamedTuple):
    """Mechanical and electrical work of each train; [J], shape (n_trains,)."""

    distance_m: FloatArray
    traction_j: FloatArray
    braking_j: FloatArray
    resistance_j: FloatArray
    potential_j: FloatArray
    kinetic_j: FloatArray
    regenerated_j: FloatArray
    """Share of the braking work that the electric brake does, at the wheel. [J]"""
    auxiliary_j: FloatArray
    consumed_j: FloatArray
    """Traction work over efficiency plus auxiliaries. [J]"""
    recovered_j: FloatArray
    """Regenerated work times efficiency. [J]"""


@dataclass(frozen=True, slots=True)
class RunRecord:
    """Everything one run of one controller leaves behind."""

    controller: str
    seed: int
    world: World
    dwell_delay_s: FloatArray
    """Injected delay by train and call. [s], shape (n_trains, n_calls_max)"""
    arrival_s: FloatArray
    """Actual arrival, nan if never. [s], shape (n_trains, n_calls_max)"""
    departure_s: FloatArray
    """Actual departure, nan if never. [s], shape (n_trains, n_calls_max)"""
    stop_error_m: FloatArray
    """Front minus stop position while standing. [m], shape (n_trains, n_calls_max)"""
    trajectory: Trajectory
    standstills: Standstills
    crawl_s: FloatArray
    """Time below 10 km/h outside platforms. [s], shape (n_trains,)"""
    energy: EnergyAccount
    violations: tuple[Violation, ...]
    obstructions: tuple[Obstruction, ...]
    """What was in the way beside the track."""
    completed: BoolArray
    """The train left where its service ends. shape (n_trains,)"""
    train_steps: int
    """Steps in which a train was on the line, summed over trains."""
    failure: str = ""
    """What ended the run after violations, in a sentence; empty if it came to its end."""
    unfinished: tuple[Unfinished, ...] = ()
    """Trains that were still under way, or had not entered, when the run ended."""
    end_s: float = np.nan
    """When the run ended; not a number where nobody knows. [s]"""
    foresight: Foresight | None = None
    """What its protection says beforehand; None where nobody knows, or a peer drives."""
    held: HoldTimes | None = None
    """How long supervision held trains at platforms; None under a controller without."""
