"""A person before the page, played in a real browser: signs in, watches the demo break, takes it apart, stops a run."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

import httpx2
import pytest

from conoid.cases import history, layout
from conoid.server.store import Store
from conoid.server.tokens import create_token

from .chromium import Browser, Page, program

pytestmark = [pytest.mark.slow, pytest.mark.skipif(program() is None, reason="no Chromium on this machine")]
ROOT = Path(__file__).parents[2]
WEB = ROOT / "client" / "web"
DEMO_CASE = ROOT / "cases" / "shipped" / "glass_steel_demo.toml"
SHOWN = "document.querySelector('section[data-shown]')?.dataset.shown"
GRID, END_TIME = (64, 14), 60e-6
"""px of a chart left and right of its axes (charts.js); s of the demo."""
DEMO = 900.0
"""s that the demo may take: it takes one minute on two free cores."""


class Site:
    """A server in a process of its own, with a token."""

    def __init__(self, runs: Path) -> None:
        """``runs`` is the folder of the runs."""
        self.runs = runs
        runs.mkdir()
        store = Store(f"sqlite:///{runs / 'server.sqlite'}")
        self.token = create_token(store, "ann", frozenset({"read", "submit"}))
        store.close()
        self.start()

    def start(self, port: int = 0) -> None:
        """Starts it; ``url`` is where."""
        command = [sys.executable, "-m", "conoid.server", "--runs", str(self.runs), "--port", str(port)]
        self.process = subprocess.Popen([*command, "--no-zenoh", "--web", str(WEB)], start_new_session=True)
        address = self.runs / "server.json"
        until = time.monotonic() + 60
        while not (address.exists() and json.loads(address.read_text())["pid"] == self.process.pid):
            assert time.monotonic() < until
            time.sleep(0.1)
        self.url = json.loads(address.read_text())["url"] + "/"

    def submit(self, text: str) -> str:
        """The id of a new run."""
        headers = {"Authorization": f"Bearer {self.token}", "Content-Type": "application/toml"}
        answer = httpx2.post(f"{self.url}v1/runs", content=text, headers=headers)
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"])

    def kill(self) -> None:
        """Kills the server; its workers go on."""
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    made = Site(tmp_path_factory.mktemp("site") / "runs")
    yield made
    made.process.terminate()
    made.process.wait(60)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("profile")) as running:
        yield running


def demo(**changes: str) -> str:
    """The case of ``make demo``; with other values of some lines."""
    text = DEMO_CASE.read_text()
    for name, value in changes.items():
        old = next(line for line in text.splitlines() if line.startswith(f"{name} = "))
        text = text.replace(old, f"{name} = {value}")
    return text


def sign_in(page: Page, site: Site) -> None:
    page.go(site.url)
    page.wait("document.querySelector('form.sign-in')")
    page.write("input[type=password]", site.token)
    page.press("Enter")
    page.wait("document.querySelector('.brand') && document.querySelector('table.runs')")


def facts(page: Page, place: str = ".card .facts") -> dict[str, str]:
    """Names and values of a list of facts."""
    names = json.dumps(f"{place} dt")
    script = f"[...document.querySelectorAll({names})].map((e) => [e.innerText, e.nextSibling.innerText])"
    return dict(page.evaluate(script))


def number(text: str) -> int:
    return int(text.replace("\u202f", ""))


@pytest.fixture(scope="module")
def watched(site: Site, browser: Browser) -> tuple[str, Page]:
    """The demo, watched to its end: what moved is told by the list of what was seen."""
    page = browser.page()
    page.go(site.url)
    page.wait("document.querySelector('form.sign-in')")
    assert (page.errors, [told for told in page.answers if told[0] >= 400]) == ([], [])
    sign_in(page, site)
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
    """The time is told, not judged: it is that of the machine, which the run has for itself in no test."""
    events = watched[1].evaluate("seen.events")
    print(f"\n{len(events)} events, from the journal to the drawn page: median {median(events):.0f} ms")
    assert len(events) > 20


def test_what_is_shown_is_what_the_files_say(site: Site, watched: tuple[str, Page]) -> None:
    run, page = watched
    folder = site.runs / run
    last = sorted((folder / "fragments").glob("fragments_*.csv"))[-1]
    rows = {int(row["label"]): row for row in csv.DictReader(last.open())}
    told = list(csv.reader((folder / layout.HISTORY).open()))
    line = dict(zip([history.split(name)[0] for name in told[0]], told[-1], strict=True))
    shown = facts(page)
    assert number(shown["fragments"]) == len(rows)
    assert number(shown["step"]) == int(line["step"])
    assert shown["residual"] == page.evaluate(f"({line['residual']}).toExponential(1)")
    assert f"kinetic {float(line['kinetic']):.0f} J" in page.text(".cards")
    masses = sorted(((float(row["mass [kg]"]), label) for label, row in rows.items()), reverse=True)
    offered = page.evaluate("[...document.querySelector('select[aria-label=fragment]').options].map((o) => o.text)")
    assert [text.split("(")[1] for text in offered[1:6]] == [f"{label})" for _, label in masses[:5]]
    row = rows[masses[1][1]]
    page.slide(
        "select[aria-label=fragment]", page.evaluate("document.querySelector('select[aria-label=fragment]')[2].value")
    )
    picked = facts(page, ".facts.row")
    assert (picked["fragment"], number(picked["tets"])) == (row["label"], int(row["tets"]))
    assert picked["mass"] == page.evaluate(f"import('./figures.js').then((m) => m.si(1000 * {row['mass [kg]']}, 'g'))")
    assert picked["birth"].endswith("s")


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
    page.slide("input[aria-label='place of the section']", 0.4)
    choices = "[...document.querySelector('select[aria-label^=colour]').options].map((o) => o.value)"
    for by in page.evaluate(choices):
        page.slide("select[aria-label='colour by']", by)
    shares = [(0.1 * i, 0.1 * j) for i in range(2, 9) for j in range(3, 8)]
    picked = {}
    for right, down in shares:
        page.click(".view3d canvas", right, down)
        picked = facts(page, ".facts.row")
        if picked and page.evaluate("!document.querySelector('.facts.row').hidden"):
            break
    assert {"fragment", "mass", "birth"} <= set(picked)
    frames = page.evaluate("seen.frames")
    assert max(calls for _, _, calls in frames) <= 2
    assert page.errors == []
