"""
Open a page in Chromium and tell how large and how quick it is; take screenshots if asked to.

``python -m tools.page_look out/rush_hour/report.html [--shots FOLDER]``. Needs playwright and the
system's Chromium, draws by software.
"""

import argparse
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
LOOKS = ((1280, "light", "en-GB"), (1280, "dark", "ja-JP"), (400, "light", "en-GB"))
"""Width, colours and language of the screenshots. [px]"""
FRAMES = """async ([name, steps]) => {
  const { page, state, choose } = kankaku;
  choose({ shown: page.results[state.result].controllers.map(({ name }) => name) });
  const frame = page.diagram.frame;
  frame.reset();
  const next = () => new Promise((done) => requestAnimationFrame(done));
  await next();
  const script = [], between = [], paint = frame.paint.bind(frame);
  frame.paint = (quick) => {
    const before = performance.now();
    paint(quick);
    script.push(performance.now() - before);
  };
  let last = await next();
  for (let step = 0; step < steps; step++) {
    if (name === "zoom") frame.zoom(step % 20 < 10 ? 0.8 : 1.25);
    else if (name === "pan") frame.move(step % 20 < 10 ? -30 : 30, 0);
    else frame.paint();
    const now = await next();
    between.push(now - last);
    last = now;
  }
  frame.paint = paint;
  return [script, between];
}"""
PLAYED = """async () => {
  kankaku.makeAll();
  const { animation } = kankaku.page;
  animation.spent.length = 0;
  animation.toggle();
  await new Promise((done) => setTimeout(done, 4000));
  animation.toggle();
  return animation.spent;
}"""


def main() -> int:
    """Tell it."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("page", type=Path)
    asked.add_argument("--shots", type=Path, help="folder for screenshots")
    told = asked.parse_args()
    chromium = shutil.which("chromium")
    if chromium is None:
        sys.exit("There is no chromium on this machine.")
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - slow

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(ARGUMENTS))
        measure(browser, told.page)
        for look in LOOKS if told.shots else ():
            shoot(browser, told.page, told.shots, *look)
        browser.close()
    return 0


def measure(browser: "Browser", file: Path) -> None:
    """Print size and times of a page."""
    sys.stdout.write(f"{file}: {file.stat().st_size / 1e6:.2f} MB\n")
    page = opened(browser, file, 1280, "light", "en-GB")
    sys.stdout.write(f"ready after {page.get_attribute('#page', 'data-ready')} ms\n")
    # While many lines move their picture does, and they are drawn anew when it rests.
    for name in ("zoom", "pan", "drawn anew"):
        script_ms, between_ms = page.evaluate(FRAMES, [name, 60])
        sys.stdout.write(
            f"{name}, all controllers: {_told(script_ms)} of script, {_told(between_ms)} a frame\n"
        )
    sys.stdout.write(f"animation: {_told(page.evaluate(PLAYED))} of script a frame\n")
    page.context.close()


def _told(times_ms: list[float]) -> str:
    rising = sorted(times_ms)
    worst = rising[int(0.95 * (len(rising) - 1))]
    return f"median {rising[len(rising) // 2]:.1f} ms, 95 % below {worst:.1f} ms"


def opened(browser: "Browser", file: Path, width: int, colours: str, language: str) -> "Page":
    """Return a page that is ready."""
    context = browser.new_context(
        viewport={"width": width, "height": 900},
        color_scheme="dark" if colours == "dark" else "light",
        locale=language,
    )
    page = context.new_page()
    page.on("console", _say)
    page.on("pageerror", _say)
    page.goto(file.resolve().as_uri())
    page.wait_for_selector("#page[data-ready]")
    return page


def _say(heard: object) -> None:
    sys.stdout.write(f"{heard}\n")


def shoot(
    browser: "Browser", file: Path, folder: Path, width: int, colours: str, language: str
) -> None:
    """Take a screenshot of the whole page."""
    folder.mkdir(parents=True, exist_ok=True)
    page = opened(browser, file, width, colours, language)
    page.evaluate("kankaku.makeAll()")
    page.wait_for_timeout(1500)
    shot = folder / f"{file.parent.name}_{width}_{colours}_{language}.png"
    page.screenshot(path=shot, full_page=True)
    sys.stdout.write(f"{shot}\n")
    page.context.close()


if __name__ == "__main__":
    sys.exit(main())
