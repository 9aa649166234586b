"""The page in a real browser: it works, asks nobody, and shows what the tables say."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from kankaku.analysis.page.html import page_of
from kankaku.analysis.page.page_reading import read_source
from kankaku.analysis.results import Results, read_results
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.intervals import departure_arrival_intervals
from tests.browser.browsing import Opened, browser, opened
from tests.unit.page_folder import HOSTILE, LINE, PLACES_M, saved_run, write_results

if TYPE_CHECKING:
    from playwright.sync_api import Browser

SECTIONS = ("diagram", "train_view", "line_view", "animation", "papers", "about")
INKED = """(selector) => {
  const canvas = document.querySelector(selector);
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  const colours = new Set();
  for (let i = 0; i < pixels.length; i += 4) colours.add(pixels.slice(i, i + 4).join());
  return colours.size;
}"""
"""How many colours a canvas shows."""


def named(names: Mapping[str, str]) -> dict[str, object]:
    """Return what results say of the line, with other names of its stations."""
    places = [{"id": key, "name": name, "chainage_m": PLACES_M[key]} for key, name in names.items()]
    return {**LINE, "stations": places}


@pytest.fixture(scope="module")
def chromium() -> Iterator["Browser"]:
    with browser() as started:
        yield started


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    runs = [saved_run("plain"), saved_run("early", late_s=4.0), saved_run("late", late_s=60.0)]
    return write_results(tmp_path_factory.mktemp("page") / "tiny", runs)


@pytest.fixture(scope="module")
def file(folder: Path) -> Path:
    made = folder / "report.html"
    made.write_text(page_of([read_source(folder)]), "utf-8")
    return made


@pytest.fixture(scope="module")
def results(folder: Path) -> Results:
    return read_results(folder)


@pytest.fixture
def shown(chromium: "Browser", file: Path) -> Iterator[Opened]:
    with opened(chromium, file) as found:
        yield found
        assert not found.troubles
        assert not found.requests


def test_every_part_is_made_without_a_word_of_trouble(shown: Opened) -> None:
    shown.ask("kankaku.makeAll()")
    for name in SECTIONS:
        assert shown.ask(f"document.querySelector('[data-section={name}]').children.length") > 0
    assert shown.page.locator("[role=alert]").count() == 0
    shown.page.wait_for_timeout(300)
    for selector in ("#diagram canvas", "#train_view canvas", "#heat", "#line-canvas"):
        assert shown.ask(f"({INKED})('{selector}')") > 3, selector


def test_the_head_has_the_verdict_and_every_number_of_the_comparison(
    shown: Opened, results: Results
) -> None:
    assert shown.text(".verdict").startswith("early stands least between stations")
    assert "No safety rule was violated" in shown.text(".safety")
    cells = shown.ask(
        "[...document.querySelectorAll('#comparison tbody tr')].flatMap(row => "
        "[...row.querySelectorAll('td')].map((cell, at) => "
        "[row.dataset.indicator, at, Number(cell.dataset.value), "
        "cell.querySelector('.value').lastChild.textContent]))"
    )
    for _, _, value, told in cells:
        decimals = len(told.partition(".")[2])
        assert float(told.replace(",", "")) == pytest.approx(value, abs=0.51 * 10.0**-decimals)
    compared = rows_of(comparison(results.summary))
    names = list(results.controllers)
    wanted = [[row["indicator"], names.index(row["controller"]), row["mean"]] for row in compared]
    assert sorted(cell[:3] for cell in cells) == sorted(wanted)


def test_what_the_browser_reads_is_what_was_saved(shown: Opened, results: Results) -> None:
    for name in results.controllers:
        saved = results.run(name)
        run = f"kankaku.page.results[0].run('{name}', '1/0')"
        for column in ("arrival_s", "departure_delay_s", "secondary_delay_s"):
            assert (
                shown.ask(f"[...{run}.calls.numbers('{column}')]") == saved.calls[column].tolist()
            )
        for train, own in saved.trajectory.groupby("train"):
            trip = f"{run}.trips.get('{train}')"
            for column in ("time_s", "front_m", "speed_mps", "limit_m"):
                assert shown.ask(f"[...{trip}.{column}]") == own[column].tolist()
            reasons = shown.ask(f"[...{trip}.time_s].map((_, i) => {trip}.text('reason', i))")
            assert reasons == own["reason"].tolist()


def test_a_controller_is_switched_on_and_off(shown: Opened) -> None:
    chip = shown.page.locator(".chip[data-controller=late]")
    assert chip.get_attribute("aria-pressed") == "false"
    chip.click()
    assert chip.get_attribute("aria-pressed") == "true"
    assert "late" in shown.ask("kankaku.state.shown")
    chip.click()
    assert "late" not in shown.ask("kankaku.state.shown")
    shown.page.click("#show-all")
    assert shown.ask("kankaku.state.shown") == ["plain", "early", "late"]


def test_a_train_is_found_with_its_time_and_told(shown: Opened, results: Results) -> None:
    shown.ask("kankaku.makeAll()")
    shown.page.fill("#find", "2b 07:03:20")
    shown.page.press("#find", "Enter")
    assert shown.ask("kankaku.state.train") == "2B"
    assert shown.ask("kankaku.state.time_s") == 25400.0
    shown.page.click("#train_view summary:has-text('Calls of the train')")
    rows = shown.page.locator("#train_view details[open] tbody tr").all_inner_texts()
    calls = results.run("plain").calls
    assert len(rows) == int((calls["train"] == "2B").sum())
    assert "Gamma" in rows[2]
    assert "+30.0" in rows[2]
    shown.page.fill("#find", "9Z")
    shown.page.press("#find", "Enter")
    assert "no train 9Z" in shown.ask("document.getElementById('spoken').textContent")


def test_the_ribbon_says_what_bound_the_speed(shown: Opened) -> None:
    shown.ask("kankaku.makeAll(); kankaku.choose({train: '2B', focus: 'plain'})")
    shown.page.click("#train_view summary:has-text('The ribbon as a table')")
    told = shown.text("#train_view details[open] table")
    assert "train ahead" in told
    assert "1A" in told


def test_hovering_tells_train_time_delay_and_leader(shown: Opened) -> None:
    shown.ask("kankaku.makeAll(); kankaku.choose({train: '2B', shown: ['plain']})")
    place = shown.ask(
        "(() => { const f = kankaku.page.diagram.frame;"
        "const t = kankaku.page.results[0].run('plain', '1/0').trips.get('2B');"
        "return [f.x(25410), f.y(t.frontAt(25410))]; })()"
    )
    told = shown.ask(f"kankaku.page.diagram.hover({place[0]}, {place[1]})")
    assert told[0] == "2B · plain"
    assert told[1] == "07:03:30"
    assert "train ahead (1A)" in told


def test_the_diagram_zooms_and_moves_by_keys_and_buttons(shown: Opened) -> None:
    span = "kankaku.page.diagram.frame.x1 - kankaku.page.diagram.frame.x0"
    whole = shown.ask(span)
    shown.page.locator("#diagram canvas").focus()
    shown.page.keyboard.press("+")
    assert shown.ask(span) < whole
    begin = shown.ask("kankaku.page.diagram.frame.x0")
    shown.page.keyboard.press("ArrowRight")
    assert shown.ask("kankaku.page.diagram.frame.x0") > begin
    shown.page.keyboard.press("0")
    assert shown.ask(span) == pytest.approx(whole)
    train = shown.ask("kankaku.state.train")
    shown.page.keyboard.press("]")
    assert shown.ask("kankaku.state.train") != train
    shown.page.click("#diagram button[aria-label='Zoom in']")
    assert shown.ask(span) < whole


def test_the_animation_plays_pauses_and_follows_the_slider(shown: Opened) -> None:
    shown.ask("kankaku.makeAll()")
    shown.page.locator("#moment").fill("25300")
    assert shown.text("#clock") == "07:01:40"
    shown.page.click("#play")
    while shown.ask("kankaku.page.animation.time_s") <= 25310.0:
        shown.page.wait_for_timeout(50)
    shown.page.click("#play")
    assert shown.ask("kankaku.page.animation.playing") is False
    assert shown.ask("kankaku.page.animation.pair().length") == 2
    count = shown.ask("document.getElementById('line-canvas').getAttribute('aria-label')")
    assert "trains on the line" in count


def test_the_language_is_switched(shown: Opened) -> None:
    shown.ask("kankaku.makeAll()")
    shown.page.select_option("#language", "ja")
    assert shown.ask("document.documentElement.lang") == "ja"
    assert shown.text("#findings h2") == "判定"
    assert "駅間停車" in shown.text("#comparison")
    assert "early" in shown.text(".verdict")


@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("dark", [False, True])
def test_nothing_is_wider_than_the_window(
    chromium: "Browser", file: Path, width: int, *, dark: bool
) -> None:
    with opened(chromium, file, width=width, dark=dark) as found:
        found.ask("kankaku.makeAll()")
        found.page.wait_for_timeout(200)
        assert found.ask("document.documentElement.scrollWidth") <= width
        assert found.ask("document.documentElement.dataset.theme") == ("dark" if dark else "light")
        assert not found.troubles


OVERLAPS = """() => {
  const frame = kankaku.page.train.speed;
  const told = [], write = frame.pen.fillText;
  frame.pen.fillText = function (text, x, y) {
    if (this.textAlign === "left") told.push([text, x, x + this.measureText(text).width, y]);
    write.apply(this, arguments);
  };
  frame.paint();
  delete frame.pen.fillText;
  const names = told.filter(([text]) => /station/.test(text));
  const over = names.filter(([, x], at) => at && x < names[at - 1][2]);
  return [names.map(([text]) => text), over];
}"""
"""Names of stations over the speed of a train, and those that begin before the last one ends."""


@pytest.mark.parametrize("width", [1280, 400])
def test_long_names_of_stations_are_whole_and_apart(
    chromium: "Browser", tmp_path: Path, width: int
) -> None:
    names = {
        "a": "The first station of a very long line",
        "b": "A station",
        "c": "Its last station",
    }
    folder = write_results(tmp_path / "long", [saved_run("plain")], names=names)
    folder.joinpath("line.json").write_text(json.dumps(named(names)), "utf-8")
    file = tmp_path / "report.html"
    file.write_text(page_of([read_source(folder)]), "utf-8")
    with opened(chromium, file, width=width) as found:
        found.ask("kankaku.makeAll(); kankaku.choose({train: '2B'})")
        found.page.wait_for_timeout(200)
        told, over = found.ask(f"({OVERLAPS})()")
        assert told[0] == names["a"]
        assert over == []
        cut = found.ask(
            "[...document.querySelectorAll('#line_view svg.chart text')]"
            ".filter(one => one.getBBox().x < 0).map(one => one.textContent)"
        )
        assert cut == []
        assert names["a"] in found.page.locator("#line_view svg.chart text").all_text_contents()
        assert not found.troubles


def test_a_reader_of_japanese_gets_japanese(chromium: "Browser", file: Path) -> None:
    with opened(chromium, file, language="ja-JP") as found:
        assert found.text("#findings h2") == "判定"
        found.ask("kankaku.makeAll(); kankaku.choose({focus: 'late', shown: ['late']})")
        assert "1A Beta駅で停車超過: 他の 1 列車に" in found.text("#delay-tree")
        assert "主な発端:1A Beta駅で停車超過 (" in found.text("#line_view")
        found.page.set_viewport_size({"width": 220, "height": 900})
        tops = found.ask(
            "(() => { const label = document.createRange();"
            "label.selectNodeContents(document.querySelector('.safety strong'));"
            "return [...label.getClientRects()].map(line => line.top); })()"
        )
        assert len(set(tops)) == 1
        assert not found.troubles


def test_the_whole_can_be_walked_through_by_tabulator_and_everything_has_a_name(
    shown: Opened,
) -> None:
    shown.ask("kankaku.makeAll()")
    nameless = shown.ask(
        "[...document.querySelectorAll('button, select, input, canvas, svg.chart')].filter(one => "
        "!(one.getAttribute('aria-label') || one.textContent.trim() || one.closest('label') "
        '|| document.querySelector(`label[for="${one.id}"]`))).map(one => one.outerHTML)'
    )
    assert nameless == []
    reached = set()
    for _ in range(40):
        shown.page.keyboard.press("Tab")
        reached.add(shown.ask("document.activeElement.tagName + (document.activeElement.id || '')"))
    assert {"SELECTlanguage", "INPUTfind", "CANVAS"} <= reached


CONTRAST = """() => {
  const part = (value) => {
    const share = value / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  };
  const light = (colour) => {
    const [r, g, b] = colour.match(/[\\d.]+/g).map(Number);
    return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  };
  const ground = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const colour = getComputedStyle(at).backgroundColor;
      if (!/, 0\\)$|transparent/.test(colour)) return colour;
    }
    return "rgb(255, 255, 255)";
  };
  const poor = [];
  for (const one of document.querySelectorAll("body *")) {
    const own = [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
    if (!own || !one.checkVisibility() || one.closest("canvas, svg, .hidden, .skip")) continue;
    const [a, b] = [light(getComputedStyle(one).color), light(ground(one))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) poor.push(`${one.tagName}.${one.className} ${ratio.toFixed(2)}`);
  }
  return poor;
}"""
"""Texts of less contrast than WCAG 2.2 asks for at level AA (1.4.3)."""


@pytest.mark.parametrize("dark", [False, True])
def test_every_text_stands_out_from_its_ground(
    chromium: "Browser", file: Path, *, dark: bool
) -> None:
    with opened(chromium, file, dark=dark) as found:
        found.ask("kankaku.makeAll()")
        assert found.ask(f"({CONTRAST})()") == []


def test_hostile_names_are_shown_and_never_run(chromium: "Browser", tmp_path: Path) -> None:
    names = {"a": HOSTILE, "b": "<b>bold</b>", "c": "{{7*7}}"}
    run = saved_run("plain")
    for frame in (run.calls, run.trajectory, run.interstation_stops, run.remaining_stops):
        frame["train"] = frame["train"].replace("2B", HOSTILE)
    folder = write_results(tmp_path / "bad", [run], names=names, title=HOSTILE)
    file = tmp_path / "report.html"
    file.write_text(page_of([read_source(folder)]), "utf-8")
    with opened(chromium, file) as found:
        found.ask("kankaku.makeAll()")
        found.ask(f"kankaku.choose({{train: {HOSTILE!r}}})")
        found.page.wait_for_timeout(300)
        assert found.page.locator("img, b, script[src]").count() == 0
        assert found.text("h1") == HOSTILE
        assert not found.troubles
        assert not found.requests


def test_partial_results_are_said_and_shown(chromium: "Browser", tmp_path: Path) -> None:
    folder = write_results(tmp_path / "part", [saved_run("plain"), saved_run("early", late_s=2.0)])
    for name in ("line.json", "provenance.json", "plain/trajectory.parquet"):
        (folder / name).unlink()
    file = tmp_path / "report.html"
    file.write_text(page_of([read_source(folder)]), "utf-8")
    with opened(chromium, file) as found:
        found.ask("kankaku.makeAll()")
        told = found.text(".notes")
        assert "line.json is missing" in told
        assert "plain: no trajectory" in told
        assert found.page.locator("[role=alert]").count() == 0
        assert not found.troubles


def test_intervals_and_origins_are_those_of_the_tables(shown: Opened, results: Results) -> None:
    shown.ask("kankaku.makeAll()")
    told = departure_arrival_intervals(results.run("plain").calls)["interval_s"]
    bars = shown.page.locator("#line_view svg title").all_text_contents()
    assert any(f"{told.iloc[0]:.0f} s" in bar for bar in bars if "plain" in bar)
    assert "1A" in shown.text("#delay-tree")


def test_hovering_a_stop_tells_where_when_and_for_whom(shown: Opened) -> None:
    shown.ask("kankaku.makeAll(); kankaku.choose({shown: ['late']})")
    told = shown.ask(
        "(() => { const line = kankaku.page.line; const [stem] = line.stems();"
        "return line.hoverStop(stem.x, stem.top); })()"
    )
    assert told == [
        "2B · late",
        "07:03:20, 60.0 s",
        "0.900 km → Beta",
        "because of: 1A",
    ]


def test_seeds_are_shown_one_by_one_and_can_be_changed(chromium: "Browser", tmp_path: Path) -> None:
    runs = [
        saved_run(name, seed, late_s=late_s * seed)
        for name, late_s in (("plain", 20.0), ("early", 3.0))
        for seed in (1, 2, 3)
    ]
    folder = write_results(tmp_path / "seeds", runs)
    file = tmp_path / "report.html"
    file.write_text(page_of([read_source(folder)]), "utf-8")
    with opened(chromium, file) as found:
        assert found.page.locator("#findings svg circle").count() >= 6
        found.page.select_option("#key", "3/0")
        assert found.ask("kankaku.state.key") == "3/0"
        found.page.wait_for_selector("#diagram p:has-text('lines join the calls')")
        assert not found.troubles
