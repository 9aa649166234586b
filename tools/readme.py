"""
Write the result tables of ``README.md`` from ``out/``: ``make readme``.

Reads what ``make rush-hour`` and ``make seeds`` left, and replaces the text between the
markers ``<!-- name -->`` and ``<!-- end -->``.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from analysis import comparison, comparison_texts, read_results

PROJECT = Path(__file__).parents[1]
SHOWN = (
    "interstation_stop_time_s",
    "interstation_stops",
    "interstation_crawl_time_s",
    "mean_arrival_delay_s",
    "final_arrival_delay_s",
    "secondary_delay_s",
    "energy_net_kwh",
)


def results_table(folder: Path) -> str:
    """
    Return the comparison of a results folder as a Markdown table.

    Parameters
    ----------
    folder
        Results folder.

    Returns
    -------
    str
        The table.
    """
    summary = read_results(folder, trajectories=False).summary
    header, rows = comparison_texts(comparison(summary, SHOWN))
    return _markdown(header, rows)


def _markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    rule = ["---", *("---:" for _ in header[1:])]
    return "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows))


def main() -> None:
    """Replace the tables."""
    readme = PROJECT / "README.md"
    text = readme.read_text(encoding="utf-8")
    for name, folder in (("own-seed", "out/rush_hour"), ("seeds", "out/seeds/rush_hour")):
        table = results_table(PROJECT / folder)
        text = re.sub(
            rf"(<!-- {name} -->\n).*?(\n<!-- end -->)",
            lambda found, table=table: f"{found[1]}{table}{found[2]}",
            text,
            flags=re.DOTALL,
        )
    readme.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
