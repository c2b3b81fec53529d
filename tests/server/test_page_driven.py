"""The page in a real browser: a user watches the demo, hides its parts, stops a run, and opens its report."""

import csv
import json
import time
from pathlib import Path
from statistics import median
from typing import Any

import pytest

from conoid.cases.output import history, layout
from conoid.cases.output import report as form

from .chromium import Browser, Page, program
from .visitor import SHOWN, Site, demo, facts, number, sign_in, violations

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(3600),
    pytest.mark.skipif(program() is None, reason="no Chromium on this machine"),
]
GRID, END_TIME = (64, 14), 60e-6
"""Margins of a chart left and right of its axes, px (charts.js); end time of the demo, s."""
DEMO = 1800.0
"""Time limit of the demo, s. The demo takes one minute on two free cores."""


@pytest.fixture(scope="module")
def watched(site: Site, browser: Browser) -> tuple[str, Page]:
    """The demo run, which the page shows from its start to its end; returns the list of the changes on the page."""
    page = browser.page()
    page.go(site.url)
    page.wait("document.querySelector('form.sign-in')")
    assert (page.errors, [answer for answer in page.answers if answer[0] >= 400]) == ([], [])
    sign_in(page, site)
    page.evaluate("localStorage.setItem('conoid.fold.numbers', 'true')")
    run = site.submit(demo(ranks="2"))
    page.click("td a.name")
    page.wait("document.querySelectorAll('.cards > section').length > 5")
    seen: dict[str, list[Any]] = {"bars": [], "nodes": [], "shown": []}
    until = time.monotonic() + DEMO
    while not page.evaluate("!!document.querySelector('.pill.succeeded, .pill.failed')"):
        assert time.monotonic() < until
        bars = page.evaluate("[...document.querySelectorAll('.ranks .stack i')].map((bar) => bar.style.width).join()")
        for name, value in (("bars", bars), ("nodes", facts(page).get("nodes", "–")), ("shown", page.evaluate(SHOWN))):
            if value and value != "–" and value not in seen[name][-1:]:
                seen[name].append(value)
        time.sleep(0.2)
    page.wait("document.querySelector('table.checks')")
    nodes = [number(text) for text in seen["nodes"]]
    assert len(seen["bars"]) > 5
    assert nodes == sorted(nodes)
    assert nodes[-1] > nodes[0]
    assert len(seen["shown"]) > 3
    assert page.errors == []
    return run, page


def test_events_reach_the_screen_in_time(watched: tuple[str, Page]) -> None:
    """The delays are printed but not limited, because other tests use the same machine."""
    events = watched[1].evaluate("seen.events")
    print(f"\n{len(events)} events, from the journal to the drawn page: median {median(events):.0f} ms")
    assert len(events) > 20


def test_the_page_shows_the_values_of_the_files(site: Site, watched: tuple[str, Page]) -> None:
    run, page = watched
    folder = site.runs / run
    last = sorted((folder / "fragments").glob("fragments_*.csv"))[-1]
    rows = {int(row["label"]): row for row in csv.DictReader(last.read_text().splitlines())}
    table = list(csv.reader((folder / layout.HISTORY).read_text().splitlines()))
    line = dict(zip([history.split(name)[0] for name in table[0]], table[-1], strict=True))
    shown = facts(page)
    page.wait("[...document.querySelectorAll('.plot')].every((plot) => plot.querySelector('canvas'))")
    assert number(shown["fragments"]) == len(rows)
    assert number(shown["step"]) == int(line["step"])
    assert shown["energy residual"] == page.evaluate(f"({line['residual']}).toExponential(1)")
    course = (
        "fetch(`v1/runs/%s/columns?name=kinetic`, { headers: { Authorization: `Bearer %s` } }).then((a) => a.json())"
    )
    columns = page.evaluate(course % (run, site.token))
    assert columns["columns"]["kinetic"]["last"] == columns["values"]["kinetic"][-1] == float(line["kinetic"])
    masses = sorted(((float(row["mass [kg]"]), label) for label, row in rows.items()), reverse=True)
    page.evaluate("[...document.querySelectorAll('.panel summary')].find((e) => e.innerText === 'Fragments').click()")
    page.wait("document.querySelector('.heaviest button')")
    offered = page.evaluate("[...document.querySelectorAll('.heaviest button')].map((button) => button.innerText)")
    assert offered[:5] == [str(label) for _, label in masses[:5]]
    row = rows[masses[1][1]]
    page.evaluate("document.querySelectorAll('.heaviest button')[1].click()")
    picked = facts(page, ".picked .facts")
    assert (picked["fragment"], number(picked["tets"])) == (row["label"], int(row["tets"]))
    assert picked["mass"] == page.evaluate(f"import('./figures.js').then((m) => m.si(1000 * {row['mass [kg]']}, 'g'))")
    assert (picked["birth"] == "at the start") == (int(row["label"]) < 2), "the two bars have the first numbers"


def test_the_body_is_cut_pulled_apart_picked_and_played(watched: tuple[str, Page]) -> None:
    page = watched[1]
    last = int(page.evaluate(SHOWN))
    page.slide("input[aria-label=snapshot]", 0)
    page.wait(f"{SHOWN} === '0'")
    page.click(".scrub button")
    page.wait(f"Number({SHOWN}) > 2")
    page.click(".scrub button")
    page.slide("input[aria-label=snapshot]", last)
    page.wait(f"{SHOWN} === '{last}'")
    page.slide("input[aria-label=explode]", 0.6)
    page.slide("select[aria-label='section across']", "y")
    page.slide("input[aria-label='place of the section']", 0.0005)
    place = "document.querySelector('input[aria-label=\"place of the section\"]').value"
    assert page.text(".place") == page.evaluate(f"import('./figures.js').then((m) => m.si(Number({place}), 'm'))")
    choices = "[...document.querySelector('select[aria-label^=colour]').options].map((o) => o.value)"
    for by in page.evaluate(choices):
        page.slide("select[aria-label='colour by']", by)
    shares = [(0.1 * i, 0.1 * j) for i in range(2, 9) for j in range(3, 8)]
    picked = {}
    for right, down in shares:
        page.click(".view3d canvas", right, down)
        picked = facts(page, ".picked .facts")
        if picked and page.evaluate("!document.querySelector('.picked').hidden"):
            break
    assert {"fragment", "mass", "birth"} <= set(picked)
    frames = page.evaluate("seen.frames")
    assert max(calls for _, _, calls in frames) <= 5, "the body and its section, once more for the lines, the lines"
    assert page.errors == []


def test_a_cut_opens_by_pointer_and_by_key_and_logs_by_rank(site: Site, watched: tuple[str, Page]) -> None:
    page = watched[1]
    cuts = "section[aria-label='balance events']"
    assert page.text(f"{cuts} h2").startswith("Balance ")
    assert {"time", "tets moved", "this cut took", "earlier cuts saved"} <= set(facts(page, f"{cuts} .facts"))
    assert "Work expected after" in page.text(cuts)
    chart = "div.plot[aria-label^='load imbalance']"
    page.place(chart)
    page.wait(f'document.querySelector("{chart} canvas")')
    page.focus(chart)
    page.press("Enter")
    page.wait(f'document.activeElement === document.querySelector("{cuts}")')
    assert page.text(f"{cuts} h2").startswith("Balance 1 of")
    assert click_on_last_cut(site, watched[0], page, chart)
    for rank in ("rank 0", "rank 1", "launcher"):
        page.press("Escape")
        page.evaluate(f"[...document.querySelectorAll('.tab')].find((tab) => tab.innerText === '{rank}').click()")
        page.wait(f"document.querySelector('.tab[aria-selected=true]').innerText === '{rank}'")
    assert page.wait("document.querySelector('#log-lines').innerText.trim()")


def click_on_last_cut(site: Site, run: str, page: Page, chart: str) -> bool:
    """Clicks down the chart at the time of the last balance event until the marker of the event opens."""
    lines = map(json.loads, (site.runs / run / layout.JOURNAL).read_text().splitlines())
    last = [line["t"] for line in lines if line["type"] == "balance"][-1]
    page.evaluate("document.activeElement.blur()")
    width = page.evaluate(f'document.querySelector("{chart}").clientWidth')
    right = (GRID[0] + last / END_TIME * (width - sum(GRID))) / width
    for tenth in range(40):
        page.click(chart, right, 0.1 + 0.02 * tenth)
        if page.evaluate("document.activeElement.ariaLabel === 'balance events'"):
            return (
                page.evaluate("/Balance ([0-9]+) of \\1$/.test(document.activeElement.querySelector('h2').innerText)")
                is True
            )
    return False


def test_buttons_the_age_of_numbers_and_two_runs(site: Site, watched: tuple[str, Page]) -> None:
    done, page = watched
    run = site.submit(demo(ranks="1", end_time='"2 ms"'))
    page.go(f"{site.url}#/runs/{run}")
    page.wait("document.querySelector('.pill.running') && document.querySelector('.ranks .stack')", DEMO)
    for verb in ("Checkpoint", "Snapshot"):
        page.evaluate(f"[...document.querySelectorAll('.side button')].find((b) => b.innerText === '{verb}').click()")
        page.wait(f"document.querySelector('.message')?.innerText.includes('{verb.lower()} asked for')")
    page.wait(f"Number({SHOWN}) > 0", DEMO)
    assert page.errors == []
    port = int(site.url.rsplit(":", 1)[1].strip("/"))
    site.kill()
    page.wait("/numbers .* old/.test(document.querySelector('.link').innerText)", 30)
    site.start(port)
    page.wait("document.querySelector('.link').innerText === 'live'", 60)
    page.errors.clear()  # The browser reports an error for each request that it sent while the server was not running.
    page.evaluate("document.querySelector('button.stop').click()")
    page.wait("document.querySelector('.pill.cancelled')", 120)
    page.go(f"{site.url}#/compare/{done}/{run}")
    page.wait("document.querySelector('table.outcomes tbody tr') && document.querySelector('.plot canvas')")
    assert "end time ms" in page.text("table.outcomes thead")
    place = "[...document.querySelectorAll('table.outcomes th')].findIndex((head) => /end time/.test(head.innerText))"
    ends = f"[...document.querySelectorAll('table.outcomes tbody tr')].map((row) => row.cells[{place}].innerText)"
    assert page.evaluate(ends) == ["0.06", "2"]
    assert page.errors == []


@pytest.mark.parametrize(("dark", "phone"), [(False, False), (True, True)], ids=["light", "dark phone"])
def test_everybody_can_use_it(site: Site, browser: Browser, watched: tuple[str, Page], dark: bool, phone: bool) -> None:
    width, height = (390, 844) if phone else (1280, 720)
    page = browser.page(width, height, dark=dark, phone=phone)
    page.go(site.url)
    page.wait("document.querySelector('form.sign-in')")
    assert violations(page) == []
    sign_in(page, site)
    page.wait("document.querySelector('td a.name')")
    assert violations(page) == []
    page.go(f"{site.url}#/runs/{watched[0]}")
    page.wait(f"document.querySelector('table.checks') && document.querySelector('.plot') && {SHOWN}")
    page.evaluate("document.querySelector('.plot').scrollIntoView()")
    page.wait("document.querySelector('.plot canvas')")
    assert violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.go(f"{site.url}#/")
    page.wait("document.querySelector('td a.name')")
    assert page.errors == []
    page.close()


def test_a_report_needs_no_server(site: Site, browser: Browser, watched: tuple[str, Page], tmp_path: Path) -> None:
    run, asks = watched
    press = "[...document.querySelectorAll('.run-head button')].find(({ innerText }) => innerText === 'Report').click()"
    asks.go(f"{site.url}#/runs/{run}")
    asks.wait("document.querySelector('.run-head .pill.succeeded')")
    asks.evaluate(press)
    asks.wait("document.querySelector('.message').innerText === 'The report is saved.'", 300.0)
    out = tmp_path / "report.html"
    out.write_bytes((site.runs / run / form.NAME).read_bytes())
    site.kill()
    dark = browser.page(390, 844, dark=True)
    dark.go(out.as_uri())
    assert violations(dark) == []
    dark.close()
    page = browser.page()
    page.go(out.as_uri())
    last = int(page.wait(SHOWN))
    page.slide("input[aria-label=snapshot]", 0)
    page.wait(f"{SHOWN} === '0'")
    page.slide("input[aria-label=explode]", 1)
    assert last > 3
    assert "references" in page.text().lower()
    assert violations(page) == []
    assert not [url for _, url in page.answers if url.startswith("http")]
    assert page.errors == []
