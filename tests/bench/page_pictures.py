"""Pictures of the page: the command is ``python -m tests.bench.page_pictures RUN``; RUN is the folder of a finished
run.

The picture docs/pictures/page.png shows the page of a run. The option ``--all FOLDER`` makes further pictures for
inspection: whole pages, light and dark, wide, on a phone, at 200 %, with 16 ranks (a run that no solver computed), the
list of runs, a case in the editor.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tests.server.chromium import Browser, Page
from tests.server.visitor import SHOWN, Site, sign_in

from .page_scene import lay, take

OUT = Path(__file__).parents[2] / "docs" / "pictures" / "page.png"
_OF_16 = "1k0aaaaaaaaaaaaaaaaaaa"
_WINDOW, _WIDE, _PHONE, _ZOOMED = (1280, 720), (1920, 1080), (390, 844), (640, 360)
_LOOKS = (
    ("light", _WINDOW, False), ("dark", _WINDOW, True), ("wide", _WIDE, False), ("phone", _PHONE, False),
    ("phone dark", _PHONE, True), ("zoomed", _ZOOMED, False),
)  # fmt: skip
_DRAWN = "[...document.querySelectorAll('.plot')].every((plot) => plot.querySelector('canvas'))"
_SETTLED = 2.0
"""Time in s after which the page does not change any more (chosen value)."""


def main(arguments: list[str]) -> None:
    """Draws the requested pictures."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("run", type=Path)
    words.add_argument("--out", type=Path, default=OUT)
    words.add_argument("--all", type=Path)
    options = words.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        site = Site(Path(scratch) / "runs")
        site.kill()
        take(options.run, site.runs)
        if options.all:
            lay(site.runs / _OF_16, options.run, 3000, 20_000, ranks=16)
        try:
            site.start()
            with Browser(Path(scratch) / "profile") as browser:
                _draw(browser, site, options.run.name, options.out)
                if options.all:
                    options.all.mkdir(exist_ok=True, parents=True)
                    _draw_all(browser, site, options.run.name, options.all)
        finally:
            site.process.terminate()
            site.process.wait(60)


def _opened(page: Page, site: Site, run: str) -> Page:
    sign_in(page, site)
    page.go(f"{site.url}#/runs/{run}")
    page.wait(SHOWN)
    time.sleep(_SETTLED)
    return page


def _draw(browser: Browser, site: Site, run: str, out: Path) -> None:
    """Draws the exploded body beside the numbers and a chart."""
    page = _opened(browser.page(1440, 810), site, run)
    page.slide("input[aria-label=explode]", 0.06)
    page.evaluate("scrollTo(0, 0)")
    time.sleep(_SETTLED)
    page.draw(out)
    page.close()


def _draw_all(browser: Browser, site: Site, run: str, folder: Path) -> None:
    for name, size, dark in _LOOKS:
        page = _opened(browser.page(*size, dark=dark, phone=size == _PHONE), site, run)
        page.draw(folder / f"{name}.png")
        _draw_whole(page, folder / f"{name} whole.png")
        page.go(f"{site.url}#/")
        page.wait("document.querySelector('td a.name')")
        page.draw(folder / f"{name} list.png")
        page.go(f"{site.url}#/new?from={run}")
        page.wait("document.body.innerText.includes('This case can be run')")
        page.draw(folder / f"{name} new.png")
        page.close()
    _draw_whole(_opened(browser.page(*_WINDOW), site, _OF_16), folder / "16 ranks.png")


def _draw_whole(page: Page, out: Path) -> None:
    """Draws the page with all charts, also those outside of the window; a heat map of many ranks is drawn in pieces."""
    page.wait(_DRAWN)
    time.sleep(_SETTLED)
    page.draw(out, whole=True)


if __name__ == "__main__":
    main(sys.argv[1:])
