"""Whatever a peer answers is advice that can be followed, or is refused with a sentence."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.live.line_advice import taken
from kankaku.live.line_protocol import ASKED, NUMBERED, advice_in, parsed
from kankaku.railway.errors import KankakuError
from kankaku.testing.example_lines import merge_scenario, world_of
from tests.examples import examples

WORLD = world_of(merge_scenario(3, 60.0, step_s=0.5))
PLACES = len(merge_scenario(3, 60.0).line.turnouts)
NUMBERS = st.one_of(
    st.integers(-3, 3), st.sampled_from([0.0, 12.5, -1.0, 1e11, 1e13, 10**400, 2**31, 2**63])
)
SCALARS = st.one_of(st.none(), st.booleans(), NUMBERS, st.floats(), st.text(max_size=3))
ROWS = st.lists(NUMBERS | SCALARS, min_size=3, max_size=3)
BY_TRAIN = st.dictionaries(st.sampled_from(["T1", "T2", "T9", "\ud800"]), NUMBERS | SCALARS)
ANY = st.recursive(SCALARS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner))
ANSWERS = st.dictionaries(
    st.sampled_from([*ASKED, *NUMBERED, *ASKED, *NUMBERED, "speed"]),
    st.one_of(NUMBERS, ROWS, BY_TRAIN, ANY),
)


def heard(line: bytes) -> None:
    """Take an answer as the link does; only refusals may be raised."""
    asked = taken(advice_in(parsed(line), 0, WORLD.size), WORLD, 2, PLACES)
    assert (asked.ceiling_mps >= 0.0).all()
    assert (asked.target_mps >= 0.0).all()
    assert (asked.hold_until_s < np.inf).all()
    assert np.isin(asked.reason, [0, 1]).all()
    assert ((asked.cause >= -1 - PLACES) & (asked.cause < WORLD.size)).all()


def refused_or_heard(line: bytes) -> None:
    told = "; allowed: "
    try:
        heard(line)
    except KankakuError as error:
        told = str(error)
    assert "; allowed: " in told


@examples(300)
@given(ANSWERS)
def test_any_object_is_followed_or_refused(answer: dict[str, object]) -> None:
    refused_or_heard(json.dumps({"decision": 0, **answer}).encode())


@examples(300)
@given(st.binary(max_size=40), st.integers(0, 120), st.integers(0, 20))
def test_any_bytes_are_followed_or_refused(other: bytes, at: int, cut: int) -> None:
    whole = json.dumps(
        {
            "decision": 0,
            "ceiling_mps": [12.5, None, 3],
            "hold_until_s": {"T1": 40.0},
            "reason": [0, 1, 0],
            "cause": [-2, 0, -1],
        }
    ).encode()
    heard(whole)
    refused_or_heard(whole[:at] + other + whole[at + cut :])


@pytest.mark.parametrize("deep", [10, 900, 990, 1_000, 50_000])
@pytest.mark.parametrize("part", ["decision", "ceiling_mps", "cause"])
def test_no_nesting_is_too_deep_to_be_refused(part: str, deep: int) -> None:
    for opened, closed in (("[", "]"), ('{"T1":', "}")):
        line = f'{{"decision": 0, "{part}": {opened * deep}1{closed * deep}}}'
        with pytest.raises(KankakuError, match="allowed: "):
            heard(line.encode())
