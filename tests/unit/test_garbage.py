"""The garbage collector is left as it was found, whatever ends a run."""

import gc
import weakref

import pytest

from kankaku.railway.loop.garbage import SELDOM, seldom_collected


class Knot:
    """One half of a cycle."""

    other: "Knot"


def test_the_collector_looks_seldom_and_is_left_as_it_was() -> None:
    before, frozen = gc.get_threshold(), gc.get_freeze_count()
    with seldom_collected():
        assert gc.get_threshold() == (SELDOM, *before[1:])
        assert gc.get_freeze_count() > frozen
    assert gc.get_threshold() == before
    assert gc.get_freeze_count() == 0


def test_an_error_leaves_it_as_it_was_too() -> None:
    before = gc.get_threshold()
    with pytest.raises(ZeroDivisionError), seldom_collected():
        _ = 1 / 0
    assert gc.get_threshold() == before


def test_cycles_of_layers_are_found_all_the_same() -> None:
    with seldom_collected():
        one, two = Knot(), Knot()
        one.other, two.other = two, one
        seen = weakref.ref(one)
        del one, two
        made = [Knot() for _ in range(2 * SELDOM)]
        assert seen() is None
        assert len(made) == 2 * SELDOM
