"""The options of the commands ``study`` and ``merge``."""

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from kankaku.commands.shared_options import ENGINE_HELP, OUT
from kankaku.railway.plan.design_names import DESIGNS

STUDY_OUT = OUT / "study"
Controllers: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--controllers",
        "--controller",
        help="Controllers of the scenarios, by commas, baseline first.",
        show_default="those that run by default in all of them",
    ),
]
StudyOut: TypeAlias = Annotated[Path, typer.Option(help="Results folder of the study.")]
ShardOf: TypeAlias = Annotated[
    str | None,
    typer.Option("--shard", metavar="K/N", help="Run the K-th of N parts of the runs."),
]
Until: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="'INDICATOR ±X %'",
        help="Stop once the mean of each controller is known so precisely (95 %); +- for ±.",
    ),
]
Scheduler: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="tcp://HOST:PORT|local", help="Run on workers of Dask instead of processes."
    ),
]
EngineOrNot: TypeAlias = Annotated[
    str | None,
    typer.Option(
        help=ENGINE_HELP, show_default="witness of several seeds, every_step of a single one"
    ),
]
Draws: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="|".join(DESIGNS), help="How the seeds of a study share their dwell draws."
    ),
]
Trajectories: TypeAlias = Annotated[
    bool, typer.Option("--trajectories", help="Keep the trajectory of each run, too.")
]
Drawn: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        help="Indicator to draw; repeat for several.", show_default="stop time, delay, energy"
    ),
]
Images: TypeAlias = Annotated[
    list[str] | None,
    typer.Option("--figures", help="Format of figures; repeat.", show_default="png and svg"),
]
Whole: TypeAlias = Annotated[
    Path, typer.Argument(metavar="OUT", show_default=False, help="Results folder of the whole.")
]
Parts: TypeAlias = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="PART...",
        show_default=False,
        help="Results folders of parts; none if all were run into OUT.",
    ),
]
