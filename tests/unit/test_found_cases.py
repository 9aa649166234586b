"""Cases that random searches found: who stands, starts, or is beside the way of another train."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.line import Section, Track, Turnout
from kankaku.railway.plan.radio_spec import LOSSLESS, Outage, RadioSpec
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import commuter_train, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.property.runs import READY_S, Observed, controller_of, run
from tests.unit.test_control_map import on_map
from tests.unit.test_over_radio import Written

CONTROLS = ("moving_block", "moving_block by radio", "control_map")


def run_under(
    control: str, scenario: Scenario, radio: RadioSpec = LOSSLESS
) -> tuple[RunRecord, Observed]:
    world = world_of(scenario)
    delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    if control == "control_map":
        return on_map(scenario, radio=radio, delay_s=delay_s)[:2]
    by_radio = radio if control.endswith("by radio") else None
    controller = controller_of(world, radio=by_radio)
    return run(scenario, controller=controller, delay_s=delay_s, radio=by_radio)


def work(track: str, start_m: float, end_m: float, from_s: float, lasts_s: float) -> Disruptions:
    until_s = from_s + lasts_s
    zone = Closure("zone", Cause.WORK, (track,), start_m, end_m, from_s, until_s, until_s)
    return Disruptions((zone,))


@pytest.mark.parametrize("control", CONTROLS)
def test_who_stands_on_another_track_keeps_nobody_out_of_a_work_zone(control: str) -> None:
    """S1 leaves after T1, but stands further on when T1 cannot stop any more."""
    scenario = loop_station_scenario(1)
    through = Service(
        "T1",
        "west",
        "commuter",
        ("in", "north", "out"),
        (
            Call("west", "in", 400.0, READY_S, READY_S + 30.0, 25.0),
            Call("east", "out", 2400.0, READY_S + 120.0, READY_S + 140.0, 15.0),
        ),
    )
    standing = Service(
        "S1",
        "mid",
        "commuter",
        ("south", "out"),
        (
            Call("mid", "south", 1600.0, READY_S, READY_S + 195.0, 25.0),
            Call("east", "out", 2400.0, READY_S + 275.0, READY_S + 305.0, 25.0),
        ),
    )
    from_s = READY_S + 88.0
    record, engine = run_under(
        control,
        replace(
            scenario,
            timetable=replace(scenario.timetable, services=(through, standing)),
            disruptions=work("out", 1870.0, 1950.0, from_s, 100.0),
        ),
    )
    assert record.violations == ()
    assert record.completed.all()
    (zone,) = (item for item in record.obstructions if item.id == "zone")
    tail_m = engine.front_m[:, 0] - 200.0
    left_s = engine.time_s[np.argmax(tail_m >= 1950.0)]
    assert zone.established_s == pytest.approx(left_s, abs=0.1)


@pytest.mark.parametrize("gap_m", [8.0, 12.0, 16.0])
@pytest.mark.parametrize("silence_s", [0.0, 3.0, 4.8])
@pytest.mark.parametrize("early_s", [0.0, 0.5])
def test_a_work_zone_waits_for_a_train_that_is_just_starting(
    gap_m: float, silence_s: float, early_s: float
) -> None:
    from_s = READY_S + 30.0 - early_s
    silence = Outage((), up=False, down=True, from_s=from_s - 0.05, until_s=from_s + silence_s)
    start_m = 300.0 + gap_m
    scenario = replace(
        two_station_scenario(1),
        step_s=0.1,
        disruptions=work("main", start_m, start_m + 100.0, from_s, 100.0),
    )
    radio = replace(LOSSLESS, outages=(silence,) if silence_s else ())
    record, engine = run_under("moving_block by radio", scenario, radio)
    assert record.violations == ()
    assert record.completed.all()
    (zone,) = record.obstructions
    closed = (engine.time_s >= zone.established_s) & (engine.time_s < zone.lifted_s)
    assert engine.front_m[closed, 0].max(initial=0.0) <= start_m + 0.5


@pytest.mark.parametrize("seed", range(3))
def test_relative_braking_by_radio_takes_no_limit_back(seed: int) -> None:
    """A slow train goes before a fast one; its reports are older than what points know of it."""
    scenario = loop_station_scenario(2, 35.0)
    slow = replace(commuter_train(), id="slow", maximum_speed_mps=15.0)
    services = tuple(
        replace(
            service,
            route=("in", "north", "out"),
            train_type=kind,
            calls=(
                Call("west", "in", 400.0, ready_s, ready_s + 30.0, 25.0),
                Call("east", "out", 2400.0, ready_s + 150.0, ready_s + 170.0, 15.0),
            ),
        )
        for service, kind, ready_s in zip(
            scenario.timetable.services,
            ("slow", "commuter"),
            (READY_S, READY_S + 35.0),
            strict=True,
        )
    )
    scenario = replace(
        scenario,
        seed=seed,
        timetable=replace(scenario.timetable, services=services),
        train_types={"slow": slow, **scenario.train_types},
    )
    honest = controller_of(world_of(scenario), protection="relative_braking", radio=LOSSLESS)
    written = Written(honest.protection, row=1)
    controller = replace(honest, protection=written)
    record, _ = run(scenario, controller=controller, delay_s=np.zeros((2, 2)), radio=LOSSLESS)
    assert record.violations == ()
    assert record.completed.all()
    assert np.all(np.diff(written.eoa_m) >= -1e-6)


def second_loop(start_m: float, end_m: float, line_end_m: float, sides: Sequence[str]) -> Scenario:
    """Two trains part and meet twice: T1 by ``north`` at first, T2 by ``south``."""
    scenario = loop_station_scenario(1)
    line = scenario.line
    apart = Track("a", start_m, end_m), Track("b", start_m, end_m)
    out, last = Track("out", 1800.0, start_m), Track("last", end_m, line_end_m)
    ends_m = ("parting", start_m), ("meeting", end_m)
    line = replace(
        line,
        sections=(
            *line.sections[:2],
            Section(1800.0, start_m, (out,)),
            Section(start_m, end_m, apart),
            Section(end_m, line_end_m, (last,)),
        ),
        turnouts=(
            *line.turnouts,
            *(Turnout(name, at_m, at_m - 60.0, at_m + 60.0) for name, at_m in ends_m),
        ),
    )
    services = []
    for index, (first, second) in enumerate(zip(("north", "south"), sides, strict=True)):
        ready_s = READY_S + 90.0 * index
        times_s = ((ready_s, 30.0), (ready_s + 120.0, 30.0), (ready_s + 230.0, 30.0))
        places = (("west", "in", 400.0), ("mid", first, 1600.0), ("east", "out", 2400.0))
        calls = tuple(
            Call(*place, from_s, from_s + stay_s, 25.0)
            for place, (from_s, stay_s) in zip(places, times_s, strict=True)
        )
        route = ("in", first, "out", second, "last")
        services.append(Service(f"T{index + 1}", "west", "commuter", route, calls))
    return replace(
        scenario, line=line, timetable=replace(scenario.timetable, services=tuple(services))
    )


@pytest.mark.parametrize("sides", ["aa", "ab"])
def test_a_train_beside_the_way_is_in_nobodys_way(sides: str) -> None:
    """T2 comes to its own platform while T1 overstays at the other, wherever they go then."""
    delay_s = np.zeros((2, 3))
    delay_s[0, 1] = 300.0
    record, _, _ = on_map(second_loop(2600.0, 3400.0, 4000.0, sides), delay_s=delay_s)
    assert record.violations == ()
    assert record.arrival_s[1, 1] < record.departure_s[0, 1] - 200.0


def test_a_train_beside_the_way_does_not_come_into_it_further_on() -> None:
    """T2's map reaches the next points, which T1 is to pass before it, while T1 is behind it."""
    scenario = second_loop(4700.0, 5500.0, 6500.0, "aa")
    first, second = scenario.timetable.services
    inside = (
        Call("mid", "south", 1600.0, READY_S, READY_S + 80.0, 25.0),
        Call("east", "out", 2400.0, READY_S + 290.0, READY_S + 320.0, 25.0),
    )
    second = replace(second, origin="mid", route=second.route[1:], calls=inside)
    scenario = replace(scenario, timetable=replace(scenario.timetable, services=(first, second)))
    delay_s = np.zeros((2, 3))
    delay_s[0, 1] = 60.0
    record, _, _ = on_map(scenario, delay_s=delay_s)
    assert record.violations == ()
    assert record.completed.all()


@pytest.mark.parametrize("cycle_s", [0.4, 1.0])
def test_telegrams_that_take_no_time_are_believed_where_units_may_be_wrong(cycle_s: float) -> None:
    scenario = replace(two_station_scenario(1), step_s=0.1)
    radio = RadioSpec(cycle_s=cycle_s, delay_least_s=0.0, delay_most_s=0.0)
    record, _, _ = on_map(scenario, radio=radio, unit_failures=())
    assert record.violations == ()
    assert record.completed.all()


@pytest.mark.parametrize("reports_are_lost", [False, True])
def test_a_telegram_without_commands_acknowledges_nothing(*, reports_are_lost: bool) -> None:
    """The centre has not heard of the train for so long that it sends it no commands."""
    from_s = READY_S + 20.2
    up = Outage((), reports_are_lost, down=False, from_s=from_s - 3.7, until_s=from_s + 1.7)
    down = Outage((), up=False, down=True, from_s=from_s + 0.2, until_s=from_s + 0.4)
    scenario = replace(
        two_station_scenario(1), step_s=0.1, disruptions=work("main", 325.0, 400.0, from_s, 60.0)
    )
    radio = RadioSpec(delay_most_s=0.45, outages=(up, down))
    record, _, listener = on_map(scenario, radio=radio)
    (zone,) = record.obstructions
    eoas_m = [
        float(authority.eoa_m[0])
        for state, authority, _ in listener.said
        if zone.established_s <= state.time_s < zone.lifted_s
    ]
    assert max(eoas_m) <= 325.0
    assert record.violations == ()
