"""
Run and read
============

Two controllers drive the same forty trains of a morning through the same delays. What do they do
to stops between stations, and why was one train slow?

A step of 0.5 s is coarse, and quick; results of the project are made with 0.1 s.
"""

import tempfile
from pathlib import Path

import kankaku
from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.texts.comparison_texts import comparison_texts

# %%
# Run
# ---
#
# ``choose`` reads the scenario and says what to run of it; ``run_study`` runs it. Runs are
# processes of their own, so a program that starts them keeps them behind ``if __name__ ==
# "__main__":``.

out = Path(tempfile.mkdtemp())
if __name__ == "__main__":
    study = kankaku.choose("rush_hour", names=["close_up", "two_stage"], step_s=0.5, jobs=2)
    result = kankaku.run_study(study, out)

# %%
# Read
# ----
#
# The results folder holds everything. The first controller is the baseline.

if __name__ == "__main__":
    results = kankaku.read_results(out / "rush_hour")
    header, rows = comparison_texts(comparison(results.summary))
    for row in [header, *rows]:
        print(f"{row[0]:32}{row[1]:>12}{row[2]:>24}")

# %%
# Every table is a pandas frame, and ``results.columns`` says what each column means.

if __name__ == "__main__":
    calls = results.run("close_up").calls
    one = calls[calls.train == "723B"]
    print(one[["station", "arrival_delay_s", "dwell_delay_s", "secondary_delay_s"]].round(1))

# %%
# Why was it slow?
# ----------------
#
# Train 723B was late at Oji, and its own dwell delays do not explain it. The trajectory has a
# reason and a cause in every second. What held it between 07:35 and 07:37?

if __name__ == "__main__":
    seconds = results.run("close_up").trajectory
    minutes = seconds.time_s.between(7 * 3600 + 35 * 60, 7 * 3600 + 37 * 60)
    held = seconds[minutes & (seconds.train == "723B")]
    print(
        held.groupby(["reason", "cause"]).agg(
            seconds=("time_s", "size"), slowest=("speed_mps", "min")
        )
    )

# %%
# It is the train ahead, 745A. That one has no long dwell there either: it owes its delay to
# others.

if __name__ == "__main__":
    ahead = calls[calls.train == "745A"]
    print(ahead[["station", "arrival_delay_s", "dwell_delay_s", "secondary_delay_s"]].round(1))
    earlier = seconds[(seconds.train == "745A") & (seconds.reason == "train_ahead")]
    print(earlier.cause.value_counts())

# %%
# The chain ends at 729A, which overstays twice.

if __name__ == "__main__":
    first = calls[(calls.train == "729A") & (calls.dwell_delay_s > 60.0)]
    print(first[["station", "arrival_delay_s", "dwell_delay_s", "departure_delay_s"]])

# %%
# Look
# ----
#
# Dots are stops between stations; the larger, the longer.

if __name__ == "__main__":
    runs = [results.run(name) for name in results.controllers]
    figure = time_distance_figure(runs, results.stations, title="A morning of forty trains")
    figure.savefig(out / "time_distance.png")
