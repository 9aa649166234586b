"""The engine runs ahead of SUMO between events; a SUMO that does otherwise is not believed."""

from pathlib import Path

import numpy as np
import pytest

from railway.engine import Engine
from sumo_net.build import build
from sumo_net.engine import EngineDisagreementError, SumoEngine
from tests.worlds import two_station_scenario, world_of

STEPS = 800


def accelerate(engine: Engine) -> None:
    for _ in range(STEPS):
        engine.apply(np.minimum(engine.observe().speed_mps + 0.05, 10.0))
        engine.advance()


def test_a_train_off_its_commands_stops_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = two_station_scenario(1, step_s=0.1)
    world = world_of(scenario)
    with SumoEngine(build(scenario, world, np.zeros((1, 2)), tmp_path), world) as engine:
        accelerate(engine)
        honest = engine._set_speed  # noqa: SLF001
        monkeypatch.setattr(engine, "_set_speed", lambda train, mps: honest(train, 1.01 * mps))
        with pytest.raises(EngineDisagreementError, match="off its commands"):
            accelerate(engine)
