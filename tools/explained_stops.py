"""
Is what ``explain`` says of random stops true? Compared with the raw tables: ``python -m``.

Of every controller of a results folder stops between stations are drawn. Who stands ahead and which
limit there is are read from the trajectory with pyarrow alone; nothing of the program but the
question itself is used for that.
"""

import csv
import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow.compute as pc
import pyarrow.parquet as pq

STOPS = 30
SEED = 723
LEAST_AHEAD_M = 1.0
NEAR_LIMIT_M = 40.0
"""Who stands farther from its end of authority than this stands for a speed ceiling. [m]"""
GIVEN_AWAY = frozenset({"peer"})
"""Reasons that name no cause."""


class RawStop(NamedTuple):
    """A stop between stations as the raw tables have it."""

    controller: str
    train: str
    time_s: float
    front_m: float
    limit_m: float
    reason: str
    ahead: str
    """Next train ahead on the tracks that it takes."""
    ahead_m: float


def raw_stops(folder: Path, stops: int = STOPS, seed: int = SEED) -> Iterator[RawStop]:
    """
    Yield random stops between stations of all controllers, from the raw tables.

    Parameters
    ----------
    folder
        Results folder of one seed.
    stops
        How many to draw. [-]
    seed
        Of the draw.

    Yields
    ------
    RawStop
        As evenly over the controllers that have stops as their number allows.
    """
    draw = random.Random(seed)  # noqa: S311 - a sample, no secret
    of: dict[str, list[dict[str, str]]] = {}
    for file in sorted(folder.glob("*/interstation_stops.csv")):
        with file.open(encoding="utf-8", newline="") as lines:
            rows = list(csv.DictReader(lines))
        draw.shuffle(rows)
        of[file.parent.name] = rows
    chosen: list[tuple[str, dict[str, str]]] = []
    while len(chosen) < stops and any(of.values()):
        for name, rows in of.items():
            if rows:
                chosen.append((name, rows.pop()))
    for name, row in sorted(chosen[:stops], key=lambda one: one[0]):
        yield _raw(folder / name / "trajectory.parquet", name, row)


def _raw(file: Path, controller: str, row: dict[str, str]) -> RawStop:
    table = pq.read_table(
        file, columns=["time_s", "train", "front_m", "limit_m", "track", "reason"]
    )
    # At a whole second, as the samples are, and before the middle: a stop may take one second only.
    time_s = float(math.ceil(float(row["start_s"]) + float(row["duration_s"]) // 2.0))
    if time_s >= float(row["start_s"]) + float(row["duration_s"]):
        time_s = float(math.ceil(float(row["start_s"])))
    now = table.filter(pc.equal(table["time_s"], time_s)).to_pylist()
    (own,) = [sample for sample in now if sample["train"] == row["train"]]
    trip = table.filter(pc.equal(table["train"], row["train"])).to_pylist()
    tracks = {sample["track"] for sample in trip}
    up = trip[-1]["front_m"] > trip[0]["front_m"]
    before: list[tuple[float, str]] = [
        (abs(sample["front_m"] - own["front_m"]), sample["train"])
        for sample in now
        if sample["track"] in tracks and (sample["front_m"] > own["front_m"]) == up
        if sample["train"] != own["train"]
    ]
    ahead_m, ahead = min(before, default=(float("nan"), ""))
    return RawStop(
        controller,
        own["train"],
        time_s,
        own["front_m"],
        own["limit_m"],
        own["reason"],
        ahead,
        ahead_m,
    )


def disagreements(stop: RawStop, row: dict[str, Any], text: str) -> list[str]:
    """
    Return where an explanation and the raw tables disagree.

    Parameters
    ----------
    stop
        The stop by the raw tables.
    row
        Its row of the table of the explanation.
    text
        Its paragraph.

    Returns
    -------
    list[str]
        A sentence each; none if all is true.
    """
    where = f"{stop.controller}, {stop.train} at {stop.time_s:.0f} s"
    wrong = []
    if row["state"] != "between_stations":
        wrong.append(f"{where}: it stood between stations, not {row['state']}")
    if abs(row["front_m"] - stop.front_m) > 0.01 or abs(row["limit_m"] - stop.limit_m) > 0.01:
        wrong.append(f"{where}: another place or limit")
    if row["next_train"] != stop.ahead or abs(row["next_train_m"] - stop.ahead_m) > 0.01:
        wrong.append(f"{where}: {stop.ahead} was next ahead, not {row['next_train']}")
    if row["reason"] != stop.reason:
        wrong.append(f"{where}: bound by {stop.reason}, not {row['reason']}")
    if stop.reason == "obstruction_ahead":
        named = row["cause"]
        if row["cause"] == stop.ahead or not row["cause"]:
            wrong.append(f"{where}: something beside the track, not {row['cause']!r}")
    elif stop.reason in GIVEN_AWAY:
        named = f"train {stop.ahead} was next"
    else:
        named = f"train {stop.ahead}"
        if row["cause"] != stop.ahead:
            wrong.append(f"{where}: {stop.ahead} stands ahead, not {row['cause']}")
    if named not in text:
        wrong.append(f"{where}: the words do not name {stop.ahead}")
    return wrong + [f"{where}: {told}" for told in _wrong_limit(stop, text)]


def _wrong_limit(stop: RawStop, text: str) -> Iterator[str]:
    """Yield what is wrong in words about the end of authority of a train behind another one."""
    if stop.reason != "train_ahead":
        return
    gap_m = abs(stop.limit_m - stop.front_m)
    if gap_m > NEAR_LIMIT_M and "what its protection permits" not in text:
        yield f"its authority ends {gap_m:.0f} m ahead; that does not bind"
    if f"end of its authority at {stop.limit_m:,.0f} m" not in text:
        yield f"the words tell another limit than {stop.limit_m:.0f} m"
    if gap_m >= stop.ahead_m - LEAST_AHEAD_M:
        yield f"its authority does not end before {stop.ahead}"


def compare(folder: Path, stops: int = STOPS, seed: int = SEED) -> tuple[int, list[str]]:
    """
    Ask for explanations of random stops and compare them with the raw tables.

    Parameters
    ----------
    folder, stops, seed
        As of :func:`raw_stops`.

    Returns
    -------
    tuple[int, list[str]]
        How many stops were compared, and every disagreement.
    """
    from kankaku.analysis.explaining import Explainer  # noqa: PLC0415 - asked, not shared
    from kankaku.analysis.results import read_results  # noqa: PLC0415 - the same

    raw = list(raw_stops(folder, stops, seed))
    asked = Explainer(read_results(folder))
    wrong = []
    for stop in raw:
        found = asked.explain(stop.train, stop.time_s, stop.controller)
        row = {str(name): value for name, value in found.table.iloc[0].items()}
        wrong += disagreements(stop, row, found.text)
    return len(raw), wrong


def main(arguments: list[str]) -> int:
    """Compare the results folders that are named; by default the rush hour's."""
    status = 0
    for folder in [Path(name) for name in arguments] or [Path("out/rush_hour")]:
        stops, wrong = compare(folder)
        controllers = len(list(folder.glob("*/interstation_stops.csv")))
        told = f"{folder}: {stops} stops of {controllers} controllers explained"
        print(f"{told}, {len(wrong)} disagreements")  # noqa: T201 - a program's own answer
        for sentence in wrong:
            print(f"  {sentence}")  # noqa: T201 - the same
        status = max(status, int(bool(wrong) or stops == 0))
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
