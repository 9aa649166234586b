"""A small share of the harmed folders: the same ones every time, and none of them does harm."""

from pathlib import Path

import pytest

from kankaku.railway.randomness import stream
from kankaku.scenarios.loading.load import load
from tools.fuzz import BAD, Answer, FuzzPlan, examine
from tools.small_lines import small_line

FOLDERS = range(40)


def drawn(folder: Path, number: int) -> Path:
    folder.mkdir(parents=True)
    for name, text in small_line(stream(1, "drawn", number)).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("number", range(5))
def test_a_drawn_line_is_good_before_it_is_harmed(tmp_path: Path, number: int) -> None:
    scenario = load(drawn(tmp_path / "line", number))
    assert scenario.timetable.services
    assert not scenario.warnings


def test_harmed_folders_are_accepted_or_refused_and_nothing_else(tmp_path: Path) -> None:
    plan = FuzzPlan(seed=1, runs=0.0)
    found: dict[int, list[Answer]] = {
        number: list(examine(plan, number, tmp_path / "harmed")) for number in FOLDERS
    }
    kinds = [answer.kind for answers in found.values() for answer in answers]
    assert not set(kinds) & set(BAD), found
    assert {"accepted", "refused"} <= set(kinds)


def test_the_same_seed_makes_the_same_folder(tmp_path: Path) -> None:
    plan = FuzzPlan(seed=1, runs=0.0)
    for number in (0, 1, 2):
        one, two = (plan.folder(number, tmp_path / place) for place in ("one", "two"))
        assert (one.parent / "harm.txt").read_text() == (two.parent / "harm.txt").read_text()
        names = sorted(path.name for path in one.iterdir())
        assert names == sorted(path.name for path in two.iterdir())
