"""
Ask the results
===============

Why was a train slow, who caused the delay, and how do other programs get at the results?

SUMO is only a witness here, which is quicker; a folder of ``kankaku run`` is asked alike.
"""

import tempfile
from pathlib import Path

import kankaku
from kankaku.analysis.exports.railsim_columns import railsim_frame
from kankaku.analysis.figures.drawing import Choice, draw
from kankaku.analysis.figures.style import write_figure
from kankaku.analysis.tables.causes import Seen
from kankaku.analysis.tables.delay_tree import branches, delay_tree, origins

out = Path(tempfile.mkdtemp())
if __name__ == "__main__":
    names = ["close_up", "two_stage"]
    study = kankaku.choose("rush_hour", names=names, step_s=0.5, jobs=2, engine="witness")
    kankaku.run_study(study, out)
    results = kankaku.read_results(out / "rush_hour")

# %%
# Why was it slow?
# ----------------
#
# Train 723B stands in front of Oji. What bound it, since when, who was ahead and why, and what did
# it cost? ``kankaku explain`` says the same.

if __name__ == "__main__":
    found = kankaku.explain(results, "723B", "07:36:50")
    print(found)

# %%
# Under the other controller it did not stand.

if __name__ == "__main__":
    print(found.texts["two_stage"])
    print(found.table[["controller", "state", "speed_kmh", "reason", "stood_s", "lost_s"]])

# %%
# The minutes around it: the train, its chain of causes, its end of authority, and what bound it.

if __name__ == "__main__":
    figure = found.figure()

# %%
# Who delayed whom?
# -----------------
#
# Every second of lateness has an origin, mostly an overstay. These cost others most:

if __name__ == "__main__":
    tree = delay_tree(Seen(results.run("close_up")))
    print(origins(tree).head(3).round(1))

# %%
# The first of them went from train to train:

if __name__ == "__main__":
    worst = origins(tree).iloc[0]
    for branch in branches(tree, worst.origin_train, worst.origin_station):
        print(f"{'  ' * branch.depth}{branch.train}: {branch.lost_s:.0f} s")

# %%
# Figures for a paper
# -------------------
#
# For chosen controllers, trains, stations and times; as PNG, SVG and PDF.

if __name__ == "__main__":
    choice = Choice(stations=["Akabane", "Oji"], window_s=(26_700.0, 28_200.0))
    figure = draw(results, "time_distance", choice, title="赤羽から王子まで")
    print([file.name for file in write_figure(figure, out / "stretch", ("png", "svg", "pdf"))])

# %%
# Other programs
# --------------
#
# ``kankaku export`` writes files; the tables can be had by themselves, too.

if __name__ == "__main__":
    print(railsim_frame(results.run("close_up"), "rush_hour").head(3).to_string(index=False))
