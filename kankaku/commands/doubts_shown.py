"""What the command ``check`` shows: all mistakes, or what is doubtful, and a picture."""

from pathlib import Path

from rich.markup import escape

from kankaku.commands.figure_files import file_of_figure, refuse_ending
from kankaku.commands.screen import answers, complain
from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.drafts.doubts import doubts


def check_scenario(place: Path, figure: Path | None) -> int:
    """
    Tell what is wrong or doubtful in a scenario.

    Parameters
    ----------
    place
        Folder or name of a scenario.
    figure
        Where to draw its line; nowhere if None.

    Returns
    -------
    int
        How the command ends.
    """
    from kankaku.scenarios.loading.load import load  # noqa: PLC0415 - after the command is known
    from kankaku.scenarios.shipped import folder_of  # noqa: PLC0415 - the same

    try:
        if figure is not None:
            refuse_ending(figure)
        scenario = load(folder_of(place))
        found = [*scenario.warnings, *_of_controllers(scenario), *doubts(scenario)]
        drawn = None if figure is None else _drawn(scenario, figure)
    except KankakuError as error:
        complain(f"{place} {error.verdict}", error.sentences)
    except OSError as error:
        complain(f"{place} cannot be checked", [f"{error.filename}: {error.strerror}"])
    services = scenario.timetable.services
    answers.print(
        escape(
            f"{scenario.title}: {len(scenario.line.stations)} stations, {len(services)} trains, "
            f"{len(scenario.controllers)} controllers; no mistakes, {len(found)} doubtful."
        ),
        soft_wrap=True,
    )
    for sentence in found:
        answers.print(f"  {escape(sentence)}", soft_wrap=True)
    if drawn is not None:
        answers.print(f"Written: {escape(str(drawn))}", soft_wrap=True)
    return 0


def _of_controllers(scenario: Scenario) -> list[str]:
    from kankaku.controllers import registry  # noqa: PLC0415 - takes long to import
    from kankaku.studies.headway_doubts import headway_doubts  # noqa: PLC0415 - the same
    from kankaku.studies.study import world_of  # noqa: PLC0415 - the same

    world = world_of(scenario, scenario.step_s)
    specs = [spec for spec in scenario.controllers if spec.by_default]
    told = registry.warnings(specs, world, scenario.radio)
    return [*told, *headway_doubts(scenario)]


def _drawn(scenario: Scenario, figure: Path) -> Path:
    from kankaku.analysis.figures.line_sheet import line_sheet_figure  # noqa: PLC0415 - the same
    from kankaku.analysis.figures.track_plan import track_plan_figure  # noqa: PLC0415 - the same

    draw = track_plan_figure if scenario.line.network else line_sheet_figure
    return file_of_figure(draw(scenario.line), figure)
