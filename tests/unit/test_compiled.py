"""Compiled functions are compiled anew when anything that they are made of has changed."""

import subprocess
import sys
from pathlib import Path

PARTS = """
from typing import NamedTuple
from kankaku.railway.compiled import compiled
class {name}(NamedTuple):
    {first}: float
    {second}: float
@compiled
def part(value: float) -> float:
    return {factor} * value
"""
WHOLE = """
import parts
from parts import {name}, part
from kankaku.railway.compiled import compiled
@compiled
def whole(pair: {name}) -> float:
    return part(pair.wanted)
print(whole({name}(1.0, 2.0)))
"""
BOTH = """
import sys
import parts
from parts import part
from kankaku.railway.compiled import compiled, formula
@formula
def twice(value: float) -> float:
    return 2.0 * value
@compiled
def outer(value: float) -> float:
    return twice(part(value)) + twice(value)
def answer(name: str) -> float:
    return {"outer": outer, "twice": twice, "part": part}[name](3.0)
print(sum(answer(name) for name in sys.argv[1:]))
"""


def result(folder: Path) -> float:
    command = [sys.executable, "-c", "import runpy, whole"]
    environment = {
        "PYTHONPATH": f"{folder}:{Path(__file__).parents[2]}",
        # Python takes its own cache for fresh if size and whole second of writing are the same.
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    done = subprocess.run(  # noqa: S603
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


def write(folder: Path, factor: float, name: str, first: str, second: str) -> None:
    whole = folder / "whole.py"
    (folder / "parts.py").write_text(
        PARTS.format(factor=factor, name=name, first=first, second=second), encoding="utf-8"
    )
    text = WHOLE.format(name=name)
    if not whole.exists() or whole.read_text(encoding="utf-8") != text:
        whole.write_text(text, encoding="utf-8")


def test_a_changed_part_a_changed_tuple_and_a_lost_one_are_noticed(tmp_path: Path) -> None:
    write(tmp_path, 10.0, "Pair", "wanted", "other")
    assert result(tmp_path) == 10.0
    assert list(tmp_path.glob("__pycache__/whole.whole*.nbi")), "it was cached"
    assert result(tmp_path) == 10.0
    write(tmp_path, 20.0, "Pair", "wanted", "other")
    assert result(tmp_path) == 20.0
    write(tmp_path, 20.0, "Pair", "other", "wanted")
    assert result(tmp_path) == 40.0
    write(tmp_path, 20.0, "Couple", "other", "wanted")
    assert result(tmp_path) == 40.0


def test_a_function_answers_python_and_other_compiled_ones_in_any_order(tmp_path: Path) -> None:
    write(tmp_path, 10.0, "Pair", "wanted", "other")
    (tmp_path / "both.py").write_text(BOTH, encoding="utf-8")
    # What others call is compiled without what Python needs to call it, and kept beside that.
    for asked, expected in [
        (["outer"], 66.0),
        (["twice", "part"], 36.0),
        (["outer", "twice", "part"], 102.0),
        (["part", "outer"], 96.0),
    ]:
        command = [sys.executable, "both.py", *asked]
        environment = {"PYTHONPATH": f"{tmp_path}:{Path(__file__).parents[2]}"}
        for _ in range(2):
            done = subprocess.run(  # noqa: S603
                command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, done.stderr
            assert float(done.stdout) == expected
        for kept in tmp_path.glob("__pycache__/both.outer*"):
            kept.unlink()
