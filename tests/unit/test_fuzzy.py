"""The fuzzy controller: membership functions that add up to 1, and a mean of rules."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.protection.fuzzy import degrees, infer, rule_base

PEAKS = (-2.0, -0.5, 0.0, 0.5, 2.0)
NEEDS = (0.0, 1.5, 3.0)
OUTPUT = tuple(float(number) for number in range(15))


def triangle(peaks: tuple[float, ...], index: int, value: float) -> float:
    """The membership function of one set, drawn by hand."""
    degree = np.zeros(len(peaks))
    degree[index] = 1.0
    return float(np.interp(value, peaks, degree))


@given(st.floats(-5.0, 5.0))
def test_degrees_are_those_of_the_triangles(value: float) -> None:
    upper, share = degrees(np.array(PEAKS), value)
    assert share == pytest.approx(triangle(PEAKS, upper, value))
    assert 1.0 - share == pytest.approx(triangle(PEAKS, upper - 1, value))


@given(st.floats(-5.0, 5.0), st.floats(-1.0, 5.0))
def test_the_output_is_the_weighted_mean_of_all_rules(first: float, second: float) -> None:
    rules = rule_base(PEAKS, NEEDS, OUTPUT)
    weights = np.outer(
        [triangle(PEAKS, index, first) for index in range(len(PEAKS))],
        [triangle(NEEDS, index, second) for index in range(len(NEEDS))],
    )
    assert weights.sum() == pytest.approx(1.0)
    wanted = float((weights * np.reshape(OUTPUT, weights.shape)).sum())
    assert infer(rules, first, second) == pytest.approx(wanted)


def test_at_the_peaks_one_rule_holds_alone() -> None:
    rules = rule_base(PEAKS, NEEDS, OUTPUT)
    assert infer(rules, 0.5, 1.5) == pytest.approx(10.0)
    assert infer(rules, -9.0, 9.0) == pytest.approx(2.0)
