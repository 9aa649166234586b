"""
What shared draws are worth: ``make variance``.

Runs the same number of runs in every design of seeds, and compares the widths of the intervals
that the study itself tells: of means, and of differences between two controllers, which common
random numbers have made narrow already. Goes on where it was ended.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import f

from kankaku.analysis.tables.across_tables import BOUND, DELAY, ENERGY, STOPS
from kankaku.analysis.tables.compare import CONFIDENCE, student
from kankaku.analysis.tables.delay import technical_run_times_s
from kankaku.analysis.tables.indicators import INDICATOR_OF
from kankaku.controllers import registry
from kankaku.railway.capacity.delay_bound import (
    earliest_arrivals_s,
    least_intervals_s,
    platform_order,
)
from kankaku.railway.plan.design_names import DESIGNS, INDEPENDENT, REPLICATE_SIZES
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.seed_design import SeedDesign
from kankaku.railway.step.engine_ways import WITNESS
from kankaku.studies.ensemble import choose_ensemble
from kankaku.studies.ensemble_findings import Drawing
from kankaku.studies.ensemble_running import run_ensemble
from kankaku.studies.study import foresight_of, world_of
from tools.paper_tables import markdown

PROJECT = Path(__file__).parents[1]
OUT = PROJECT / "out"
CONTROLLERS = ("close_up", "two_stage")
INDICATORS = (STOPS, DELAY, ENERGY)
SEEDS, STEP_S = 60, 0.5
BOUND_SEEDS = 3000
"""Seeds of the delay that no control avoids. [-]"""


def main() -> None:
    """Run what is missing, print the tables, and write ``out/variance.md``."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--scenario", default=str(PROJECT / "scenarios" / "rush_hour"))
    asked.add_argument("--seeds", type=int, default=SEEDS)
    asked.add_argument("--jobs", type=int, default=2)
    asked.add_argument("--out", type=Path, default=OUT / "variance")
    options = asked.parse_args()
    choices = {
        "names": CONTROLLERS,
        "seeds": options.seeds,
        "step_s": STEP_S,
        "jobs": options.jobs,
    }
    tables = {}
    for design in DESIGNS:
        ensemble = choose_ensemble([options.scenario], choices, engine=WITNESS, draws=design)
        result = run_ensemble(
            ensemble,
            options.out / design,
            Drawing(formats=()),
            tell=_tell,
        )
        if result.findings is None or result.findings.missing or result.failed:
            msg = f"{design}: not every run is finished {result.failed}"
            raise RuntimeError(msg)
        tables[design] = result.findings.table
    scenario = ensemble.studies[0].scenario
    bounds = {design: bound_spread(scenario, SeedDesign(design)) for design in DESIGNS}
    text = "\n\n".join((widths_text(tables), savings_text(tables, options.seeds, bounds)))
    (OUT / "variance.md").write_text(text + "\n", "utf-8")
    sys.stdout.write(text + "\n")


def _tell(ended: str, done: int, most: int) -> None:
    sys.stderr.write(f"{ended}, {done} of {most}\n")


def _asked(
    tables: Mapping[str, pd.DataFrame],
) -> list[tuple[str, str, dict[str, tuple[float, float]]]]:
    """Return what is estimated: indicator, whose mean, and by design that with its half width."""
    found = []
    for indicator in INDICATORS:
        told = INDICATOR_OF[indicator]
        asked = [(f"`{name}`", name, "mean", "mean_confidence_95") for name in CONTROLLERS]
        asked.append(("difference", CONTROLLERS[1], "difference", "confidence_95"))
        for whose, controller, mean, half in asked:
            cells = {}
            for design, table in tables.items():
                chosen = (table["indicator"] == indicator) & (table["controller"] == controller)
                ends = table.loc[chosen, [mean, half]].to_numpy(dtype=np.float64)[0]
                cells[design] = float(ends[0]), float(ends[1])
            found.append((f"{told.label} [{told.column.unit}]", whose, cells))
    return found


def widths_text(tables: Mapping[str, pd.DataFrame]) -> str:
    """
    Return the intervals at equal cost.

    Parameters
    ----------
    tables
        The table ``study`` of each design, of equally many runs.

    Returns
    -------
    str
        A Markdown table: mean and half width, in brackets that over the one of independent seeds.
    """
    rows = []
    for indicator, whose, cells in _asked(tables):
        reference = cells[INDEPENDENT][1]
        texts = []
        for design, (mean, half) in cells.items():
            ratio = "" if design == INDEPENDENT else f" ({half / reference:.2f})"
            texts.append(f"{_number(mean)} ± {_number(half)}{ratio}")
        rows.append([indicator, whose, *texts])
    return markdown(["mean of", "", *(f"`{design}`" for design in tables)], rows)


def savings_text(
    tables: Mapping[str, pd.DataFrame], seeds: int, bounds: Mapping[str, tuple[float, int]]
) -> str:
    """
    Return how many runs a design needs for what independent seeds need a hundred for.

    That is the ratio of the variances of the two means, without Student's factor, which is large
    only of few replicates. Its interval is that of a ratio of variances of normal values.

    Parameters
    ----------
    tables
        The table ``study`` of each design, of equally many runs.
    seeds
        How many of each controller.
    bounds
        As of :func:`bound_spread`, for each design.

    Returns
    -------
    str
        A Markdown table.
    """
    designs = [design for design in tables if design != INDEPENDENT]
    label = INDICATOR_OF[BOUND]
    rows = [
        [
            f"{label.label} [{label.column.unit}]",
            f"{BOUND_SEEDS:,} seeds, no trains",
            *(_saving(bounds[design], bounds[INDEPENDENT]) for design in designs),
        ]
    ]
    for indicator, whose, cells in _asked(tables):
        spreads = {}
        for design, (_, half) in cells.items():
            freedom = seeds // REPLICATE_SIZES[design] - 1
            spreads[design] = float(half / student(freedom)) ** 2, freedom
        texts = [_saving(spreads[design], spreads[INDEPENDENT]) for design in designs]
        rows.append([indicator, whose, *texts])
    return markdown(["runs instead of 100", "", *(f"`{design}`" for design in designs)], rows)


def _saving(own: tuple[float, int], other: tuple[float, int]) -> str:
    ratio = own[0] / other[0]
    least, most = variance_ratio(ratio, (own[1], other[1]))
    return f"{100 * ratio:.0f} ({100 * least:.0f} to {100 * most:.0f})"


def bound_spread(scenario: Scenario, design: SeedDesign) -> tuple[float, int]:
    """
    Return how uncertain the mean of the least delay is that any control could reach.

    It follows from the drawn dwells by one recursion, so thousands of seeds cost no more than a few
    runs.

    Parameters
    ----------
    scenario
        Whose trains; under its first controller they keep their booked order.
    design
        How seeds share their draws.

    Returns
    -------
    tuple[float, int]
        Variance of the mean over ``BOUND_SEEDS`` seeds, and its degrees of freedom. [s2], [-]
    """
    world = world_of(scenario, STEP_S)
    built = registry.build(scenario.controllers[0], world, scenario.radio)
    run_times_s = technical_run_times_s(world)[1]
    booked_s = world.booked_arrival_s[:, : run_times_s.shape[1]]
    order = platform_order(world, booked_s)
    interval_s = least_intervals_s(world, order, foresight_of(built))
    delays = replace(scenario.dwell_delays, design=design)
    seeds = np.arange(BOUND_SEEDS)
    means_s = np.empty(BOUND_SEEDS)
    for seed in seeds.tolist():
        drawn_s = delays.draw(scenario.timetable, seed)
        arrival_s = earliest_arrivals_s(world, drawn_s, run_times_s, order, interval_s)
        means_s[seed] = np.nanmean((arrival_s - booked_s)[:, 1:])
    replicates_s = design.replicate_means(means_s, seeds)
    return float(replicates_s.var(ddof=1)) / replicates_s.size, replicates_s.size - 1


def variance_ratio(ratio: float, freedom: Sequence[int]) -> tuple[float, float]:
    """
    Return the 95 % interval of a ratio of two variances.

    Parameters
    ----------
    ratio
        Of the sample variances of normal values. [-]
    freedom
        Degrees of freedom of the first and of the second. [-]

    Returns
    -------
    tuple[float, float]
        Its ends, from Fisher's distribution. [-]
    """
    levels = np.array([0.5 + CONFIDENCE / 2.0, 0.5 - CONFIDENCE / 2.0])
    least, most = ratio / f.ppf(levels, *freedom)
    return float(least), float(most)


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


if __name__ == "__main__":
    main()
