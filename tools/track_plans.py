"""Draw the track plans of the documentation: ``python -m tools.track_plans``."""

from pathlib import Path

import matplotlib as mpl

from kankaku.analysis.figures.style import STYLE
from kankaku.analysis.figures.track_plan import track_plan_figure
from kankaku.scenarios.loading.load import load

ROOT = Path(__file__).parents[1]
PLACE = ROOT / "docs" / "networks"
DRAWN: dict[str, tuple[float, float] | None] = {
    "terminal": None,
    "branch": None,
    "overtaking": None,
    "single_track": None,
    "loop_line": None,
    "whole_line": (-500.0, 14_600.0),
}
"""Scenarios, and what of them is shown. [m]"""


def main() -> None:
    """Write an SVG for every scenario."""
    PLACE.mkdir(exist_ok=True)
    with mpl.rc_context(STYLE | {"svg.fonttype": "path"}):
        for name, window_m in DRAWN.items():
            scenario = load(ROOT / "scenarios" / name)
            figure = track_plan_figure(scenario.line, window_m=window_m)
            figure.savefig(PLACE / f"{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
