"""What a layout assumes, in words."""

from collections.abc import Mapping

from kankaku.scenarios.drafts.meetings import THROATS, Loops, Throat
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import Sketch
from kankaku.scenarios.drafts.station_sizes import PLATFORM_MARGIN_M, PROOF_S, THROW_S
from kankaku.scenarios.drafts.stays import LEAST_DWELL_S

CROWDED = "room for a train between the points of near stations"
"""What is missing where stations with points lie nearest."""


def note_tracks(
    sketch: Sketch, tracks: Mapping[str, int], platform_m: float, throat: Throat
) -> None:
    """
    Note what tracks, platforms, points and dwells rest on.

    Parameters
    ----------
    sketch
        The line; its notes are told.
    tracks
        How many tracks, by station that has its own. [-]
    platform_m
        Length of platforms. [m]
    throat
        Of all points.
    """
    notes = sketch.notes
    notes.assume(
        "platform tracks",
        ", ".join(f"{name} {count}" for name, count in tracks.items()),
        "the fewest that the booked stays need; two at either end, or one where one suffices",
    )
    notes.assume(
        "platforms",
        f"{platform_m:g} m, the station's chainage in the middle",
        f"the longest train and {PLATFORM_MARGIN_M:g} m",
    )
    notes.assume(
        "points",
        f"{throat.away_m:g} m from the platforms, fouled {throat.fouling_m:g} m to "
        f"either side, {THROW_S:g} s to throw and {PROOF_S:g} s to prove",
        "an ordinary throat" if throat == THROATS[0] else "stations lie near",
    )
    notes.assume(
        "minimum dwell",
        f"two thirds of the station's usual booked dwell, {LEAST_DWELL_S} s or more, but no "
        "more than the shortest booked one",
        "what a train cannot do without is not public",
    )
    if not sketch.single_track:
        side = "left" if sketch.left_hand else "right"
        notes.assume("running side", side, "which side trains keep to; only drawings show it")


def note_crowding(notes: SourceNotes) -> None:
    """
    Note that a train cannot stand between the points of two near stations without fouling any.

    Parameters
    ----------
    notes
        Are told.
    """
    notes.miss(
        CROWDED,
        "under fixed blocks trains that wait there may keep each other from going on for ever",
    )


def note_loops(notes: SourceNotes, loops: Loops, looped: Mapping[str, float]) -> None:
    """
    Note where a single line has loops.

    Parameters
    ----------
    notes
        Are told.
    loops
        What was looked for.
    looped
        Chainage of those that trains do not end at anyway, by identifier. [km]
    """
    told = [
        name if name in loops.stations else f"{name} at km {km:g}" for name, km in looped.items()
    ]
    notes.assume(
        "loops of the single track",
        ", ".join(told) or "none but at the ends of trips",
        "where trains of both directions are booked to meet",
    )
    if loops.sidings:
        notes.assume(
            "stops at loops between stations",
            ", ".join(loops.sidings),
            "trains that are booked to meet there stop, for nobody to get on or off",
        )
    if loops.unplaced:
        notes.miss(
            f"a loop for {loops.unplaced} of the booked meetings",
            "stations lie too near there for points; one train waits at another loop",
        )


def note_later(notes: SourceNotes, later_s: Mapping[str, int], trains: int) -> None:
    """
    Note which trains run later than a source says, because one track carries one at a time.

    Parameters
    ----------
    notes
        Are told.
    later_s
        By train. [s]
    trains
        Of all. [-]
    """
    last = max(later_s, key=lambda trip: later_s[trip])
    notes.assume(
        "times of trains that meet",
        f"{len(later_s)} of {trains} trains run later than the source says, up to "
        f"{later_s[last]} s ({last})",
        "on one track a train waits until the other has come; the one that waits less",
    )
