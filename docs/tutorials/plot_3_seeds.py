"""
A batch of seeds
================

One morning is one draw of luck. Here several mornings are run, and the difference of two
controllers is told with its uncertainty.

Every controller meets the same delays in the same seed. So the *paired* difference counts: seed
by seed, one controller less the other. Its spread is far smaller than that of the mornings
themselves.
"""

import tempfile
from pathlib import Path

import kankaku
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.texts.comparison_texts import comparison_texts

# %%
# Three seeds, to be quick, and a coarse step. Twenty seeds at 0.1 s are ``make seeds``. If the
# program is ended on the way, the next call with the same folder goes on from there.

if __name__ == "__main__":
    study = kankaku.choose(
        "rush_hour", names=["close_up", "two_stage"], seed=1, seeds=3, step_s=0.5, jobs=2
    )
    result = kankaku.run_study(study, Path(tempfile.mkdtemp()))
    print(
        result.summary[["controller", "seed", "interstation_stop_time_s", "mean_arrival_delay_s"]]
    )

# %%
# The mornings differ a lot. The change from one controller to the other stands behind the mean,
# with the half width of its 95 % interval. With three seeds that is wide: take more before you
# say anything.

if __name__ == "__main__":
    indicators = ("interstation_stop_time_s", "interstation_stops", "mean_arrival_delay_s")
    header, rows = comparison_texts(comparison(result.summary, indicators))
    for row in [header, *rows]:
        print(f"{row[0]:32}{row[1]:>12}{row[2]:>30}")
