"""Colours that nobody takes for one another, and letters that can all be drawn."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import (
    BOOKED,
    DASHES,
    FONT,
    MARKERS,
    OF_ONE_DASH,
    PALETTE,
    colour,
    dashes,
    drawable,
    marker,
    style,
    write_figure,
)
from kankaku.analysis.page.html import BROWSER
from kankaku.railway.arrays import FloatArray

APART = 0.06
"""Of two colours in Oklab; what can just be told apart is a third of it. [-]"""
CONTRAST = 3.0
"""What WCAG 2.2 asks of lines of a figure (1.4.11). [-]"""
MOST_BYTES = 2_500_000
TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
SIGHT = {
    "usual": np.eye(3),
    "without red": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "without green": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
"""Machado, Oliveira and Fernandes, *A physiologically-based model*, 2009, severity 1."""


def linear(colours: tuple[str, ...]) -> FloatArray:
    """Return colours without gamma. [-], shape (n, 3)"""
    srgb = np.array([[int(one[at : at + 2], 16) for at in (1, 3, 5)] for one in colours]) / 255.0
    found: FloatArray = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return found


def luminance(colour: str) -> float:
    """Return how light a colour is, as WCAG counts it. [-]"""
    return float((linear((colour,)) @ np.array([0.2126, 0.7152, 0.0722]))[0])


def oklab(colours: tuple[str, ...], sight: str) -> FloatArray:
    """Return colours as they are seen. [-], shape (n, 3)"""
    seen = np.clip(linear(colours) @ SIGHT[sight].T, 0.0, 1.0)
    found: FloatArray = np.cbrt(seen @ TO_CONES.T) @ TO_LAB.T
    return found


@pytest.mark.parametrize("sight", SIGHT)
def test_any_two_colours_are_told_apart(sight: str) -> None:
    seen = oklab((*PALETTE, BOOKED), sight)
    apart = [float(np.linalg.norm(one - other)) for one, other in combinations(seen, 2)]
    assert min(apart) > APART


def page_colours(ground: str) -> tuple[str, ...]:
    """Return the colours of controllers on the page, on a light or a dark ground."""
    text = (BROWSER / "colours.js").read_text("utf-8")
    (block,) = re.findall(rf"^const {ground} = \[(.*?)\];", text, re.MULTILINE | re.DOTALL)
    return tuple(re.findall(r"#[0-9a-f]{6}", block))


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize(("ground", "paper"), [("LIGHT", "#ffffff"), ("DARK", "#14181c")])
def test_controllers_are_told_apart_on_the_page(sight: str, ground: str, paper: str) -> None:
    colours = page_colours(ground)
    assert len(colours) == 16
    seen = oklab((*colours, paper), sight)
    apart = [float(np.linalg.norm(one - other)) for one, other in combinations(seen, 2)]
    assert min(apart) > APART


@pytest.mark.parametrize(("ground", "paper"), [("LIGHT", "#ffffff"), ("DARK", "#14181c")])
def test_lines_of_the_page_stand_out_from_their_ground(ground: str, paper: str) -> None:
    assert f"--paper: {paper};" in (BROWSER / "page.css").read_text("utf-8")
    *own, least = (luminance(colour) for colour in (*page_colours(ground), paper))
    for one in own:
        assert (max(one, least) + 0.05) / (min(one, least) + 0.05) >= CONTRAST


def test_the_measure_sees_what_red_green_blindness_confuses() -> None:
    one, other = oklab(("#D62728", "#12602A"), "without red")
    assert np.linalg.norm(one - other) < APART


def test_no_colour_is_there_twice_and_no_line_looks_like_another() -> None:
    assert len(set(PALETTE)) == len(PALETTE) == 24
    lines = {(colour(number), str(dashes(number))) for number in range(120)}
    assert len(lines) == 120
    marks = {(colour(number), marker(number)) for number in range(120)}
    assert len(marks) == 120
    assert {dashes(number) for number in range(OF_ONE_DASH)} == {DASHES[0]}
    assert len(MARKERS) == 5


def test_japanese_is_drawn_and_what_no_font_has_becomes_a_box(
    tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    assert drawable("京浜東北線 鶯谷 ダイヤ\nOji é") == "京浜東北線 鶯谷 ダイヤ\nOji é"
    assert drawable("a\x1b\U0001f686b") == "a□□b"
    with style():
        figure = Figure(figsize=(2.0, 1.0))
        figure.suptitle("鶯谷 \x1b\U0001f686", fontweight="bold")
    files = write_figure(figure, tmp_path / "title", ("png", "svg", "pdf"))
    again = write_figure(figure, tmp_path / "again", ("png", "svg", "pdf"))
    assert [file.read_bytes() for file in files] == [file.read_bytes() for file in again]
    assert not list(recwarn)
    assert "NotoSansJPSubset" in files[1].read_text("utf-8")


def test_the_font_is_small_and_its_licence_lies_beside_it() -> None:
    assert FONT.stat().st_size < MOST_BYTES
    licence = (FONT.parent / "OFL.txt").read_text("utf-8")
    assert "SIL OPEN FONT LICENSE Version 1.1" in licence
