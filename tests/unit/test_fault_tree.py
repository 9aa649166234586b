"""Fault trees: textbook examples, and every small tree against all its states."""

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kankaku.railway.failures.fault_tree import (
    Event,
    FaultTree,
    FaultTreeError,
    Gate,
    joint_probability,
    minimal_cut_sets,
    top_probability,
)


def tree_of(events: dict[str, float], **gates: Gate) -> FaultTree:
    named = {name: Event(name, probability) for name, probability in events.items()}
    return FaultTree(named, gates, ("top",))


def any_of(*inputs: str) -> Gate:
    return Gate("", needs_all=False, inputs=inputs)


def all_of(*inputs: str) -> Gate:
    return Gate("", needs_all=True, inputs=inputs)


def happens(tree: FaultTree, name: str, true: set[str]) -> bool:
    if name in tree.events:
        return name in true
    parts = [happens(tree, part, true) for part in tree.gates[name].inputs]
    return all(parts) if tree.gates[name].needs_all else any(parts)


def states(tree: FaultTree) -> list[tuple[set[str], float]]:
    """Every set of events with its probability."""
    found = []
    for flags in product((False, True), repeat=len(tree.events)):
        chance = 1.0
        for flag, event in zip(flags, tree.events.values(), strict=True):
            chance *= event.probability if flag else 1.0 - event.probability
        found.append(({n for n, flag in zip(tree.events, flags, strict=True) if flag}, chance))
    return found


def test_two_of_three() -> None:
    # P = 3 p^2 - 2 p^3.
    pairs = {"ab": all_of("a", "b"), "bc": all_of("b", "c"), "ac": all_of("a", "c")}
    tree = tree_of({"a": 0.1, "b": 0.1, "c": 0.1}, top=any_of("ab", "bc", "ac"), **pairs)
    assert set(minimal_cut_sets(tree, "top")) == {
        frozenset("ab"),
        frozenset("bc"),
        frozenset("ac"),
    }
    assert top_probability(tree, "top") == pytest.approx(3 * 0.01 - 2 * 0.001)


def test_a_set_that_contains_another_one_is_absorbed() -> None:
    tree = tree_of({"a": 0.5, "b": 0.5}, top=any_of("a", "both"), both=all_of("a", "b"))
    assert minimal_cut_sets(tree, "top") == (frozenset("a"),)
    assert top_probability(tree, "top") == 0.5


def test_an_event_under_two_gates_counts_once() -> None:
    # (a or b) and (a or c) is a or (b and c).
    tree = tree_of(
        {"a": 0.2, "b": 0.3, "c": 0.4}, top=all_of("x", "y"), x=any_of("a", "b"), y=any_of("a", "c")
    )
    assert set(minimal_cut_sets(tree, "top")) == {frozenset("a"), frozenset("bc")}
    assert top_probability(tree, "top") == pytest.approx(0.2 + 0.8 * 0.12)


def test_tiny_probabilities_are_not_lost() -> None:
    tree = tree_of({"a": 1e-9, "b": 1e-12, "c": 1e-18}, top=any_of("a", "b", "c"))
    assert top_probability(tree, "top") == pytest.approx(1.001000000001e-9, rel=1e-9)
    assert top_probability(tree_of({"c": 1e-18}, top=any_of("c")), "top") == 1e-18


def test_what_never_or_surely_happens() -> None:
    tree = tree_of({"never": 0.0, "sure": 1.0}, top=all_of("never", "sure"), other=any_of("sure"))
    assert top_probability(tree, "top") == 0.0
    assert top_probability(tree, "other") == 1.0


def test_a_tree_with_too_many_cut_sets_is_refused() -> None:
    events = {f"{row}{column}": 0.1 for row in "abcdefgh" for column in range(6)}
    rows = {row: any_of(*(f"{row}{column}" for column in range(6))) for row in "abcdefgh"}
    with pytest.raises(FaultTreeError, match="more than 1000"):
        minimal_cut_sets(tree_of(events, top=all_of(*rows), **rows), "top")


@st.composite
def trees(draw: st.DrawFn) -> FaultTree:
    names = list("abcdefg")[: draw(st.integers(1, 7))]
    chances = st.sampled_from([0.0, 0.01, 0.3, 0.5, 0.9, 1.0])
    events = {name: draw(chances) for name in names}
    gates: dict[str, Gate] = {}
    for number in range(draw(st.integers(1, 6))):
        below = [*names, *gates]
        inputs = draw(st.lists(st.sampled_from(below), min_size=1, max_size=4, unique=True))
        gates[f"gate{number}"] = Gate("", needs_all=draw(st.booleans()), inputs=tuple(inputs))
    gates["top"] = gates.pop(f"gate{len(gates) - 1}")
    return tree_of(events, **gates)


@settings(max_examples=300, deadline=None)
@given(trees())
def test_cut_sets_and_probability_agree_with_all_states(tree: FaultTree) -> None:
    every = states(tree)
    true = [(state, chance) for state, chance in every if happens(tree, "top", state)]
    sets = minimal_cut_sets(tree, "top")
    assert top_probability(tree, "top") == pytest.approx(sum(p for _, p in true), abs=1e-12)
    for state, _ in every:
        assert happens(tree, "top", state) == any(found <= state for found in sets)
    for found in sets:
        assert happens(tree, "top", set(found))
        assert not any(happens(tree, "top", set(found - {name})) for name in found)
    # Boole's inequality, and the likeliest set alone.
    joint = [joint_probability(tree, found) for found in sets]
    assert max(joint) - 1e-12 <= top_probability(tree, "top") <= sum(joint) + 1e-12
