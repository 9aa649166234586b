"""Any list of stations and any headway: a scenario that loads and runs, or sentences."""

import tempfile
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import build
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.draft import Draft, write_files
from kankaku.scenarios.drafts.line_answers import LineAnswers, wish_of
from kankaku.scenarios.drafts.own_line import drafted, own_line
from kankaku.scenarios.drafts.stock_library import library_names
from kankaku.scenarios.loading.load import load
from kankaku.testing.example_lines import world_of
from tests.examples import examples
from tests.networks import run_network

FIGURES = st.sampled_from(["", "15", "30", "60", "75", "100", "150", "300", "900", "x", "-3"])
TYPED = st.text(max_size=40)


@st.composite
def answers(draw: st.DrawFn) -> LineAnswers:
    steps_km = draw(st.lists(st.floats(0.3, 4.0), min_size=1, max_size=9))
    km, told = 0.0, ["S0 0"]
    for number, step_km in enumerate(steps_km, 1):
        km += step_km
        told.append(f"S{number} {km:.2f}")
    last = len(steps_km)
    workings = ["", "full", f"full, S0 to S{last // 2}", f"full, S{last // 3} to S{last}"]
    return LineAnswers(
        stations=", ".join(told),
        headway=draw(st.sampled_from(["75", "90", "120", "180", "300", "600", "900"])),
        until_time=draw(st.sampled_from(["07:10", "07:40", "08:30"])),
        pattern=draw(st.sampled_from(workings)),
        turn_back=draw(st.sampled_from(["30", "120", "240"])),
        dwell=draw(st.sampled_from(["15", "30", "50"])),
        train=draw(st.sampled_from(library_names())),
        terminal_tracks=draw(st.sampled_from(["", "1", "2", "3"])),
        driving=draw(st.sampled_from(["", "left", "right"])),
        single_track=draw(st.booleans()),
    )


def made(said: LineAnswers) -> tuple[Draft | None, tuple[str, ...]]:
    """Return a draft, or why there is none."""
    try:
        return drafted(own_line(wish_of(said, "line"))), ()
    except KankakuError as error:
        return None, error.sentences


@examples(100)
@given(answers())
def test_a_line_of_ones_own_loads_or_is_refused_in_sentences(said: LineAnswers) -> None:
    draft, refused = made(said)
    # No file of a scenario is to blame for what somebody typed.
    assert all("allowed" in sentence for sentence in refused)
    assert not any(".csv: row" in sentence for sentence in refused)
    if draft is None:
        assert refused
        return
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "line"
        write_files(draft.files(), folder)
        scenario = load(folder)
    assert not scenario.warnings
    assert scenario.timetable.services


@examples(40)
@given(answers(), st.integers(0, 3))
def test_every_train_arrives_under_each_controller(said: LineAnswers, which: int) -> None:
    draft, _ = made(said)
    if draft is None:
        return
    draft.settings["step_s"] = 0.5
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "line"
        write_files(draft.files(), folder)
        scenario = load(folder)
    world = world_of(scenario)
    controller = build(scenario.controllers[which], world, scenario.radio)
    record, _ = run_network(scenario, controller=controller)
    assert record.violations == ()
    assert record.completed.all()


@examples(100)
@given(TYPED, FIGURES, TYPED, TYPED, TYPED)
def test_whatever_is_typed_is_answered(
    stations: str, headway: str, pattern: str, figures: str, begin: str
) -> None:
    said = LineAnswers(
        stations=stations, headway=headway, pattern=pattern, train_figures=figures, from_time=begin
    )
    draft, refused = made(said)
    assert draft is not None or refused
    assert all(sentence.strip() for sentence in refused)
