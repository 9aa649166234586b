"""
A controller in another language
================================

A program in Perl slows trains down in a run, over a socket of this machine. What do the two say to
each other, and is it the same run as with that controller in Python?

It needs ``perl`` with its own module ``JSON::PP``; Debian's package ``perl`` has it.
"""

import json
import socket
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import numpy as np

import kankaku
from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.results import stations_frame
from kankaku.analysis.tables.run_tables import read_run, write_run

PERL = Path(sys.argv[0]).resolve().parents[1] / "examples/other_language/slow_when_near.pl"
out = Path(tempfile.mkdtemp())

# %%
# The controller
# --------------
#
# A train that comes near the end of its authority keeps to 12.5 m/s. The rest is reading and
# writing lines of JSON.
#
# .. literalinclude:: ../examples/other_language/slow_when_near.pl
#    :language: perl
#
# Start both
# ----------
#
# ``kankaku serve`` waits for one peer, and says where.

SERVE = "serve control_map --controller moving_block+close_up --step 0.5 --engine none"
serving = subprocess.Popen(
    [sys.executable, "-m", "kankaku", *SERVE.split(), "--timeout", "60", "--out", out / "perl"],
    stdout=subprocess.PIPE,
    text=True,
)
told = serving.stdout.readline()
print(told)
port = int(told.rsplit(":", 1)[1])

# %%
# In a terminal, ``perl slow_when_near.pl`` with that number would be all. Here a listener sits in
# between. The peer says who it is, and so does Kankaku; then Kankaku asks and the peer answers
# until the run is over.

said = []


def pass_on(speaker, listener, name):
    """Take a line from one, write it down, and give it to the other."""
    line = speaker.readline()
    said.append((name, json.loads(line)))
    listener.write(line)
    listener.flush()


with socket.create_server(("127.0.0.1", 0)) as door:
    door.settimeout(60.0)
    answering = subprocess.Popen(["perl", PERL, str(door.getsockname()[1])])
    perl = door.accept()[0].makefile("rwb")
    line = socket.create_connection(("127.0.0.1", port)).makefile("rwb")
    pass_on(perl, line, "Perl")
    pass_on(line, perl, "Kankaku")
    pass_on(line, perl, "Kankaku")
    while "over" not in said[-1][1]:
        pass_on(perl, line, "Perl")
        pass_on(line, perl, "Kankaku")

print(serving.stdout.read())
print(f"Perl ended with {answering.wait()}, Kankaku with {serving.wait()}")

# %%
# What they said
# --------------
#
# The first lines. Every list has a place for each train, of which two are shown.


def show(name, message):
    """Print a message with the first two values of every list."""
    cut = {
        key: [*value[:2], "..."] if isinstance(value, list) else value
        for key, value in message.items()
    }
    print(textwrap.fill(f"{name}: {json.dumps(cut)}", 96, subsequent_indent="    "))


for name, message in said[:4]:
    show(name, message)

# %%
# The first answer that asks for something, with the question before it, and the end.

asks = next(n for n, (_, message) in enumerate(said) if any(message.get("ceiling_mps", ())))
for name, message in [*said[asks - 1 : asks + 1], said[-1]]:
    show(name, message)

# %%
# The same in Python
# ------------------
#
# Four lines, in the process of the simulation. Both runs write their tables.

with kankaku.Simulation(
    "control_map", "moving_block+close_up", step_s=0.5, engine="none"
) as simulation:
    for view in simulation:
        near = view.running & (view.eoa_m - view.front_m < 600.0)
        simulation.step(kankaku.LineAdvice(ceiling_mps=np.where(near, 12.5, np.inf)))
    write_run(simulation.tables(), out / "python")

for file in sorted((out / "python").iterdir()):
    own, other = file.read_bytes(), (out / "perl" / file.name).read_bytes()
    print(f"{file.name:24}{len(own):9} bytes  {'the same' if own == other else 'NOT THE SAME'}")

# %%
# Not a byte differs: numbers come through JSON as they are.
#
# Look
# ----
#
# A work zone and points that fail are in the way. Slowing down makes stops shorter. It also slows
# trains that would have found the way free in time, and makes them late.

stations = stations_frame(kankaku.load("control_map").line)
runs = [
    kankaku.run_once("control_map", "close_up", step_s=0.5),
    read_run(out / "perl", "in_Perl", simulation.seed),
]
figure = time_distance_figure(runs, stations, title="A work zone, then points that fail")

# %%
# What to change next
# -------------------
#
# - ``600`` or ``12.5`` in the Perl program: which stops go, and what do they cost?
# - Another field: ``delay_s`` and ``leader`` are told with every question.
# - Your own language: it needs a socket and JSON. The protocol is in the guide, under
#   "Taking part in a run".
