"""
My line
=======

A list of stations, a headway and a train make a scenario that runs. On the command line this is
``kankaku new my_line --stations "..." --headway 120``, and a few questions without options.
"""

import tempfile
from pathlib import Path

import kankaku
from kankaku.analysis.figures.track_plan import track_plan_figure
from kankaku.scenarios.drafts.doubts import doubts
from kankaku.scenarios.drafts.draft import write_files
from kankaku.scenarios.drafts.line_answers import LineAnswers, wish_of
from kankaku.scenarios.drafts.own_line import drafted, own_line
from kankaku.scenarios.loading.load import load
from kankaku.studies.headway_doubts import headway_doubts

# %%
# Say what it is
# --------------
#
# Everything is typed as on the command line. What is wrong, is told all at once.

said = LineAnswers(
    stations="Airport 0, Park 1.1, City 2.3, Hall 3.2, Zoo 4.6",
    headway="120",
    until_time="07:20",
    pattern="full, Park to Hall",
    train="london_2009",
)
line = own_line(wish_of(said, "my line"))
print(
    f"{len(line.booked.trips)} runs by {line.booked.sets} trains, turn-backs {line.booked.turns_s}"
)

# %%
# Tracks, platforms, points, blocks and four controllers are laid for this timetable, and all that
# was not said stands in the notes.

draft = drafted(line)
for assumed in draft.notes.assumed[:4]:
    print(f"{assumed.what}: {assumed.value}")

folder = Path(tempfile.mkdtemp()) / "my_line"
write_files(draft.files(), folder)
scenario = load(folder)
figure = track_plan_figure(scenario.line)

# %%
# Is it plausible?
# ----------------
#
# What ``kankaku check`` tells: trains that are booked closer to each other than a controller lets
# them run, turn-backs with nothing in hand, and so on.

print(*headway_doubts(scenario), *doubts(scenario), sep="\n")

# %%
# Run it
# ------

for name in ("close_up", "atc"):
    run = kankaku.run_once(str(folder), name)
    last = run.calls.groupby("train").tail(1)
    print(
        f"{name:10} mean delay at the end {last.arrival_delay_s.mean():6.1f} s; "
        f"violations {len(run.violations)}"
    )
