"""Submission from the page in a real browser: a shipped case, a case with files, the case of a run; a persistent
login.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.load import shipped_path

from .chromium import Browser, Page, program
from .visitor import Site, sign_in, violations

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(1800),
    pytest.mark.skipif(program() is None, reason="no Chromium on this machine"),
]
EDITOR, START = "textarea[aria-label='the case']", "section[aria-label=start] button"
LONG = 600.0
"""Time limit for a short run on a busy machine, s."""


@pytest.fixture
def page(site: Site, browser: Browser) -> Iterator[Page]:
    """The page of a new run with a signed-in user."""
    made = browser.page()
    sign_in(made, site)
    made.go(f"{site.url}#/new")
    made.wait(f'document.querySelector("{EDITOR}") && document.querySelector("option[value=two_tets]")')
    yield made
    assert made.errors == []
    made.close()


def choose(page: Page, *paths: Path) -> None:
    """Chooses files in the page's file dialog."""
    root = page.call("DOM.getDocument")["root"]["nodeId"]
    found = page.call("DOM.querySelector", nodeId=root, selector=".new input[type=file]")["nodeId"]
    page.call("DOM.setFileInputFiles", nodeId=found, files=[str(path) for path in paths])


def replace(page: Page, old: str, new: str) -> None:
    """Replaces the text of the editor as if a user had typed it."""
    page.evaluate(f"""(() => {{
      const area = document.querySelector("{EDITOR}");
      area.value = area.value.replace({json.dumps(old)}, {json.dumps(new)});
      area.dispatchEvent(new Event("input", {{ bubbles: true }}));
    }})()""")


def started(page: Page) -> str:
    """Waits for the page of the run and returns the run's id."""
    page.wait(f"!document.querySelector('{START}').disabled", LONG)
    page.focus(EDITOR)
    page.press("Enter", 2)
    return str(page.wait("/^#.runs.([a-z0-9]{22})$/.exec(location.hash)?.[1]", LONG))


def case_of(site: Site, run: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((site.runs / run / "case.resolved.json").read_text())
    return found


def test_a_shipped_case_is_mended_started_and_started_again_with_changes(site: Site, page: Page) -> None:
    page.slide("select[aria-label^='start from']", "two_tets")
    page.wait("document.body.innerText.includes('This case can be run')", LONG)
    assert violations(page) == []
    replace(page, "end_time", "end_tmie")
    page.wait("document.querySelector('.problems button')", LONG)
    assert "run.end_tmie: unknown key" in page.text(".problems")
    assert page.evaluate(f"document.querySelector('{START}').disabled")
    page.evaluate(
        "[...document.querySelectorAll('.problems button')].find((b) => b.innerText.includes('tmie')).click()"
    )
    marked = "((area) => area.value.slice(area.selectionStart, area.selectionEnd))(document.activeElement)"
    assert page.evaluate(marked).startswith("end_tmie")
    assert page.evaluate("document.querySelector('.numbers .wrong')?.innerText.trim()")
    replace(page, "end_tmie", "end_time")
    page.slide("#new-title", 'A "quoted" title')
    run = started(page)
    assert case_of(site, run)["title"] == 'A "quoted" title'
    page.wait("document.querySelector('.pill.succeeded')", LONG)
    page.go(f"{site.url}#/new?from={run}")
    page.wait(f"document.querySelector(\"{EDITOR}\").value.includes('quoted')", LONG)
    page.slide("#new-ranks", 2)
    again = started(page)
    assert again != run
    assert case_of(site, again)["run"]["ranks"] == 2


def test_a_start_during_the_check_follows_the_check(site: Site, page: Page) -> None:
    page.slide("select[aria-label^='start from']", "two_tets")
    page.wait(f"document.querySelector(\"{EDITOR}\").value.includes('end_time')", LONG)
    page.focus(EDITOR)
    page.press("Enter", 2)
    assert page.evaluate(f"document.querySelector('{START}').innerText") == "Starts after the check"
    run = str(page.wait("/^#.runs.([a-z0-9]{22})$/.exec(location.hash)?.[1]", LONG))
    assert case_of(site, run)["name"] == "two_tets"


def test_a_case_is_sent_with_its_mesh_file_and_opened_again(site: Site, page: Page, tmp_path: Path) -> None:
    text = shipped_path("imported_taylor").read_text()
    text = text.replace('path = "imported_taylor.inp"', 'path = "sub/taylor mine.inp"')
    (tmp_path / "mine.toml").write_text(text.replace('"8e-05 s"', '"1e-06 s"'))
    mesh = shipped_path("imported_taylor").with_suffix(".inp").read_bytes()
    (tmp_path / "taylor mine.inp").write_bytes(mesh)
    (tmp_path / "notes.txt").write_text("no case names it")
    choose(page, tmp_path / "mine.toml")
    page.wait("document.body.innerText.includes('needed: drop it here')", LONG)
    choose(page, tmp_path / "taylor mine.inp", tmp_path / "notes.txt")
    page.wait("document.body.innerText.includes('on the server')", LONG)
    assert "not named by the case" in page.text(".listing")
    run = started(page)
    mesh_told = case_of(site, run)["parts"][0]["mesh"]
    assert (site.runs / run / "files" / f"{mesh_told['sha256']}.inp").read_bytes() == mesh
    assert mesh_told["path"] == "sub/taylor mine.inp"
    page.go(f"{site.url}#/new?from={run}")
    page.wait("document.body.innerText.includes('on the server')", LONG)
    assert started(page) != run


def test_a_sign_in_stays_and_two_tabs_agree(site: Site, browser: Browser) -> None:
    page = browser.page()
    page.go(site.url)
    page.wait("document.querySelector('form.sign-in')")
    page.click(".check input")
    page.write("input[type=password]", site.token)
    page.press("Enter")
    page.wait("document.querySelector('#leave:not([hidden])')")
    other = browser.page(beside=page)
    other.go(f"{site.url}#/new")
    other.wait("document.querySelector('.new')")
    other.click("#leave")
    for one in (page, other):
        one.wait("document.querySelector('form.sign-in')")
        assert one.evaluate("localStorage.length + sessionStorage.length") <= 1
    other.write("input[type=password]", site.token)
    other.press("Enter")
    other.wait("document.querySelector('#leave:not([hidden])')")
    page.go(f"{site.url}?again")
    page.wait("document.querySelector('form.sign-in')")
    for one in (page, other):
        assert one.errors == []
        one.close()
