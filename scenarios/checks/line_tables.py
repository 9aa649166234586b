"""The files of a line, and what all checks of stretches share."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.mistakes import Mistake
from kankaku.scenarios.reading.row_formats import (
    BaliseRow,
    BlockRow,
    CircuitRow,
    CrossingRow,
    CurveRow,
    DrivenSpeedRow,
    GeometryRow,
    GradientRow,
    LimitRow,
    LinkRow,
    NodeRow,
    PlatformRow,
    RouteRow,
    StationRow,
    StretchRow,
    TrackRow,
    TurnoutRow,
)

TOLERANCE_KM = 1e-7


FAR_KM = 0.5
"""A platform further than this from the chainage of its station is another station's. [km]"""


@dataclass(frozen=True)
class LineTables:
    """The files that describe a line."""

    stations: Table[StationRow]
    tracks: Table[TrackRow]
    platforms: Table[PlatformRow]
    turnouts: Table[TurnoutRow]
    crossings: Table[CrossingRow]
    limits: Table[LimitRow]
    driven_speeds: Table[DrivenSpeedRow]
    gradients: Table[GradientRow]
    curves: Table[CurveRow]
    balises: Table[BaliseRow]
    blocks: Table[BlockRow]
    circuits: Table[CircuitRow]
    geometry: Table[GeometryRow]
    nodes: Table[NodeRow]
    """Present if the line is a network."""
    links: Table[LinkRow]
    """The tracks of a network; ``tracks`` has them, too, each as a section of its own."""
    routes: Table[RouteRow]

    @cached_property
    def sections(self) -> list[list[TrackRow]]:
        """Parallel tracks grouped by section, along the line."""
        groups: dict[str, list[TrackRow]] = {}
        for track in self.tracks:
            groups.setdefault(track.section, []).append(track)
        return sorted(groups.values(), key=lambda tracks: tracks[0].start_km)

    @cached_property
    def platform_at(self) -> dict[tuple[str, str], PlatformRow]:
        """Platforms by station and track."""
        return {(row.station, row.track): row for row in self.platforms}

    @property
    def extent_km(self) -> tuple[float, float] | None:
        """Where the line starts and ends; nothing as long as its tracks have mistakes."""
        if not (self.tracks.complete and self.tracks.rows):
            return None
        starts, ends = zip(*((track.start_km, track.end_km) for track in self.tracks), strict=True)
        return min(starts), max(ends)


def duplicates(
    table: Table[StationRow]
    | Table[TrackRow]
    | Table[CrossingRow]
    | Table[BlockRow]
    | Table[CircuitRow]
    | Table[NodeRow]
    | Table[LinkRow],
) -> list[Mistake]:
    """
    Return a mistake for every identifier that occurs a second time.

    Parameters
    ----------
    table
        The file.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    first: dict[str, int] = {}
    mistakes = []
    for row in table.rows:
        if row.id in first:
            problem = f"{row.id!r} stands in row {first[row.id]} already"
            mistakes.append(
                Mistake(table.file, f"row {row.row}, column id", problem, "every id once")
            )
        first.setdefault(row.id, row.row)
    return mistakes


def same(one_km: float, other_km: float) -> bool:
    """
    Return whether two chainages are the same but for rounding.

    Parameters
    ----------
    one_km, other_km
        The chainages. [km]

    Returns
    -------
    bool
        Whether they are.
    """
    return abs(one_km - other_km) < TOLERANCE_KM


def length_mistakes(table: Table[StretchRow]) -> list[Mistake]:
    """Return mistakes of stretches that do not end after they begin."""
    return [
        table.mistake(
            row, "end_km", f"{row.end_km:g} does not lie after start_km", f"above {row.start_km:g}"
        )
        for row in table
        if row.end_km - row.start_km < TOLERANCE_KM
    ]


def tiling_mistakes(
    table: Table[StretchRow], rows: Iterable[StretchRow], what: str, *, gaps: bool
) -> list[Mistake]:
    """Return mistakes of stretches that should follow each other without gap or overlap."""
    mistakes = []
    for before, after in pairwise(sorted(rows, key=lambda row: (row.start_km, row.row))):
        gap_km = after.start_km - before.end_km
        if gap_km < -TOLERANCE_KM or (gaps and gap_km > TOLERANCE_KM):
            kind = "leaves a gap behind" if gap_km > 0.0 else "overlaps"
            problem = f"{what} at {after.start_km:g} {kind} the one of row {before.row}"
            sign = "" if gaps else "not below "
            mistakes.append(table.mistake(after, "start_km", problem, f"{sign}{before.end_km:g}"))
    return mistakes
