"""
The table of shipped controllers in docs/benchmark.md: ``make benchmark``.

Runs what is missing of the benchmark of all of them, and writes the table from its result file;
``--from FILE`` writes it from a file that there is, of a part of the benchmark, too.
"""

import argparse
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kankaku.commands.benchmark_shown import measure
from kankaku.studies.benchmark_file import read_result
from kankaku.studies.benchmark_score import WEIGHTS
from kankaku.studies.benchmark_suites import SEEDS, SUITES, WORLDS

PROJECT = Path(__file__).parents[1]
OUT = PROJECT / "out" / "benchmark"
PAGE = PROJECT / "docs" / "benchmark.md"
BEGIN, END = "<!-- table: make benchmark -->", "<!-- end of table -->"
SHIPPED = (
    "two_stage",
    "two_stage_plain",
    "approach_point",
    "stochastic_approach",
    "clairvoyant",
    "eco",
    "multi_step_atc",
    "atd",
    "digital_atc",
    "relative_braking",
    "control_map",
    "hold_for_clear_way",
    "headway_regulation",
)
"""Every layer of the program but those of the reference; control_map under its own operation."""


def table_lines(told: Mapping[str, Any]) -> list[str]:
    """
    Return the table of a result file.

    Parameters
    ----------
    told
        What it holds.

    Returns
    -------
    list[str]
        Lines of Markdown, the best score first, those without a score last.
    """
    plan, provenance = told["plan"], told["provenance"]
    lines = [_about(plan, provenance), "", f"| controller | score | 95 % | {' | '.join(WEIGHTS)} |"]
    lines.append("|---|" + "---:|" * (2 + len(WEIGHTS)))

    def order(item: tuple[str, Mapping[str, Any]]) -> float:
        return -(item[1]["score"] or 0.0)

    for name, score in sorted(told["scores"].items(), key=order):
        bound = provenance["controllers"].get(name, {}).get("knows_future")
        shown = f"`{name}`" + (" (bound: knows the future)" if bound else "")
        if score["score"] is None:
            reason = _plain(score["refused"])
            lines.append(f"| {shown} | none: {reason} |" + " |" * (1 + len(WEIGHTS)))
            continue
        between = "" if score["low"] is None else f"{score['low']:.1f} to {score['high']:.1f}"
        parts = [score["parts"].get(part) for part in WEIGHTS]
        told_parts = " | ".join("" if part is None else f"{part:.1f}" for part in parts)
        lines.append(f"| {shown} | {score['score']:.1f} | {between} | {told_parts} |")
    return lines


def _plain(sentences: Sequence[str]) -> str:
    more = f" (and {len(sentences) - 1} more)" if len(sentences) > 1 else ""
    return sentences[0].replace("|", "/") + more


def _about(plan: Mapping[str, Any], provenance: Mapping[str, Any]) -> str:
    kankaku = provenance["versions"]["kankaku"]
    made = f"Kankaku {kankaku}, sources `{provenance['sources_sha256'][:12]}`"
    if plan["whole"]:
        return f"The whole benchmark; {made}."
    return (
        f"**Only part of the benchmark** (suites {', '.join(plan['suites'])}; worlds "
        f"{', '.join(plan['worlds'])}; {len(plan['seeds'])} seeds), to show the form; {made}. "
        "`make benchmark` puts the table of the whole here."
    )


def with_table(page: str, lines: Sequence[str]) -> str:
    """
    Return a page with another table.

    Parameters
    ----------
    page
        Its text, with the marks of the table.
    lines
        The table.

    Returns
    -------
    str
        All else is as it was.
    """
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return "\n".join([f"{before}{BEGIN}", "", *lines, "", f"{END}{after}"])


def main() -> None:
    """Run what is missing, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--from", dest="file", type=Path, help="result file")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes to use")
    asked = parser.parse_args()
    file = asked.file or OUT / "benchmark.json"
    if asked.file is None:
        status = measure(SHIPPED, tuple(SUITES), tuple(WORLDS), len(SEEDS), OUT, asked.jobs)
        sys.stdout.write(f"ended with {status}\n")
    lines = table_lines(read_result(file))
    PAGE.write_text(with_table(PAGE.read_text("utf-8"), lines), "utf-8")


if __name__ == "__main__":
    main()
