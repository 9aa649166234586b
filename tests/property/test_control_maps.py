"""Control maps of random days: whatever trains, points and radio do, bands stay apart."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions, PointsFailure
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.radio_spec import LOSSLESS
from kankaku.railway.plan.scenario import Scenario
from kankaku.testing.example_lines import merge_scenario, two_station_scenario
from kankaku.testing.loop_station import loop_station_scenario
from tests.examples import examples
from tests.property.runs import READY_S
from tests.unit.test_control_map import on_map

DAYS = examples(25)
WORLDS: tuple[Callable[[], Scenario], ...] = (
    lambda: two_station_scenario(4, 70.0),
    lambda: merge_scenario(4, 60.0),
    lambda: loop_station_scenario(4, 70.0, one_starts_inside=True),
)


@st.composite
def days(draw: st.DrawFn) -> Scenario:
    """Return a line whose points need their time, with work and failures on it."""
    scenario = draw(st.sampled_from(WORLDS))()
    throw_s = draw(st.floats(0.0, 12.0))
    line = replace(
        scenario.line,
        turnouts=tuple(replace(points, throw_s=throw_s) for points in scenario.line.turnouts),
    )
    failures = [
        PointsFailure(points.id, from_s, from_s + draw(st.floats(1.0, 200.0)))
        for points in line.turnouts
        if draw(st.booleans())
        for from_s in [READY_S + draw(st.floats(0.0, 300.0))]
    ]
    closures = [closure for number in range(2) if (closure := draw(zones(line, number)))]
    return replace(
        scenario,
        line=line,
        patience_s=3600.0,
        disruptions=Disruptions(tuple(closures), tuple(failures)),
    )


@st.composite
def zones(draw: st.DrawFn, line: Line, number: int) -> Closure | None:
    """Return a work zone away from points, or a failure, or nothing."""
    if draw(st.booleans()):
        return None
    track = draw(st.sampled_from(sorted(line.track_by_id)))
    place = line.track_by_id[track]
    start_m = draw(st.floats(place.start_m + 70.0, place.end_m - 170.0))
    from_s = READY_S + draw(st.floats(0.0, 300.0))
    until_s = from_s + draw(st.floats(10.0, 200.0))
    released_s = until_s + draw(st.sampled_from([0.0, 40.0]))
    cause = draw(st.sampled_from([Cause.WORK, Cause.FAILURE]))
    ends_m = start_m, start_m + 80.0
    return Closure(f"zone{number}", cause, (track,), *ends_m, from_s, until_s, released_s)


@DAYS
@given(
    days(),
    st.lists(st.floats(0.0, 90.0), min_size=15, max_size=15),
    st.sampled_from([0.0, 0.02, 0.1, 0.3]),
    st.sampled_from([1.0, 3.0]),
)
def test_nobody_is_ever_in_anothers_band(
    scenario: Scenario, drawn_s: list[float], loss_ratio: float, burst_factor: float
) -> None:
    services = scenario.timetable.services
    shape = len(services), max(len(service.calls) for service in services)
    radio = replace(LOSSLESS, loss_ratio=loss_ratio, burst_factor=burst_factor)
    record, _, listener = on_map(scenario, radio=radio, delay_s=np.resize(np.array(drawn_s), shape))
    assert record.violations == ()
    assert record.completed.all()
    assert listener.said[-1][2].refused_s == -np.inf
