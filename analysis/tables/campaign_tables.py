"""The tables of a campaign of failures: every run, and what became of each kind of failure."""

from collections.abc import Iterable, Mapping

import pandas as pd

from kankaku.analysis.tables.columns import rows_frame
from kankaku.railway.step.records import Column

FAULT_RUNS = (
    Column("run", "int64", "", "number of the run"),
    Column("seed", "int64", "", "seed of dwell delays and radio"),
    Column("kind", "str", "", "failure mode"),
    Column("variant", "str", "", "what went wrong"),
    Column("unit", "str", "", "train, turnout, level crossing or centre"),
    Column("onset_s", "float64", "s", "when it began, seconds after midnight"),
    Column("duration_s", "float64", "s", "how long it lasted"),
    Column("size", "float64", "m, m/s, s or -", "how great it was; 0 if it has no size"),
    Column("detection", "str", "", "what found it; empty if nothing did"),
    Column("detected_after_s", "float64", "s", "from onset to detection; empty if never"),
    Column("reaction", "str", "", "what was done about it"),
    Column("trains_braked", "int64", "", "trains that braked in emergency; not so without it"),
    Column("trains_stopped", "int64", "", "trains stopped between stations; not so without it"),
    Column("delay_caused_s", "float64", "s", "mean arrival delay beyond that without it"),
    Column("unsafe_events", "int64", "", "violations of safety invariants, collisions included"),
    Column("first_event", "str", "", "the first of them in a sentence"),
)
FAULT_TABLE = (
    Column("kind", "str", "", "failure mode"),
    Column("variant", "str", "", "what went wrong"),
    Column("runs", "int64", "", "number of runs"),
    Column("detection", "str", "", "what found it, most frequent first"),
    Column("detected_percent", "float64", "%", "share of the runs in which anything did"),
    Column("detected_after_s", "float64", "s", "from onset to detection; median of those"),
    Column("reaction", "str", "", "what was done about it, most frequent first"),
    Column("trains_braked", "float64", "", "trains that braked in emergency, per run"),
    Column("trains_stopped", "float64", "", "trains stopped between stations, per run"),
    Column("delay_caused_s", "float64", "s", "mean arrival delay caused, mean of the runs"),
    Column("greatest_delay_caused_s", "float64", "s", "the same, greatest of the runs"),
    Column("unsafe_events", "int64", "", "violations and collisions in all runs"),
)
FAULT_TABLES: Mapping[str, tuple[Column, ...]] = {
    "fault_runs": FAULT_RUNS,
    "fault_table": FAULT_TABLE,
}


def fault_table(runs: pd.DataFrame) -> pd.DataFrame:
    """
    Return what became of each kind of failure.

    Parameters
    ----------
    runs
        The table ``fault_runs``.

    Returns
    -------
    pd.DataFrame
        Columns ``FAULT_TABLE``, in order of kinds and variants.
    """
    rows = []
    for (kind, variant), group in runs.groupby(["kind", "variant"], sort=True):
        found = group["detection"] != ""
        delay_s = group["delay_caused_s"]
        rows.append(
            {
                "kind": kind,
                "variant": variant,
                "runs": len(group),
                "detection": _by_frequency(group.loc[found, "detection"]),
                "detected_percent": 100.0 * float(found.mean()),
                "detected_after_s": group.loc[found, "detected_after_s"].median(),
                "reaction": _by_frequency(
                    part for told in group["reaction"] for part in told.split(", ")
                ),
                "trains_braked": group["trains_braked"].mean(),
                "trains_stopped": group["trains_stopped"].mean(),
                "delay_caused_s": delay_s.mean(),
                "greatest_delay_caused_s": delay_s.max(),
                "unsafe_events": group["unsafe_events"].sum(),
            }
        )
    return rows_frame(rows, FAULT_TABLE)


def _by_frequency(told: Iterable[str]) -> str:
    counts = pd.Series(list(told), dtype="str").value_counts(sort=False)
    ordered = sorted(counts.items(), key=lambda item: (-item[1], str(item[0])))
    return ", ".join(str(name) for name, _ in ordered if name != "none") or "none"
