"""Nobody is accused on a line where every rule binds: it is kept, and just kept."""

from pathlib import Path
from typing import Any

import pytest

from kankaku.railway.loop import stepped_run
from kankaku.railway.safety.monitor import Monitor
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


@pytest.mark.parametrize("name", BINDING)
def test_every_rule_is_kept_and_binds(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = study.choose(SCENARIO, names=(name,))
    monitors: list[Monitor] = []

    def kept(*told: Any, **more: Any) -> Monitor:  # noqa: ANN401 - as a monitor is made
        monitors.append(Monitor(*told, **more))
        return monitors[-1]

    monkeypatch.setattr(stepped_run, "Monitor", kept)
    record = study.run_once(chosen.scenario, chosen.specs[0], chosen.seeds[0], chosen.step_s)
    assert record.violations == ()
    assert record.completed.all()
    (monitor,) = monitors
    nearest = monitor.closest()
    short = {kind: nearest[kind] for kind in ALWAYS | BINDING[name]}
    assert short == pytest.approx(dict.fromkeys(short, 0.0), abs=EXACT)
