"""Nobody is accused on a line where every rule binds: it is kept, and just kept."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.arrays import FloatArray
from kankaku.railway.loop import simulate
from kankaku.railway.safety.monitor import Monitor
from kankaku.railway.step.step_block import StepBlock
from kankaku.studies import study

SCENARIO = Path(__file__).parents[2] / "scenarios" / "binding"
EXACT = 0.005
"""Rules that bind come this near to their limits, whatever their unit."""
ALWAYS = {"grant", "limit", "acceleration", "braking"}
BINDING = {
    "moving": {"authority", "margin"},
    "cbtc": {"authority", "margin", "platform"},
    "by_radio": {"authority", "margin", "validity"},
    "relative": {"authority", "margin"},
    "atc": {"release"},
    "atd": {"authority", "release"},
    "control_map": {"authority", "validity"},
}


class Closest(Monitor):
    """A monitor that keeps how near to its limit every rule has come."""

    nearest: dict[str, float]

    def _bounds_passed(self, block: StepBlock) -> Iterator[tuple[str, FloatArray, float]]:
        for kind, excess, tolerance in super()._bounds_passed(block):
            judged = block.present & np.isfinite(excess)
            most = float(np.max(excess, where=judged, initial=-np.inf))
            Closest.nearest[kind] = max(Closest.nearest.get(kind, -np.inf), most)
            yield kind, excess, tolerance


@pytest.mark.parametrize("name", BINDING)
def test_every_rule_is_kept_and_binds(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = study.choose(SCENARIO, names=(name,))
    monkeypatch.setattr(simulate, "Monitor", Closest)
    monkeypatch.setattr(Closest, "nearest", {}, raising=False)
    record = study.run_once(chosen.scenario, chosen.specs[0], chosen.seeds[0], chosen.step_s)
    assert record.violations == ()
    assert record.completed.all()
    short = {kind: Closest.nearest[kind] for kind in ALWAYS | BINDING[name]}
    assert short == pytest.approx(dict.fromkeys(short, 0.0), abs=EXACT)
