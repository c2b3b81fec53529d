"""Scripts of the page in node with a server that is not reachable, becomes reachable again, refuses, or sends more data
than the page shows.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

WEB = Path(__file__).parents[2] / "client" / "web"
NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="no node on this machine")

RUN = {
    "id": "a", "name": "bar", "title": "A bar", "state": "succeeded", "ranks": 1, "threads": 1, "submitted": 0,
    "started": 1, "finished": 2, "labels": {}, "case": None, "values": {}, "results": None, "references": 0,
    "missed": [], "message": "", "cause": None,
}  # fmt: skip
LIST = """
    const run = RUN;
    state.served = (path) => ({
        "lib/index.json": { auth: false }, "v1/me": { owner: "ann" }, "v1/table": answer,
        "v1/sweeps": { sweeps: [], next: null },
    })[path];
    await load("app.js");
    await pause(100);
    return text(document.getElementById("page"));
""".replace("RUN", json.dumps(RUN))


@pytest.fixture
def web(tmp_path: Path) -> Path:
    """The scripts of the page as modules that node can import."""
    for path in WEB.glob("*.js"):
        shutil.copy(path, tmp_path)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    return tmp_path


def played(web: Path, script: str) -> Any:
    """Runs a script in node and returns the result of the script."""
    question = json.dumps({"module": str(web / "app.js"), "script": script})
    command = [str(NODE), str(Path(__file__).with_name("stage.mjs"))]
    done = subprocess.run(command, input=question, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_libraries_are_requested_again_after_a_missing_answer(web: Path) -> None:
    script = """
        const { three } = await load("libraries.js");
        const first = await three().catch((error) => error.message);
        const place = "data:text/javascript,export const ready = true;";
        state.served = () => ({ three: place });
        return [first, (await three()).ready];
    """
    message, ready = played(web, script)
    assert re.fullmatch(r"the server has not answered since \d\d:\d\d:\d\d", message)
    assert ready


def test_a_page_that_was_left_changes_no_title(web: Path) -> None:
    """The page waits for a server that is not reachable, and the user opens another page."""
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


def test_runs_are_compared_when_the_server_comes_back(web: Path) -> None:
    script = """
        const { ComparePage } = await load("compare.js");
        const page = new ComparePage(["a", "b", "c"], 100);
        await pause(50);
        const before = text(page.element);
        const columns = { columns: {}, values: {}, lines: 0 };
        const known = { columns, history: { series: { t: [] } }, snapshots: { snapshots: [] } };
        const run = (id) => ({ ...%s, id });
        state.served = (path) => {
            const [, , id, what] = path.split("/");
            return what === "files" ? 404 : known[what] ?? run(id);
        };
        await pause(300);
        const after = text(page.element);
        page.close();
        const shown = ["3 runs", "Add a chart", "Values that differ"].every((words) => after.includes(words));
        return [before.includes("The server has not answered since"), shown];
    """
    assert played(web, script % json.dumps(RUN)) == [True, True]


def listing(*runs: str) -> str:
    """Returns the JSON of an answer of GET /v1/table with the given runs."""
    return f"{{ runs: [{', '.join(runs)}], cases: [], pending: 0, next: null }}"


def test_an_empty_list_of_runs_explains_how_to_begin(web: Path) -> None:
    assert "conoid submit taylor_copper" in played(web, LIST.replace("answer", listing()))
    shown = played(web, LIST.replace("answer", listing("run")))
    assert "conoid submit" not in shown
    assert "1 run" in shown
    assert "bar" in shown


def test_a_refusal_is_distinguished_from_a_missing_answer(web: Path) -> None:
    problem = played(web, LIST.replace("answer", "403"))
    assert "the server answered 403" in problem
    assert "No answer" not in problem


def test_a_page_whose_server_is_away_comes_back_by_itself(web: Path) -> None:
    script = """
        const soon = globalThis.setTimeout;
        globalThis.setTimeout = (work, ms) => soon(work, Math.min(ms, 40));
        await load("app.js");
        await pause(30);
        const before = text(document.getElementById("page"));
        const answers = { "lib/index.json": { auth: false }, "v1/me": { owner: "ann" } };
        state.served = (path) => answers[path] ?? { runs: [] };
        await new Promise((done) => soon(done, 300));
        return [before.includes("The server does not answer"), text(document.getElementById("who"))];
    """
    assert played(web, script) == [True, "ann"]


def test_a_token_lasts_for_the_tab_or_until_the_user_signs_out(web: Path) -> None:
    script = """
        [globalThis.sessionStorage, globalThis.localStorage] = [store(), store()];
        const { token } = await load("token.js");
        const seen = () => [token.get(), sessionStorage.kept.size, localStorage.kept.size];
        const views = [];
        token.set("one");
        views.push(seen());
        token.set("two", true);
        views.push(seen());
        token.clear();
        views.push(seen());
        for (const name of ["localStorage", "sessionStorage"])
            Object.defineProperty(globalThis, name, { get() { throw new Error("refused"); } });
        token.set("three", true);
        return [...views, token.get()];
    """
    assert played(web, script) == [["one", 1, 0], ["two", 1, 1], ["", 0, 0], "three"]


ENDED = {
    **RUN,
    "state": "failed",
    "cause": "node",
    "message": "tet 7 is inside out",
    "outcome": {"warnings": ["a", "c"]},
}


def test_the_page_of_an_ended_run_shows_its_cause_and_warnings(web: Path) -> None:
    """The warnings on the page are those of the whole log and of the outcome. Each warning is shown once, for any time
    at which the page is opened.
    """
    log = [{"type": "log", "seq": 1, "level": "warning", "text": each, "wall": 1.0} for each in "aba"]
    history = {"series": {}, "snapshots": [], "log": log, "warnings": log[:2], "last": 3, "state": "failed"}
    script = """
        const { RunPage } = await load("run.js");
        const [run, history] = %s;
        const file = (path, size) => ({ path, size, url: `/v1/${path}` });
        const files = { files: [file("checkpoints/000000120/manifest.json", 5), file("history.csv", 2e6)] };
        const answers = { "v1/runs/a": run, "v1/runs/a/history": history, "v1/runs/a/files": files };
        state.served = (path) => answers[path] ?? 404;
        const page = new RunPage("a");
        await pause(300);
        const shown = [page.situation.element, page.warnings.list, page.logs.lines, page.files.list].map(text);
        page.close();
        return shown;
    """
    situation, warnings, log_shown, files = played(web, script % json.dumps([ENDED, history]))
    assert "Failed: a process or a machine of the run has failed" in situation
    assert "tet 7 is inside out" in situation
    assert "Continue from step 120" in situation
    assert warnings.split() == ["a", "b", "c"]
    assert log_shown.split()[1::2] == ["a", "b", "a"]
    assert "2.00 MB" in files


def test_a_run_that_has_used_up_its_steps_goes_on_with_more(web: Path) -> None:
    script = """
        const { RunState } = await load("runstate.js");
        state.served = (path) => path.endsWith(":restart") ? { id: "b" } : 404;
        const point = { path: "checkpoints/000000500/manifest.json" };
        const shown = new RunState("a", async () => [point]);
        const one = { state: "timed_out", cause: "steps", message: "", snapshots: [], finished: { steps: 500 } };
        const asked = [];
        const real = fetch;
        globalThis.fetch = (url, options) => { asked.push(new URL(url).search); return real(url, options); };
        await shown.fill(one);
        const button = shown.restart(500, one);
        await button.onclick?.();
        return [text(shown.element), text(button), asked.at(-1)];
    """
    cause, button, asked = played(web, script)
    assert button in cause
    assert button == "Continue from step 500 with run.max_steps = 1000"
    assert asked == "?max_steps=1000"


def test_a_page_by_a_short_id_waits_for_the_server(web: Path) -> None:
    """The server is not reachable when the page is opened by its address, and finds the run later."""
    script = """
        const soon = globalThis.setTimeout;
        globalThis.setTimeout = (work, ms) => soon(work, Math.min(ms ?? 0, 40));
        const here = { "lib/index.json": { auth: false }, "v1/me": { owner: "ann" } };
        state.served = (path) => { if (path in here) return here[path]; throw new Error("away"); };
        location.hash = "#/runs/1k1ffx9";
        let went = "";
        location.replace = (address) => { went = address; };
        await load("app.js");
        await pause(100);
        const page = document.getElementById("page");
        const before = text(page);
        const { RunPage } = await load("run.js");
        const shown = new RunPage("a");
        await pause(100);
        const unread = text(shown.element);
        shown.close();
        here["v1/runs"] = { runs: [{ id: "1k1ffx9000000000000000" }] };
        await new Promise((done) => soon(done, 300));
        return [before, unread, went];
    """
    before, unread, went = played(web, script)
    assert "The server does not answer" in before
    assert "No data of this run has been read yet" in unread
    assert not any(words in unread for words in ("accepted", "taken in", "0.0 %", "0 %", "no such run"))
    assert went.endswith("1k1ffx9000000000000000")


def test_results_of_runs_that_have_not_succeeded_are_marked_and_come_last(web: Path) -> None:
    script = """
        const { columnsOf } = await load("columns.js");
        const { sorted } = await load("sorting.js");
        const { ResultTable } = await load("resulttable.js");
        const states = ["failed", "succeeded", "running", "succeeded"];
        const rows = states.map((state, i) => ({ ...RUN, id: String(i), state, results: new Map([["probe.speed",
            i < 1 ? 0 : 10 - i]]) }));
        const column = columnsOf(rows, [], new Map([["probe.speed", "m/s"]])).find(({
            id }) => id === "result:probe.speed");
        const ids = (down) => sorted(rows, column, down).map(({ id }) => id).join("");
        const sheet = new ResultTable();
        sheet.draw(rows.map(({ state }, i) => ({ name: String(i), href: "", line: i, state })), [], () => [{
            title: "speed", unit: "", values: [0, 9, 8, 7], text: String }]);
        const orders = [false, true].map((down) => { Object.assign(sheet, { by: "speed", down });
            return sheet.order().join(""); });
        return [ids(false), ids(true), ...orders, rows.map((row) => column.unsure(row))];
    """.replace("RUN", json.dumps(RUN))
    assert played(web, script) == ["3102", "1320", "3102", "1320", [True, False, True, False]]


def test_a_file_that_two_parts_name_is_one_file(web: Path) -> None:
    script = """
        const { NewPage } = await load("new.js");
        const page = new NewPage(new URLSearchParams(), () => {});
        page.editor.text = "x";
        page.checks = { valid: false, problems: ["a", "b"].map((part) => ({ key: `${part}.sha256`,
            message: "lacks it" })),
            files: ["a", "b"].map((key) => ({ key, path: "bullet.step", sha256: "" })) };
        page.checked = page.editor.text;
        page.draw();
        const shown = [text(page.startButton), text(page.files).split("bullet.step").length - 1,
            page.problems(page.checks.files).length];
        page.close();
        return shown;
    """
    assert played(web, script) == ["Waits for 1 file", 1, 0]


def test_numbers_beside_a_failure_are_those_of_the_outcome(web: Path) -> None:
    script = """
        const { RunState } = await load("runstate.js");
        const { Numbers } = await load("numbers.js");
        const { Live } = await load("live.js");
        const energy = { residual: 6.4e-8 };
        const live = Object.assign(new Live("a"), { state: "failed", cause: "energy", progress: { t: 3.42e-7,
            end_time: 1e-6, step: 14, energy } });
        const outcome = { cause: "energy", steps: 20, time: 5.11e-7, energy, worst_residual: 1.02e-6, made: [{
            line: "contact", share: 0.25, time: 5e-7 }] };
        const [shown, numbers] = [new RunState("a", async () => []), new Numbers()];
        shown.draw(live, outcome);
        numbers.draw(live, {}, outcome);
        await pause(50);
        return [text(shown.element), text(numbers.element)];
    """
    cause, numbers = played(web, script)
    assert "511 ns of 1.00 µs, step 20" in cause
    assert "contact: 2.5e-1 of the largest energy" in cause
    assert "dt_safety" not in cause
    assert "511" in numbers
    assert "1.0e-6" in numbers
    assert "6.4e-8" not in numbers


@pytest.mark.parametrize(
    ("problem", "words"),
    [
        ({"status": 404, "title": "Not Found"}, "There is no such run"),
        (
            {"status": 410, "title": "Gone", "outcome": {"state": "failed", "cause": "mesh"}},
            "It ended as failed (mesh)",
        ),
    ],
)
def test_the_page_of_a_missing_run_explains_the_reason(web: Path, problem: dict[str, Any], words: str) -> None:
    script = """
        const { RunPage } = await load("run.js");
        const { Problem } = await load("api.js");
        const page = new RunPage("a");
        const problem = %s;
        page.fail(new Problem(problem.status, problem));
        return text(page.element);
    """
    assert words in played(web, script % json.dumps(problem))


def test_a_case_is_checked_when_typing_stops_and_started_once(web: Path) -> None:
    script = """
        const { NewPage } = await load("new.js");
        const valid = { valid: true, problems: [], warnings: [], estimate: {}, files: [] };
        const [keys, checks] = [[], []];
        let away = false;
        state.served = (path, { body, headers }) => {
            if (path === "v1/cases") return { cases: [] };
            if (away) throw new Error("away");
            if (path === "v1/cases:validate") checks.push(body);
            else keys.push(headers["Idempotency-Key"]);
            return path === "v1/runs" ? { id: "b" } : valid;
        };
        const page = new NewPage(new URLSearchParams(), () => {});
        const type = (words) => {
            page.editor.area.value = words;
            page.typed();
        };
        ["a", "ab", "abc"].forEach(type);
        const before = page.startButton.disabled;
        await pause(800);
        const after = page.startButton.disabled;
        away = true;
        await page.start();
        const message = text(page.status);
        away = false;
        await page.start();
        await page.start();
        type("abcd");
        await page.start();
        page.close();
        return [checks, before, after, message, new Set(keys).size, keys.length, location.hash];
    """
    checks, before, after, status, keys, starts, place = played(web, script)
    assert (checks, before, after) == (["abc"], True, False)
    assert re.match(r"The server has not answered since [0-9:]{8}\. The text stays in the editor\.", status)
    assert (keys, starts) == (2, 3), "the same case has the same key, another one another"
    assert place == "#/runs/b"


def test_a_file_goes_on_where_the_connection_broke(web: Path) -> None:
    script = """
        const { sendFile } = await load("sending.js");
        const file = new Blob([new Uint8Array(3 * 2 ** 20).fill(7)]);
        const soon = globalThis.setTimeout;
        globalThis.setTimeout = (work, ms) => soon(work, Math.min(ms, 5));
        const [spans, sizes] = [[], []];
        let there = 0;
        state.served = (path, { method, headers }) => {
            if (method !== "PUT") return { files: there ? [{ sha256: "ab", offset: there, whole: false }] : [] };
            const [, first, last] = /bytes ([0-9]+)-([0-9]+)/.exec(headers["Content-Range"]).map(Number);
            spans.push(first);
            if (spans.length === 2) {
                there += 1000; // As much has arrived when the connection breaks.
                throw new Error("away");
            }
            if (spans.length === 3) return 503;
            there = last + 1;
            return { offset: there, whole: there === file.size };
        };
        await sendFile(file, "ab", (bytes) => sizes.push(bytes));
        return [spans, there, sizes.at(-1)];
    """
    piece = 2**20
    starts = [0, piece, piece + 1000, piece + 1000, 2 * piece + 1000]
    assert played(web, script) == [starts, 3 * piece, 3 * piece]


def test_a_closed_chart_and_the_one_beside_the_body_are_the_same_at_the_next_visit(web: Path) -> None:
    script = """
        globalThis.localStorage = store();
        globalThis.CSS = { escape: (one) => one };
        const { Cards } = await load("cards.js");
        const made = () => {
            const cards = new Cards("energy");
            for (const name of ["energy", "dt", "counts"]) cards.add(name, name, "");
            cards.place();
            return cards;
        };
        const names = (place) => place.children.map((card) => card["data-card"]).join();
        const seen = ({ beside, grid, shelf }) => [names(beside), names(grid), text(shelf)];
        const first = made();
        const views = [seen(first)];
        first.close("dt");
        first.move("counts");
        views.push(seen(made()));
        globalThis.localStorage = null;
        first.close("counts");
        return [...views, seen(first)];
    """
    assert played(web, script) == [
        ["energy", "dt,counts", "Closed"], ["counts", "energy", "Closed + dt"], ["", "energy", "Closed + dt + counts"],
    ]  # fmt: skip


def test_the_list_states_that_the_server_does_not_answer_and_what_works(web: Path) -> None:
    """Before the first answer there is no toolbar; afterwards the runs stay, and the text ends with an answer."""
    script = """
        const { RunsPage } = await load("runs.js");
        const page = new RunsPage();
        await pause(20);
        const first = [page.tools.element.hidden, text(page.note)];
        state.served = (path) => (path === "v1/table" ? LISTED : { sweeps: [], next: null });
        await page.turn();
        state.served = () => { throw new Error("away"); };
        await page.turn();
        const second = [page.tools.element.hidden, text(page.note)];
        state.served = (path) => (path === "v1/table" ? LISTED : { sweeps: [], next: null });
        await page.turn();
        page.close();
        return [first, second, page.note.hidden];
    """.replace("LISTED", listing(json.dumps(RUN)))
    first, second, silent = played(web, script)
    away = r"The server has not answered since [0-9:]{8}\."
    again = r"The request is repeated every 6 s\."
    assert first[0]
    assert re.fullmatch(f"{away} {again}", first[1])
    assert not second[0]
    assert re.fullmatch(
        rf"{away} The runs are shown as they were read last; filters and sorting work\. {again}", second[1]
    )
    assert silent
