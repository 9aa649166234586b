"""Whether the trains of a scenario can run at all: asked of physics when its files agree."""

from collections.abc import Mapping

from kankaku.railway.motion.feasibility import Feasibility, Lack, Shortfall
from kankaku.railway.plan.rolling_stock import ForceTable, TrainType
from kankaku.scenarios.reading.mistakes import Mistake


def running_mistakes(
    found: Feasibility, stock_file: str, train_types: Mapping[str, TrainType]
) -> list[Mistake]:
    """
    Return what trains are too weak for.

    Parameters
    ----------
    found
        What physics says.
    stock_file
        Name of the file of the train types.
    train_types
        Train types by identifier.

    Returns
    -------
    list[Mistake]
        At most one for starting and for each brake of a train type, one per leg for climbing.
    """
    return [
        _mistake(shortfall, stock_file, train_types[shortfall.leg.train_type])
        for shortfall in found.shortfalls
    ]


def _mistake(shortfall: Shortfall, stock_file: str, train_type: TrainType) -> Mistake:
    table = isinstance(train_type.traction, ForceTable)
    key = f"traction.{'force_speed' if table else 'starting_force_kn'}"
    if shortfall.lack is Lack.STARTING:
        allowed = f"above {shortfall.needed / 1000.0:.4g}"
    elif shortfall.lack is Lack.CLIMBING:
        allowed = "more force or power"
    else:
        key, allowed = f"{shortfall.lack.value}_kmhps", f"above {3.6 * shortfall.needed:.3g}"
    where = f"train.{shortfall.leg.train_type}.{key}"
    return Mistake(stock_file, where, str(shortfall), f"{allowed}, or gentler gradients")


def running_warnings(found: Feasibility, calls_file: str) -> tuple[str, ...]:
    """
    Return what is booked faster than trains can run.

    Parameters
    ----------
    found
        What physics says.
    calls_file
        Name of the file of the bookings.

    Returns
    -------
    tuple[str, ...]
        A sentence per leg and train type.
    """
    return tuple(f"{calls_file}: {hurry}" for hurry in found.hurries)
