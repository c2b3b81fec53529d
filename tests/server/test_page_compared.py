"""Charts and the comparison of runs in a real browser: a user chooses, reads, saves, sorts and hides, by pointer and by
keyboard.
"""

import csv
import io
from collections.abc import Iterator

import pytest

from conoid.cases.output import layout
from tests.bench.many import lay
from tests.bench.page_compare import alike

from .chromium import Browser, Page, program
from .visitor import Site, sign_in, violations

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(program() is None, reason="no Chromium on this machine"),
]
SAVED = """(async () => {
  const made = [];
  const before = URL.createObjectURL;
  URL.createObjectURL = (blob) => { made.push(blob); return before.call(URL, blob); };
  document.querySelector(%r).click();
  while (!made.length) await new Promise((done) => setTimeout(done, 50));
  URL.createObjectURL = before;
  return made[0].text();
})()"""
PROBES = "[data-card=probes]"
DRAWN = "[...document.querySelectorAll('.charts .plot')].filter((one) => one.querySelector('canvas')).length"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Site, list[str]]]:
    """A server with runs that no solver has computed; twelve of these runs are a sweep."""
    made = Site(tmp_path_factory.mktemp("site") / "runs")
    made.kill()
    ids = lay(made.runs, 40, 1)
    for run in ids:
        for path in (layout.rank_log(made.runs / run, 0), made.runs / run / layout.LOGS / layout.LAUNCHER_LOG):
            path.touch()
    made.start()
    yield made, alike(made.runs, ids, 12)
    made.process.terminate()
    made.process.wait(60)


def chosen(page: Page) -> list[str]:
    found: list[str] = page.evaluate(f"[...document.querySelectorAll('{PROBES} input:checked')].map((b) => b.value)")
    return found


def test_probes_are_chosen_by_key_kept_and_saved(site: tuple[Site, list[str]], browser: Browser) -> None:
    server, runs = site
    page = browser.page(1920, 1080)
    sign_in(page, server)
    page.go(f"{server.url}#/runs/{runs[0]}")
    page.wait(f"document.querySelector('{PROBES} canvas')")
    before = chosen(page)
    page.focus(f"{PROBES} summary")
    page.press("Enter")
    page.wait(f"document.querySelector('{PROBES} details').open")
    page.focus(f"{PROBES} input[value={before[0]}]")
    page.press(" ")
    page.wait(f"!document.querySelector('{PROBES} input[value={before[0]}]').checked")
    page.press("Escape")
    page.wait(f"document.activeElement === document.querySelector('{PROBES} summary')")
    assert chosen(page) == before[1:]
    page.go(f"{server.url}#/")
    page.wait("document.querySelector('table')")
    page.go(f"{server.url}#/runs/{runs[1]}")
    page.wait(f"document.querySelector('{PROBES} canvas')")
    assert chosen(page) == before[1:], "another run of the case has the same choice"
    saved = list(csv.reader(io.StringIO(page.evaluate(SAVED % f"{PROBES} .save button"))))
    whole = list(csv.reader((server.runs / runs[1] / layout.HISTORY).read_text().splitlines()))
    places = [whole[0].index(name) for name in saved[0]]
    assert [name.split(" ")[0] for name in saved[0]] == ["t", *before[1:]]
    assert saved == [[row[place] for place in places] for row in whole]
    picture = page.evaluate(SAVED % f"{PROBES} .save button:nth-child(2)")
    assert picture.startswith("<svg")
    assert before[1] in picture
    assert page.errors == []
    page.close()


def test_twelve_runs_are_distinguished(site: tuple[Site, list[str]], browser: Browser) -> None:
    server, runs = site
    page = browser.page(1280, 720)
    sign_in(page, server)
    page.go(f"{server.url}#/compare/{'/'.join(runs)}")
    page.wait("document.querySelectorAll('table.outcomes tbody tr').length === 12")
    page.wait(f"{DRAWN} > 2")
    assert len(set(page.evaluate("[...document.querySelectorAll('.run-line button')].map((b) => b.innerText)"))) == 12
    swatches = "[...document.querySelectorAll('.run-line .swatch')].map((s) => s.className + getComputedStyle(s).color)"
    assert len(set(page.evaluate(swatches))) == 12, "colour and dashes together"
    title = page.evaluate("document.querySelectorAll('table.outcomes .by-column')[2].dataset.sorts")
    page.click(f"table.outcomes [data-sorts='{title}']")
    page.wait(f"document.activeElement.dataset.sorts === '{title}'")
    cells = page.evaluate(
        "[...document.querySelectorAll('table.outcomes tbody tr')].map("
        "(r) => [r.cells[0].querySelector('.pill') !== null, Number(r.cells[3].innerText)])"
    )
    assert cells == sorted(cells), "results of runs that have not succeeded come last"
    assert {unsure for unsure, _ in cells} == {False, True}
    page.focus(".plot")
    page.press("ArrowRight")
    page.wait("document.querySelectorAll('.readout .number').length === 12")
    page.focus(".run-line button")
    page.press("Enter")
    page.wait("document.querySelector('.run-line button').getAttribute('aria-pressed') === 'false'")
    page.focus(".plot")
    page.press("ArrowRight")
    page.wait("document.querySelectorAll('.readout .number').length === 11")
    rows = list(csv.reader(io.StringIO(page.evaluate(SAVED % ".charts .save button"))))
    assert {row[0] for row in rows[1:]} == set(runs)
    assert page.errors == []
    page.close()


@pytest.mark.parametrize(("dark", "phone"), [(False, False), (True, True)], ids=["light", "dark phone"])
def test_bodies_share_camera_and_clock_and_everybody_can_use_it(
    site: tuple[Site, list[str]], browser: Browser, dark: bool, phone: bool
) -> None:
    server, runs = site
    width, height = (390, 844) if phone else (1280, 720)
    page = browser.page(width, height, dark=dark, phone=phone)
    sign_in(page, server)
    page.go(f"{server.url}#/compare/{'/'.join(runs[-3:])}")
    page.wait("document.querySelectorAll('table.outcomes tbody tr').length === 3")
    page.wait("document.querySelector('.picks input')")
    page.place(".panes")
    page.wait("document.querySelectorAll('.pane canvas').length >= 2")
    page.wait("[...document.querySelectorAll('.pane figcaption')].every((it) => it.innerText.includes('fragment'))")
    if phone:  # A wide window shows three bodies at first.
        page.click(".picks .pick:nth-child(3) input")
    page.wait("document.querySelectorAll('.pane').length === 3")
    page.slide("input[aria-label='simulated time']", 0)
    page.wait("document.querySelector('section[aria-label^=bodies] .note').innerText.startsWith('0 ')")
    page.slide("select[aria-label='section across']", "y")
    assert page.evaluate("[...document.querySelectorAll('.cutting input')].map((one) => one.max > one.min)") == [True]
    page.slide("select[aria-label='colour by']", "speed")
    page.focus(".pane:nth-child(2) canvas")
    page.press("z")
    page.press("e")
    assert page.evaluate("document.querySelector('input[aria-label=\"edges of the mesh\"]').checked")
    assert violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.errors == []
    page.close()
