"""A run by steps: the same tables, advice that lowers, holds, and clear refusals."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kankaku
from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.controllers.choosing import named
from kankaku.live.line_advice import GENTLE_MPS2, AdviceError, LineAdvice
from kankaku.live.simulation import Simulation, SimulationError
from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.state import Reason, beside
from kankaku.studies.opening import NO_SUMO
from kankaku.studies.study import run_once
from kankaku.testing.example_lines import merge_scenario

CLOSE_UP = ControllerSpec("test", "moving_block", "close_up", {}, {})
HELD = replace(CLOSE_UP, supervision="hold_for_clear_way")
NO_ADVICE: Any = {"ceiling_mps": 1.0}
NO_NUMBER: Any = {"T1": "fast"}
LINE = merge_scenario(4, 70.0, step_s=0.5)


def bytes_of(tables: RunTables) -> dict[str, str]:
    return {name: frame.to_csv() for name, frame in tables.frames.items()}


def whole(scenario: Scenario, spec: ControllerSpec, engine: str = NO_SUMO) -> RunTables:
    return run_tables(run_once(scenario, spec, 1, scenario.step_s, engine=engine))


@pytest.fixture
def simulation() -> Iterator[Simulation]:
    with Simulation(LINE, CLOSE_UP, 1, engine=NO_SUMO) as opened:
        yield opened


@pytest.mark.parametrize("spec", [CLOSE_UP, HELD], ids=["free", "supervised"])
@pytest.mark.parametrize("interval_s", [0.5, 7.3, 60.0])
def test_where_a_run_pauses_changes_nothing(spec: ControllerSpec, interval_s: float) -> None:
    stepped = Simulation(LINE, spec, 1, interval_s=interval_s, engine=NO_SUMO)
    seen = [view.time_s for view in stepped]
    assert bytes_of(stepped.tables()) == bytes_of(whole(LINE, spec))
    gaps_s = np.diff(seen)
    assert gaps_s.min() >= 0.5
    assert gaps_s.max() < interval_s + 0.5


def test_sumo_watches_a_run_by_steps_as_any_other_and_one_at_a_time() -> None:
    scenario = kankaku.load("sakai_case1")
    spec = named(scenario.controllers, "close_up")
    with Simulation(scenario, spec, 1) as first:
        first.reset()
        with pytest.raises(KankakuError, match=r"another simulation.*allowed: to close it first"):
            Simulation(scenario, spec, 1).reset()
        while not first.over:
            first.step()
    second = Simulation(scenario, spec, 1, interval_s=60.0)
    assert len(list(second)) > 1
    assert bytes_of(first.tables()) == bytes_of(second.tables())
    assert bytes_of(first.tables()) == bytes_of(whole(scenario, spec, "witness"))


def test_a_ceiling_is_kept_and_the_table_says_why(simulation: Simulation) -> None:
    simulation.reset()
    while not simulation.over:
        simulation.step(LineAdvice(ceiling_mps={"T2": 8.0}))
    tables = simulation.tables()
    speed = tables.trajectory.groupby("train")["speed_mps"].max()
    assert speed["T2"] == pytest.approx(8.0)
    assert speed["T1"] > 12.0
    slowed = tables.trajectory[tables.trajectory["plan"] == "outside"]
    assert set(slowed["train"]) == {"T2"}
    assert tables.violations.empty


def test_a_target_speed_is_come_down_to_gently() -> None:
    lowest_mps2 = {}
    asks = {
        "ceiling_mps": LineAdvice(ceiling_mps={"T1": 6.0}),
        "target_mps": LineAdvice(target_mps={"T1": 6.0}),
    }
    for part, advice in asks.items():
        stepped = Simulation(LINE, CLOSE_UP, 1, interval_s=1.0, engine=NO_SUMO)
        before, least = stepped.reset(), 0.0
        while not stepped.over:
            fast = before.speed_mps[0] > 12.0 or least < 0.0
            now = stepped.step(advice if fast else None)
            if fast and now.speed_mps[0] >= 6.0 and now.next_call[0] == before.next_call[0]:
                least = min(least, float(now.speed_mps[0] - before.speed_mps[0]))
            before = now
            if least < 0.0 and now.speed_mps[0] <= 6.0:
                break
        lowest_mps2[part] = -least
    assert lowest_mps2["target_mps"] == pytest.approx(GENTLE_MPS2, abs=1e-6)
    assert lowest_mps2["ceiling_mps"] > 2.0 * GENTLE_MPS2


def test_a_hold_extends_the_stop_and_nobody_elses(simulation: Simulation) -> None:
    view = simulation.reset()
    until_s = view.booked_departure_s[0] + 90.0
    while not simulation.over:
        simulation.step(LineAdvice(hold_until_s={"T1": until_s}))
    calls = simulation.tables().calls
    first = calls[(calls["train"] == "T1") & (calls["sequence"] == 0)].iloc[0]
    assert first["departure_s"] >= until_s
    assert first["held_open_s"] == pytest.approx(90.0, abs=1.0)
    assert (calls[calls["train"] != "T1"]["held_open_s"] == 0.0).all()


@pytest.mark.parametrize(
    ("advice", "told"),
    [
        (LineAdvice(ceiling_mps=-1.0), "ceiling_mps: T1: -1; allowed: 0 m/s or more"),
        (LineAdvice(target_mps=np.nan), "target_mps: T1: nan; allowed: 0 m/s or more"),
        (LineAdvice(ceiling_mps={"T9": 1.0}), "'T9' is no train"),
        (
            LineAdvice(ceiling_mps=np.ones(3)),
            r"has shape \(3,\); allowed: one number for each of 4",
        ),
        (LineAdvice(ceiling_mps=NO_NUMBER), "ceiling_mps: T1: 'fast' is no number"),
        (LineAdvice(hold_until_s=np.inf), "hold_until_s: T1: has no end"),
        (LineAdvice(reason=np.ones(4, dtype=np.intp)), "reason: from 1 to 1; allowed: from 0 to 0"),
        (
            LineAdvice(cause=np.array([0, -1, 4, -1])),
            "cause: T3: 4 is no train and no place; allowed: 0 to 3 for the row of a",
        ),
        (LineAdvice(cause=np.full(4, -3)), "-1 for nothing, -2 for a place beside the track"),
        (LineAdvice(cause=np.full(4, -(2**40))), "no train and no place"),
        (NO_ADVICE, "advice: is a dict; allowed: a LineAdvice, or None"),
    ],
)
def test_advice_that_cannot_be_followed_is_refused_and_nothing_happens(
    simulation: Simulation, advice: LineAdvice, told: str
) -> None:
    before = simulation.reset()
    with pytest.raises(AdviceError, match=told):
        simulation.step(advice)
    assert simulation.state is before
    assert simulation.step().time_s > before.time_s


def test_a_place_beside_the_track_may_be_the_cause_and_no_other_one() -> None:
    scenario = kankaku.load("branch")
    places = [turnout.id for turnout in scenario.line.turnouts]
    with Simulation(scenario, interval_s=60.0, engine=NO_SUMO) as stepped:
        before = stepped.reset()
        last = beside(len(places) - 1)
        told = f"-1 for nothing, {last} for a place beside the track"
        with pytest.raises(AdviceError, match=told):
            stepped.step(LineAdvice(cause=np.full(stepped.world.size, last - 1)))
        assert stepped.state is before
        for _ in range(10):
            stepped.step(LineAdvice(4.0, cause=np.full(stepped.world.size, last)))
        stepped.end("seen enough")
    trajectory = stepped.tables().trajectory
    assert set(trajectory[trajectory["plan"] == "outside"]["cause"]) == {places[-1]}


def test_what_a_simulation_cannot_do_now_is_told(simulation: Simulation) -> None:
    with pytest.raises(SimulationError, match="has not begun; allowed: reset"):
        simulation.step()
    with pytest.raises(SimulationError, match="has not begun"):
        _ = simulation.state
    simulation.reset()
    with pytest.raises(SimulationError, match="is not over"):
        simulation.record()
    simulation.end("the peer is silent")
    assert simulation.record().failure == "the peer is silent"
    with pytest.raises(SimulationError, match="is over"):
        simulation.step()


@pytest.mark.parametrize(
    ("choice", "told"),
    [
        ({"interval_s": 0.1}, "interval_s: 0.1; allowed: from 0.5 to 3600"),
        ({"step_s": float("nan")}, "step_s: nan"),
        ({"seed": -1}, "seed: -1"),
        ({"engine": "steam"}, "'steam'"),
        ({"words": ()}, "words: is empty"),
        ({"measures": ("smell",)}, "measures: 'smell'; allowed: stops, energy"),
    ],
)
def test_choices_that_cannot_be_used_are_refused(choice: dict[str, object], told: str) -> None:
    with pytest.raises(KankakuError, match=told):
        Simulation(LINE, CLOSE_UP, **choice)  # type: ignore[arg-type]


def test_nobody_advises_trains_that_sumo_drives_itself() -> None:
    with pytest.raises(SimulationError, match="drives its trains itself"):
        Simulation("rush_hour", "sumo_native_moving")


def test_a_view_tells_of_every_train_and_cannot_be_written_to(simulation: Simulation) -> None:
    view = simulation.reset()
    while not view.present[:2].all():
        view = simulation.step()
    assert view.trains == ("T1", "T2", "T3", "T4")
    ahead, behind = view.train("T1"), view.train(1)
    assert behind.train == "T2"
    assert behind.leader == "T1"
    assert ahead.front_m >= behind.eoa_m
    assert [train.train for train in view] == [
        train for train, there in zip(view.trains, view.present, strict=True) if there
    ]
    with pytest.raises(ValueError, match="read-only"):
        view.front_m[0] = 0.0
    with pytest.raises(KeyError):
        view.train("T9")


def test_the_report_tells_what_protection_cut_off_and_what_was_measured() -> None:
    line = merge_scenario(4, 40.0, step_s=0.5)
    stepped = Simulation(line, CLOSE_UP, 1, engine=NO_SUMO, measures=("stops", "energy"))
    stepped.reset()
    cut_mps, shield_s, stops, energy_j = np.zeros((4, 4))
    while not stepped.over:
        stepped.step(LineAdvice(ceiling_mps=1000.0))
        report = stepped.report
        assert report is not None
        cut_mps = np.maximum(cut_mps, report.cut_mps)
        shield_s, stops = shield_s + report.shield_s, stops + report.stops
        energy_j = energy_j + report.energy_j
    tables, record = stepped.tables(), stepped.record()
    bound = tables.trajectory["reason"].isin(["line_limit", "train_ahead", "obstruction_ahead"])
    told_s = tables.trajectory[bound].groupby("train").size()
    assert shield_s.sum() == pytest.approx(float(told_s.sum()), abs=1.0)
    assert cut_mps.max() > 1.0
    net_j = record.energy.consumed_j - record.energy.recovered_j
    np.testing.assert_allclose(energy_j, net_j, rtol=1e-6)
    assert stops.sum() == record.standstills.row.size
    assert stepped.report is not None
    assert stepped.report.reason[0] == Reason.DWELLING
