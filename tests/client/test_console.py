"""Titles, messages and names are printed as text by all commands."""

import ast
import io
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.panel import Panel
from rich.table import Table
from rich.text import Text
from typer.testing import CliRunner, Result

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.client.cli import app
from conoid.client.commands.console import PlainConsole, one_line, plain

from .hostile import EVIL, OBEYED, Hostile, answering, hostile, run_info

CLIENT = Path(__file__).parents[2] / "client"
SEQUENCES = ["\x1b]0;owned\x07", "\x1b[2J", "\x9b31m", "\x1b]52;c;cm0=\x07", "a\rb", "\x08\x08", "\u202egnp.exe"]


@pytest.fixture
def server(quiet_home: Path) -> Iterator[Hostile]:
    with hostile() as made:
        yield made


def conoid(server: Hostile, *words: str) -> Result:
    return CliRunner().invoke(app, [*words, "--url", server.url])


def obeyed(text: str) -> set[str]:
    """Returns the characters of a text that a terminal would execute or not show."""
    return OBEYED & set(text)


@pytest.mark.parametrize("evil", [*SEQUENCES, EVIL])
def test_control_characters_are_escaped(evil: str) -> None:
    out = io.StringIO()
    console = PlainConsole(file=out, force_terminal=True, color_system="truecolor", width=80)
    table = Table(title=evil)
    table.add_column(evil)
    table.add_row(Text(f"a {evil} b", style="bold"), evil)
    for thing in (evil, Text(evil), Panel(evil, title=Text(evil)), table):
        console.print(thing)
    printed = out.getvalue()
    assert evil not in printed
    assert not obeyed(printed) - {"\x1b"}
    assert "\x1b[" in printed, "its own colours stay"


def test_a_line_of_text_stays_as_it_is() -> None:
    text = "210 m/s, µs, °, tab\tand\nline\r\nüñ漢字 🙂 [0] a\\b"
    assert plain(text) == text
    assert one_line("one\ntwo\r\nthree") == "one\\ntwo\\nthree"


def test_half_a_character_is_escaped() -> None:
    """The name of the case file is not valid UTF-8."""
    assert plain("a\udce4b") == "a\\udce4b"


def test_an_escape_is_right_in_json() -> None:
    assert json.loads(plain(json.dumps(EVIL, ensure_ascii=False))) == EVIL


def test_one_module_prints() -> None:
    """The command ``render`` is excepted, because another program reads its output."""
    printing = {"print", "typer.echo", "typer.secho", "Console"}
    found = {
        path.name
        for path in CLIENT.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in printing
    }
    assert found == {"console.py", "render.py", "__main__.py"}


TABLE = f"{EVIL},run,state\n".encode()
TEXTS = dict.fromkeys(("owner", "name", "message", "reason", "title", "cause"), EVIL)
RUN = run_info(**TEXTS, labels={EVIL: EVIL})
ROW = {**RUN, "short": EVIL, "case": 0, "values": {"x": EVIL}, "results": None, "references": 2, "missed": [EVIL]}
ALIKE = {"values": {"x": 1.0, EVIL: EVIL}, "units": {"x": EVIL}, "results": []}
ASKED = {
    "/v1/runs": {"runs": [RUN], "next": None},
    "/v1/table": {"runs": [ROW, {**ROW, "values": {}}], "cases": [ALIKE], "pending": 0, "next": None},
    "/v1/runs/a": RUN,
    "/v1/runs/a/files": {"files": [{"path": EVIL.replace("\0", ""), "size": 1}]},
    "/v1/runs/a:cancel": RUN,
    "/v1/sweeps/b": {"id": "b", "name": EVIL, "submitted": 0.0, "total": 0, "states": {}, "points": []},
}


@pytest.mark.parametrize(
    "words",
    [
        ("runs",), ("runs", "--json"), ("show", "a"), ("show", "a", "--json"), ("show", "last"), ("cancel", "a"),
        ("cancel", "a", "--json"), ("get", "a", "--json"), ("get", "a"), ("get", "a", "none"), ("sweep-table", "b"),
        ("checkpoint", "a"), ("submit", "demo"), ("view", "a"), ("report", "a"), ("compare", "a", "a"),
    ],
)  # fmt: skip
def test_no_command_prints_control_characters(words: tuple[str, ...], server: Hostile) -> None:
    refusal = answering({"title": EVIL, "detail": EVIL, "hint": EVIL}, 409)
    server.answers = {path: answering(data) for path, data in ASKED.items()}
    server.answers |= {
        "/v1/sweeps/b/table": answering(TABLE, kind="text/csv"),
        "/v1/runs/a:checkpoint": refusal,
    }
    if words[0] == "submit":
        server.answers["/v1/runs"] = refusal
    result = conoid(server, *words)
    assert result.exception is None or isinstance(result.exception, SystemExit), repr(result.exception)
    assert not obeyed(result.output)
    assert result.output.strip()
    if "--json" in words and words[0] != "get":
        answer = json.loads(result.stdout)
        assert (answer[0] if isinstance(answer, list) else answer)["message"] == EVIL


@pytest.mark.parametrize("more", [(), ("--json",), ("--plain",)])
def test_a_folder_prints_no_control_characters(more: tuple[str, ...], quiet_home: Path) -> None:
    folder = quiet_home / "run\x1b[31m"
    folder.mkdir()
    journal: list[messages.AnyMessage] = [
        messages.Status(run=EVIL, seq=1, state="running", message=EVIL),
        messages.Log(run=EVIL, seq=2, level="error", text=f"one\nconoid: two {EVIL}"),
        messages.Status(run=EVIL, seq=3, state="failed", message=EVIL, cause="crash"),
    ]
    (folder / layout.JOURNAL).write_bytes(b"".join(messages.to_json(each) + b"\n" for each in journal))
    (folder / layout.RESOLVED_CASE).write_text(json.dumps({"title": EVIL}))
    result = CliRunner().invoke(app, ["watch", str(folder), *more])
    assert result.exit_code == 1, repr(result.exception)
    assert not obeyed(result.output)
    assert not any(line.startswith("conoid: two") for line in result.output.splitlines())


def test_words_that_are_no_command_are_escaped(quiet_home: Path) -> None:
    for words in (["\x1b[31m"], ["ls", "--\x1b[31m"], ["ls", "--state", "\x1b[31m"]):
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 2
        assert "\x1b[31m" not in result.output
