"""Mistakes of users and damaged files get one line: no traceback, no endless wait, no success."""

import subprocess
import sys
from pathlib import Path

import httpx2
import msgspec
import pytest
from typer.testing import CliRunner, Result

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.client import cli
from conoid.client.cli import app
from conoid.client.commands import sweeping
from conoid.client.errors import ClientError
from conoid.client.local.following import FolderRun
from conoid.client.local.safe_paths import inside
from conoid.client.remote import http
from conoid.client.remote.config import DEFAULT_URL
from conoid.client.remote.session import Session
from conoid.client.sweeps.sweep import SweepInfo


def conoid(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def refused(code: int, *words: object) -> str:
    """Returns the only line of the error output."""
    result = conoid(*words)
    assert result.exit_code == code, repr(result.exception)
    (line,) = result.stderr.splitlines()
    assert line.startswith("conoid: ")
    return line


@pytest.fixture
def damaged(quiet_home: Path) -> Path:
    """A finished run's folder whose files are damaged."""
    folder = quiet_home / "damaged"
    folder.mkdir()
    sent = [messages.Status(run="r", seq=1, state="running"), messages.Status(run="r", seq=3, state="succeeded")]
    lines = [messages.to_json(sent[0]), b"garbage", b'{"type": "progress", "ru', b"[]", messages.to_json(sent[1])]
    (folder / layout.JOURNAL).write_bytes(b"\n".join(lines) + b"\n")
    (folder / layout.OUTCOME).write_text("x")
    (folder / layout.RESOLVED_CASE).write_text("{")
    return folder


# A folder that is none of a run ---------------------------------------------------------------------------------------


def test_a_folder_without_a_run_is_not_followed(quiet_home: Path) -> None:
    Path("empty").mkdir()
    assert refused(1, "watch", "empty") == "conoid: empty has no journal.jsonl"
    (quiet_home / "many" / "one").mkdir(parents=True)
    (quiet_home / "many" / "one" / layout.JOURNAL).touch()
    assert "many is not the folder of a run; it contains the folders of the runs one" in refused(1, "watch", "many")


@pytest.mark.parametrize(
    "words", [("get", "last", "--out", ""), ("get", "last", "--out="), ("sweep", "x.toml", "--list", "")]
)
def test_an_empty_name_of_a_file_is_refused(words: tuple[str, ...], quiet_home: Path) -> None:
    """An option with an empty value, as from an unset variable, would mean the working folder."""
    option = next(word.removesuffix("=") for word in words if word.startswith("--"))
    assert refused(2, *words) == f"conoid: {option} is empty: write the name of a file or a folder"


def test_a_closed_standard_output_is_an_error(quiet_home: Path) -> None:
    words = f"{sys.executable} -m conoid.client.cli materials >&-"
    ended = subprocess.run(["sh", "-c", words], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert ended.stderr == "conoid: standard output is closed; redirect it to a file or to /dev/null\n"


@pytest.mark.parametrize(
    "text",
    [
        "[]", "5", "{", '{"parts": 5}', '{"parts": [5]}', '{"parts": [{}]}',
        '{"boundaries": [{"kind": "wall", "point": 1}]}',
        '{"boundaries": [{"kind": "symmetry", "axis": 7}]}', '{"parts": [{"name": "a", "mesh": []}]}', "[" * 100_000,
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", ["report", "compare"])
def test_a_case_of_another_shape_is_one_line(command: str, text: str, damaged: Path) -> None:
    (damaged / layout.RESOLVED_CASE).write_text(text)
    (damaged / layout.OUTCOME).write_text('{"state": "succeeded"}')
    words = (damaged, damaged) if command == "compare" else (damaged,)
    assert "the case cannot be read" in refused(1, command, *words)


def test_a_link_out_of_a_folder_is_not_read(damaged: Path) -> None:
    """Without the check of links a report could contain a private file of the user who makes the report."""
    (damaged / layout.RESOLVED_CASE).unlink()
    (damaged.parent / "secret").write_text("{}")
    (damaged / layout.RESOLVED_CASE).symlink_to(damaged.parent / "secret")
    assert refused(1, "report", damaged).endswith("the link points to a place outside of the run's folder")


@pytest.mark.parametrize("command", ["watch", "show", "report", "get", "cancel"])
def test_a_path_without_a_run_sends_no_request(command: str, quiet_home: Path) -> None:
    assert refused(1, command, "runs/none") == (
        "conoid: runs/none: this is not the folder of a run; write the folder or the id of a run, or 'last'"
    )


def test_a_server_refuses_a_folder_and_asks_for_an_id(quiet_home: Path) -> None:
    (quiet_home / "runs" / "one").mkdir(parents=True)
    assert refused(2, "restart", "runs/one") == (
        "conoid: run = 'runs/one': this command needs a server; write the id of a run, or 'last'"
    )


@pytest.mark.parametrize(
    "words",
    [
        ("validate", "demo", "--set", "run.ranks=1", "--set", "run.ranks=2"),
        ("submit", "demo", "--set", "run.ranks=1", "--set", "run.ranks=2"),
        ("run", "demo", "--set", "run.ranks=1", "--ranks", "2"),
    ],
)
def test_a_key_that_is_set_twice_is_named(words: tuple[str, ...], quiet_home: Path) -> None:
    assert refused(2, *words) == "conoid: run.ranks = '2': this key is set more than once; give it one value"


@pytest.mark.parametrize(
    "words",
    [
        ("submit", "demo", "--label", "x"), ("submit", "none.toml"), ("sweep", "demo"),
        ("view", ".", "--time", "60"), ("view", ".", "--field", "x"), ("show", ""),
        ("submit", "demo", "--key", ""),
    ],
)  # fmt: skip
def test_a_usage_error_ends_with_2(words: tuple[str, ...], quiet_home: Path) -> None:
    refused(2, *words)


def test_no_file_is_written_into_a_folder_without_a_run(quiet_home: Path) -> None:
    Path("empty").mkdir()
    assert refused(1, "cancel", "empty") == "conoid: empty has no journal.jsonl"
    assert not list(Path("empty").iterdir())


def test_a_run_that_has_ended_is_not_asked_to_stop(damaged: Path) -> None:
    assert conoid("cancel", "damaged").stdout == "damaged has ended\n"
    assert not (damaged / layout.STOP_REQUEST).exists()


def test_a_damaged_journal_is_followed_to_its_end(damaged: Path) -> None:
    assert [message.seq for message in FolderRun(damaged).messages()] == [1, 3]


def test_messages_of_a_folder_are_json_too(damaged: Path) -> None:
    result = conoid("watch", "damaged", "--json")
    assert result.exit_code == 0, repr(result.exception)
    assert [msgspec.json.decode(line)["seq"] for line in result.stdout.splitlines()] == [1, 3]


@pytest.mark.parametrize("command", ["report", "replay-balance"])
def test_a_damaged_case_is_named(damaged: Path, command: str) -> None:
    assert "case.resolved.json: the case cannot be read: " in refused(1, command, "damaged")


# Files ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("sweep", "demo", "--list", "missing.csv"), 2, "--list = 'missing.csv': No such file or directory"),
        (("sweep", "demo", "--list", "."), 2, "--list = '.': is not a regular file"),
        (("run", "demo", "--out", "/proc/none"), 1, "/proc/none: No such file or directory"),
        (("run", "demo", "--out", "file"), 1, "file: File exists"),
    ],
)
def test_a_file_that_cannot_be_used_is_named(quiet_home: Path, words: tuple[str, ...], code: int, message: str) -> None:
    Path("file").touch()
    assert refused(code, *words).endswith(message)


def test_a_table_in_place_of_a_text_is_named(quiet_home: Path) -> None:
    Path("points.csv").write_bytes(b"run.ranks,x\n1,\xff\n")
    assert refused(2, "sweep", "demo", "--list", "points.csv") == "conoid: --list = 'points.csv': not UTF-8 text"


def test_a_time_limit_of_a_read_is_reported_in_one_line(quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def late(*_: object) -> None:
        raise TimeoutError("run x is still running after 30 s")

    monkeypatch.setattr(cli, "data_of", late)
    assert refused(1, "validate", "demo") == "conoid: run x is still running after 30 s"


def test_without_slurm_nothing_is_prepared(quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(quiet_home))
    assert refused(1, "batch", "demo", "--ranks", "1").startswith("conoid: sbatch: not found; ")
    assert not Path("runs").exists()


# Servers and tokens ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("url", ["http://[", "http://[::1", "http://a:b", "http://a b", "http://h:99999", "http://:1"])
def test_an_invalid_address_is_refused_in_one_line(url: str, quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CONOID_URL", url)
    assert (
        refused(2, "ls") == f"conoid: url = {url!r}: write the address with http:// or https://, such as {DEFAULT_URL}"
    )


@pytest.mark.parametrize("token", ["conoid_12ab…", "two words", "line\nfeed"])
def test_a_token_that_no_server_makes_is_not_sent(quiet_home: Path, token: str) -> None:
    line = refused(2, "ls", "--url", "http://127.0.0.1:1", "--token", token)
    assert line == "conoid: token: only visible ASCII characters are allowed; was the token copied completely?"


@pytest.mark.parametrize("key", ["é", "line\nfeed"])
def test_a_key_that_no_header_can_have_is_one_line(quiet_home: Path, key: str) -> None:
    line = refused(2, "submit", "demo", "--key", key, "--url", "http://127.0.0.1:1")
    assert line == f"conoid: Idempotency-Key {key!r}: 1 to 255 visible ASCII characters"


def test_space_round_a_token_is_no_part_of_it() -> None:
    with http.Http("http://x", " conoid_1_2\n") as made:
        assert made._http.headers["authorization"] == "Bearer conoid_1_2"


@pytest.mark.parametrize("words", [("show",), ("watch",), ("cancel",), ("get",), ("report",), ("sweep-table",)])
def test_an_empty_id_is_none(quiet_home: Path, words: tuple[str, ...]) -> None:
    """An unset variable of a shell script gives an empty id."""
    assert "an id, or 'last'" in refused(2, *words, "")


def test_a_file_outside_of_a_run_is_not_fetched(quiet_home: Path) -> None:
    with pytest.raises(ClientError, match=r"^'\.\./x' lies outside the run's folder$"):
        inside(quiet_home, "../x")


@pytest.mark.parametrize(("state", "message"), [("succeeded", "s has ended\n"), ("running", "s cancelling\n")])
def test_an_ended_sweep_is_not_reported_as_cancelled(
    quiet_home: Path, monkeypatch: pytest.MonkeyPatch, state: str, message: str
) -> None:
    class Server(httpx2.BaseTransport):
        def handle_request(self, request: httpx2.Request) -> httpx2.Response:
            info = SweepInfo(id="s", name="bar", submitted=0.0, total=2, states={state: 2})
            return httpx2.Response(202, content=msgspec.json.encode(info))

    monkeypatch.setattr(sweeping, "connect", lambda *_: Session("http://x", transport=Server()))
    assert conoid("sweep-cancel", "s").stdout == message


# Cases ----------------------------------------------------------------------------------------------------------------


def test_a_number_that_cannot_be_computed_with_is_refused(quiet_home: Path) -> None:
    line = refused(2, "validate", "demo", "--set", "parts[0].mesh.element_size='1e-300 m'")
    message = "cannot be used: in SI units it is not between 1e-30 and 1e+30"
    assert line == f"conoid: parts[0].mesh.element_size = '1e-300 m': {message}"
