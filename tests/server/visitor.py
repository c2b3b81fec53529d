"""User of the page: the server, and actions and readings of the page that several tests need."""

import json
import os
import signal
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import httpx2

from conoid.server.database.store import Store
from conoid.server.requests.tokens import create_token

from .chromium import Page

ROOT = Path(__file__).parents[2]
WEB = ROOT / "client" / "web"
DEMO_CASE = ROOT / "cases" / "shipped" / "glass_steel_demo.toml"
CUTS = '\n[balance]\npolicy = "every"\nevery = 150\n'
"""Balance policy with regular cuts: the charts have markers, for any balance of the loads."""
SHOWN = "document.querySelector('section[data-shown]')?.dataset.shown"
"""JavaScript expression for the number of the snapshot on the screen."""
OWNER = "ann"
"""User of a site, with a token."""
STANDARDS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]


class Site:
    """A server in a separate process, with a token."""

    def __init__(self, runs: Path) -> None:
        """Prepares a server; ``runs`` is the folder of the runs."""
        self.runs = runs
        runs.mkdir()
        store = Store(f"sqlite:///{runs / 'server.sqlite'}")
        self.token = create_token(store, OWNER, frozenset({"read", "submit"}))
        store.close()
        self.start()

    def start(self, port: int = 0) -> None:
        """Starts the server, whose address is ``url``."""
        command = [sys.executable, "-m", "conoid.server", "--runs", str(self.runs), "--port", str(port)]
        self.process = subprocess.Popen([*command, "--no-zenoh", "--web", str(WEB)], start_new_session=True)
        address = self.runs / "server.json"
        until = time.monotonic() + 60
        while not (address.exists() and json.loads(address.read_text())["pid"] == self.process.pid):
            assert time.monotonic() < until
            time.sleep(0.1)
        self.url = json.loads(address.read_text())["url"] + "/"

    def submit(self, text: str, query: str = "") -> str:
        """Submits a run and returns the id of the run."""
        headers = {"Authorization": f"Bearer {self.token}", "Content-Type": "application/toml"}
        answer = httpx2.post(f"{self.url}v1/runs?{query}", content=text, headers=headers, timeout=60)
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"])

    def kill(self) -> None:
        """Kills the server; the workers of the server continue."""
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()


def demo(**changes: str) -> str:
    """Returns the case of ``make demo`` with regular cuts and other values in some lines; a key that the case does not
    have is added to the table ``run``.
    """
    text = DEMO_CASE.read_text()
    for name, value in changes.items():
        old = next((line for line in text.splitlines() if line.startswith(f"{name} = ")), "")
        new = f"{name} = {value}"
        text = text.replace(old, new, 1) if old else text.replace("[run]", f"[run]\n{new}", 1)
    return text + CUTS


def sign_in(page: Page, site: Site) -> None:
    page.go(site.url)
    page.wait("document.querySelector('form.sign-in')")
    page.write("input[type=password]", site.token)
    page.press("Enter")
    page.wait("document.querySelector('.brand') && document.querySelector('table.runs')")


def facts(page: Page, place: str = ".card .facts") -> dict[str, str]:
    """Returns the names and values of a list of facts on the page."""
    names = json.dumps(f"{place} dt")
    script = f"[...document.querySelectorAll({names})].map((e) => [e.innerText, e.nextSibling.innerText])"
    return dict(page.evaluate(script))


def number(text: str) -> int:
    return int(text.replace("\u202f", ""))


def violations(page: Page) -> list[str]:
    """Returns the findings of axe-core for the levels A and AA, each with the rule, the number of places, and the first
    place.
    """
    source = Path(str(metadata.distribution("axe-playwright-python").locate_file("axe_playwright_python/axe.min.js")))
    page.evaluate(source.read_text(encoding="utf-8") + "; true")
    found: list[dict[str, Any]] = page.evaluate(
        f"axe.run({{ runOnly: {json.dumps(STANDARDS)} }}).then((report) => report.violations)"
    )
    return [f"{one['id']}: {len(one['nodes'])} places, {one['nodes'][0]['html'][:120]}" for one in found]
