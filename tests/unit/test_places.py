"""Where nothing can be written, programs keep what they know elsewhere, or say where."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from kankaku.railway import places
from kankaku.studies import study
from tests.unit.scenario_folder import write_scenario

PROJECT = Path(__file__).parents[2]
NOWHERE = "/dev/null/nowhere"
HALF = """
from kankaku.railway.compiled import compiled
@compiled
def half(value: float) -> float:
    return 0.5 * value
"""


def test_the_cache_is_where_the_user_says_or_where_it_can_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("KANKAKU_CACHE", raising=False)
    assert places.cache_folder() == tmp_path / "home" / ".cache" / "kankaku"
    monkeypatch.setenv("HOME", NOWHERE)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    own = places.cache_folder()
    assert own == tmp_path / f"kankaku-cache-{os.getuid()}"
    assert own.stat().st_mode & 0o777 == 0o700
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "chosen"))
    assert places.cache_folder() == tmp_path / "chosen"


def test_a_cache_that_others_could_have_filled_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", NOWHERE)
    monkeypatch.delenv("KANKAKU_CACHE", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    open_to_all = tmp_path / f"kankaku-cache-{os.getuid()}"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    assert places.cache_folder() is None
    open_to_all.rmdir()
    open_to_all.symlink_to(tmp_path)
    assert places.cache_folder() is None


def test_matplotlib_goes_where_it_can_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MPLCONFIGDIR", raising=False)
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "chosen"))
    monkeypatch.setenv("HOME", NOWHERE)
    assert places.plotting_folder() == str(tmp_path / "chosen" / "matplotlib")
    monkeypatch.setenv("MPLCONFIGDIR", "mine")
    assert places.plotting_folder() == "mine"


def test_formulas_compile_where_neither_source_nor_home_can_be_written(tmp_path: Path) -> None:
    # A path through a device stands for a folder without leave: also root cannot write there.
    code = (
        "from numba.core import caching\n"
        "import kankaku.railway.compiled as it\n"
        "own = caching.UserProvidedCacheLocator\n"
        "caching.CacheImpl._locator_classes = [own]\n"
        "import half\n"
        "print(half.half(3.0))\n"
    )
    (tmp_path / "half.py").write_text(HALF, encoding="utf-8")
    environment = {
        **{name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"},
        "KANKAKU_CACHE": str(tmp_path / "cache"),
        "PYTHONPATH": f"{tmp_path}:{PROJECT}",
    }
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout == "1.5\n", done.stderr
    assert list((tmp_path / "cache" / "numba").rglob("*.nbi"))


def test_a_study_without_room_names_the_place_before_any_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = study.choose(write_scenario(tmp_path / "small"))

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(OSError, match="No space left") as caught:
        study.run_study(chosen, tmp_path / "out")
    assert caught.value.filename == f"{tmp_path / 'out' / 'small'} (results)"


def test_a_run_without_room_for_temporary_files_names_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = study.choose(write_scenario(tmp_path / "small"))

    def nowhere() -> str:
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr(tempfile, "gettempdir", nowhere)
    with pytest.raises(OSError, match="TMPDIR"):
        study.run_once(chosen.scenario, chosen.specs[0], 1, chosen.step_s)


@pytest.mark.parametrize(
    ("choices", "told"),
    [
        ({"seed": 2**63 - 1, "seeds": 2}, "--seeds: 2 from seed 9223372036854775807 on"),
        ({"seed": 2**63}, "--seed: 9223372036854775808"),
        ({"seed": -1}, "--seed: -1"),
        ({"seeds": 0}, "--seeds: 0"),
        ({"seeds": 10**12}, "--seeds: 1000000000000"),
        ({"step_s": float("nan")}, "--step: nan"),
        ({"jobs": 0}, "--jobs: 0"),
    ],
)
def test_numbers_beyond_the_edge_are_refused_before_any_run(
    tmp_path: Path, choices: dict[str, float], told: str
) -> None:
    folder = write_scenario(tmp_path / "small")
    with pytest.raises(study.StudyError, match=told) as caught:
        study.choose(folder, **choices)  # type: ignore[arg-type]
    assert "allowed" in str(caught.value)


def test_the_last_seed_of_all_is_a_seed(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    chosen = study.choose(folder, seed=2**63 - 2, seeds=2)
    assert chosen.seeds == (2**63 - 2, 2**63 - 1)
