"""Driving styles and answers of trains made at random."""

from dataclasses import replace

from hypothesis import strategies as st

from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import SpeedLimit
from kankaku.railway.plan.rolling_stock import TrainType

KMH = 1.0 / 3.6


@st.composite
def any_style(draw: st.DrawFn) -> DrivingStyle:
    """From all that trains can to half of their traction and 1 km/h/s."""
    return DrivingStyle(
        name="any",
        traction_share=draw(st.just(1.0) | st.floats(0.5, 1.0)),
        station_brake_mps2=KMH * draw(st.just(float("inf")) | st.floats(1.0, 5.0)),
        below_limit_mps=KMH * draw(st.just(0.0) | st.floats(1.0, 15.0)),
        coasting_band_mps=KMH * draw(st.just(0.0) | st.floats(1.0, 20.0)),
        departure_reaction_s=draw(st.just(0.0) | st.floats(0.5, 6.0)),
        driven_speeds=draw(st.booleans()),
        late_after_s=draw(st.sampled_from([0.0, 7.3, 33.3, float("inf")])),
    )


@st.composite
def answering(draw: st.DrawFn, train: TrainType) -> TrainType:
    """Return a train that answers gradually, with what its safety asks for beside it."""
    return replace(
        train,
        jerk_mps3=draw(st.just(float("inf")) | st.floats(0.3, 2.0)),
        brake_build_up_s=draw(st.just(0.0) | st.floats(0.2, 3.0)),
        safety_factor=draw(st.just(1.0) | st.floats(1.0, 1.5)),
        overspeed_mps=KMH * draw(st.just(0.0) | st.floats(0.5, 3.0)),
    )


@st.composite
def any_driven_speeds(draw: st.DrawFn, end_m: float) -> tuple[SpeedLimit, ...]:
    """Up to three stretches on which drivers are slower than they might be."""
    found = []
    for _ in range(draw(st.integers(0, 3))):
        start_m = draw(st.floats(0.0, end_m - 100.0))
        length_m = draw(st.floats(50.0, 700.0))
        found.append(
            SpeedLimit(start_m, min(start_m + length_m, end_m), draw(st.floats(5.0, 25.0)))
        )
    return tuple(found)
