"""Random streams are keyed."""

import numpy as np

from kankaku.railway.randomness import stream


def test_the_same_key_gives_the_same_stream() -> None:
    one, other = (stream(1, "dwell", "T1", "a").standard_normal(5) for _ in range(2))
    assert np.array_equal(one, other)


def test_keys_that_only_look_alike_give_different_streams() -> None:
    keys: list[tuple[str | int, ...]] = [
        ("ab", "c"),
        ("a", "bc"),
        ("abc",),
        ("ab", "c", ""),
        (1, 2),
    ]
    draws = [float(stream(1, *key).standard_normal()) for key in keys]
    draws.append(float(stream(11, 2).standard_normal()))
    assert len(set(draws)) == len(draws)


def test_streams_of_neighbouring_keys_are_not_correlated() -> None:
    draws = np.array([stream(1, "dwell", f"T{i}", "a").standard_normal(2) for i in range(2000)])
    # Four standard errors of 2000 draws.
    assert abs(np.corrcoef(draws.T)[0, 1]) < 0.09
    assert abs(np.corrcoef(draws[1:, 0], draws[:-1, 0])[0, 1]) < 0.09
    assert abs(draws.mean()) < 0.07
