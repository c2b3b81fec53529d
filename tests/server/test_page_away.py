"""The page's own scripts before a server that is away, comes back, refuses, or has more than is shown; by node."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

WEB = Path(__file__).parents[2] / "client" / "web"
NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="no node on this machine")

RUN = {"id": "a", "name": "bar", "state": "succeeded", "ranks": 1, "submitted": 0, "started": 1, "finished": 2}
LIST = """
    const run = RUN;
    state.served = (path) => ({
        "lib/index.json": { auth: false }, "v1/me": { owner: "ann" }, "v1/runs": answer,
    })[path];
    await load("app.js");
    await pause(50);
    return text(document.getElementById("page"));
""".replace("RUN", json.dumps(RUN))


@pytest.fixture
def web(tmp_path: Path) -> Path:
    """The scripts as modules that node takes."""
    for path in WEB.glob("*.js"):
        shutil.copy(path, tmp_path)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    return tmp_path


def played(web: Path, script: str) -> Any:
    """What the script returns."""
    told = json.dumps({"module": str(web / "app.js"), "script": script})
    command = [str(NODE), str(Path(__file__).with_name("stage.mjs"))]
    done = subprocess.run(command, input=told, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_libraries_are_asked_for_again_when_nobody_answered(web: Path) -> None:
    script = """
        const { three } = await load("libraries.js");
        const first = await three().catch((error) => error.message);
        const place = "data:text/javascript,export const ready = true;";
        state.served = () => ({ three: place });
        return [first, (await three()).ready];
    """
    assert played(web, script) == ["away", True]


def test_a_page_that_was_left_changes_no_title(web: Path) -> None:
    """It waits for a server that is away when somebody goes to another page."""
    script = """
        const { RunPage } = await load("run.js");
        const page = new RunPage("a");
        await pause(100);
        page.close();
        document.title = "the next page";
        await pause(700);
        return document.title;
    """
    assert played(web, script) == "the next page"


@pytest.mark.parametrize("status", [429, 502, 503])
def test_a_run_is_asked_for_again_when_the_server_cannot_answer_now(web: Path, status: int) -> None:
    script = """
        const { RunPage } = await load("run.js");
        state.served = () => %d;
        const page = new RunPage("a");
        await pause(800);
        const seen = [page.abort.signal.aborted, state.asked.filter((path) => path === "v1/runs/a").length > 1];
        page.close();
        return seen;
    """
    assert played(web, script % status) == [False, True]


def test_two_runs_are_read_again_when_the_server_comes_back(web: Path) -> None:
    script = """
        const { PairPage } = await load("pair.js");
        const page = new PairPage(["a", "b"], 100);
        await pause(50);
        const before = text(page.element);
        const history = { series: {}, snapshots: [], elapsed: 0 };
        state.served = (path) => (path.endsWith("history") ? history : path.includes("files") ? 404 : %s);
        await pause(200);
        const after = text(page.element);
        page.close();
        return [before.includes("away"), after.includes("succeeded")];
    """
    assert played(web, script % json.dumps(RUN)) == [True, True]


def test_a_list_says_when_there_are_more_runs(web: Path) -> None:
    more, all_ = "{ runs: [run], next: 'cursor' }", "{ runs: [run], next: null }"
    words = "The newest 1 are shown"
    assert words in played(web, LIST.replace("answer", more))
    assert words not in played(web, LIST.replace("answer", all_))


def test_a_refusal_is_no_silence(web: Path) -> None:
    told = played(web, LIST.replace("answer", "403"))
    assert "the server answered 403" in told
    assert "No answer" not in told
