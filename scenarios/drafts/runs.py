"""Least run times on a line that has no track yet."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import TypeVar

from kankaku.railway.motion.run_curve import fastest_run
from kankaku.railway.plan.line import Gradient, Line, Section, SpeedLimit, Track, TrackCurve
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.checks.check_stock import rolling_stock_mistakes
from kankaku.scenarios.drafts.draft import DraftError
from kankaku.scenarios.drafts.sketch import Sketch
from kankaku.scenarios.loading.load_stock import STOCK_FILE, to_train_types
from kankaku.scenarios.reading.row_formats import StretchRow
from kankaku.scenarios.reading.schema import RollingStockFile, check
from kankaku.scenarios.reading.units import metres

R = TypeVar("R", bound=StretchRow)
BEYOND_M = 2000.0
"""The line goes on level and straight beyond its stations. [m]"""


class Runs:
    """
    Fastest runs between stations, by the same physics that a run of the scenario uses.

    Parameters
    ----------
    sketch
        Stations, train types, limits, gradients and curves; its trips are not read.
    fronts
        Trains stop with their fronts at the stations' chainages, not with their middles.

    Raises
    ------
    DraftError
        If a train type is not one that a scenario could have.
    """

    def __init__(self, sketch: Sketch, *, fronts: bool = False) -> None:
        self._sketch = sketch
        self._fronts = fronts
        self._types = train_types_of(sketch)
        self._lines = {rises: _line_of(sketch, rises=rises) for rises in (True, False)}
        self.between_s = cache(self._between_s)
        """Least run time from a station to another by a train type, stopping at both. [s]"""

    def _between_s(self, start: str, end: str, train_type: str) -> float:
        at_km = self._sketch.at_km
        sign = 1.0 if at_km[end] > at_km[start] else -1.0
        line, train = self._lines[sign > 0], self._types[train_type]
        front_m = 0.0 if self._fronts else train.length_m / 2.0
        ends_m = (sign * metres(at_km[name]) + front_m for name in (start, end))
        return fastest_run(line, train, *ends_m).run_time_s


def train_types_of(sketch: Sketch) -> Mapping[str, TrainType]:
    """
    Return the train types of a sketch.

    Parameters
    ----------
    sketch
        The sketch.

    Returns
    -------
    Mapping[str, TrainType]
        By name, in SI units.

    Raises
    ------
    DraftError
        With the first thing that is wrong with one of them.
    """
    data = {"schema_version": 1, "train": {k: dict(v) for k, v in sketch.train_types.items()}}
    stock, mistakes = check(RollingStockFile, data, STOCK_FILE)
    mistakes += rolling_stock_mistakes(stock, STOCK_FILE) if stock else []
    if stock is None or mistakes:
        raise DraftError(str(mistakes[0]))
    return to_train_types(stock)


def _line_of(sketch: Sketch, *, rises: bool) -> Line:
    """Return the line as trains of one direction meet it: a single track, falling ones mirrored."""
    sign = 1.0 if rises else -1.0

    def met(rows: Sequence[R]) -> list[tuple[float, float, R]]:
        """Return rows with their ends as trains meet them, in that order."""
        ends_km = ((sign * row.start_km, sign * row.end_km, row) for row in rows)
        placed = ((metres(min(a, b)), metres(max(a, b)), row) for a, b, row in ends_km)
        return sorted(placed, key=lambda item: item[0])

    places_m = [sign * metres(stop.chainage_km) for stop in sketch.stops]
    extent_m = min(places_m) - BEYOND_M, max(places_m) + BEYOND_M
    return Line(
        name=sketch.title,
        stations=(),
        sections=(Section(*extent_m, (Track("track", *extent_m),)),),
        platforms=(),
        turnouts=(),
        limits=tuple(
            SpeedLimit(a, b, row.limit_kmh / 3.6, train_type=row.train_type)
            for a, b, row in met(sketch.limits)
        ),
        gradients=tuple(
            Gradient(a, b, sign * row.gradient_permil / 1000.0)
            for a, b, row in met(sketch.gradients)
        ),
        curves=tuple(TrackCurve(a, b, row.radius_m) for a, b, row in met(sketch.curves)),
        balises_m=(),
        blocks=(),
    )
