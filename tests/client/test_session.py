"""Requests and refusals of the client, with answers of a transport in the process of the test."""

import errno
import json
import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest

from conoid.cases.load import CaseError
from conoid.cases.reading.problems import ConoidError
from conoid.client.errors import AnswerError, ClientError, NotFoundError, ServiceError, UnreachableError, UsageError
from conoid.client.local.safe_paths import inside
from conoid.client.remote.config import DEFAULT_URL, target
from conoid.client.remote.session import Session
from conoid.client.remote.submission import body_of
from conoid.client.result import Result
from conoid.client.run import Run

Answer = Callable[[httpx2.Request], httpx2.Response]
RECEIPT = {"id": "r1", "owner": "ann", "name": "bar", "state": "accepted", "ranks": 1, "submitted": 1.0}


def served(answer: Answer, token: str | None = "conoid_1_secret") -> Session:
    return Session("http://conoid.test", token, transport=httpx2.MockTransport(answer))


def problem(status: int, **body: Any) -> Answer:
    return lambda _: httpx2.Response(status, json={"title": "Bad", "status": status, **body})


@pytest.fixture(autouse=True)
def _no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conoid.client.remote.http.time.sleep", lambda _: None)


def test_a_damaged_file_of_a_server_is_named_by_its_run() -> None:
    """The message contains the name of the run, not the path of its local copy, which no longer exists when a user
    reads the message.
    """
    session = served(lambda _: httpx2.Response(200, content=b"{"))
    for name, noun in (("case.resolved.json", "case"), ("outcome.json", "outcome")):
        with pytest.raises(ClientError, match=f"^{name} of run r1 at http://conoid.test: the {noun} cannot be read: "):
            _ = Run(session, "r1").result().case if noun == "case" else Run(session, "r1").result().outcome


@pytest.mark.parametrize(("overrides", "message"), [("run.ranks=2", "'run.ranks=2'"), (5, "5")])
def test_one_text_is_no_list_of_assignments(overrides: Any, message: str) -> None:
    """In an earlier version the text was read letter by letter."""
    with pytest.raises(
        CaseError, match=rf"^overrides = {message}: write a list of assignments, such as \['run.ranks=2'\]"
    ):
        body_of("demo", overrides)


@pytest.mark.parametrize("case", [None, 5, ["demo"]])
def test_a_file_that_is_not_a_case_is_reported(case: Any) -> None:
    with pytest.raises(
        CaseError, match=r"^case = .*: a case must be a file, the name of a shipped case, or plain data$"
    ):
        body_of(case)


def test_labels_are_names_with_values_and_one_state_is_a_list_of_one() -> None:
    asked: list[str] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        asked.append(request.url.query.decode())
        return httpx2.Response(200, json={"runs": []})

    session = served(answer)
    with pytest.raises(UsageError, match=r"^labels = a list: allowed: names with values, such as"):
        session.submit("demo", labels=["a=b"])  # type: ignore[arg-type]
    assert session.runs(states="succeeded") == session.runs(states=["succeeded"]) == []
    assert asked == ["limit=50&state=succeeded"] * 2


def test_a_refusal_is_its_detail_and_hint() -> None:
    session = served(problem(403, detail="the token lacks the scope 'submit'", hint="ask the operator"))
    with pytest.raises(ServiceError) as caught:
        session.me()
    assert str(caught.value) == "the token lacks the scope 'submit' (ask the operator)"
    assert (caught.value.status, caught.value.exit_code, caught.value.retryable) == (403, 1, False)


@pytest.mark.parametrize(
    ("token", "message"),
    [
        (None, "no token was sent: set CONOID_TOKEN"),
        ("conoid_1_old", "the server does not have the token of --token, CONOID_TOKEN or the"),
    ],
)
def test_a_token_that_is_missing_or_wrong_names_where_it_comes_from(token: str | None, message: str) -> None:
    answer = problem(401, detail="this needs a valid token", hint="send the header 'Authorization: Bearer <token>'")
    session = served(answer, token)
    with pytest.raises(ServiceError) as caught:
        session.me()
    assert str(caught.value).startswith(f"this needs a valid token (server {session.url}: {message}")
    assert "header" not in str(caught.value)


def test_a_refused_case_lists_every_error() -> None:
    errors = [
        {"key": "run.ranks", "value": "9", "message": "this server has 2 slots"},
        {"key": "parts[0].mesh", "value": "", "message": "this key is missing"},
    ]
    session = served(problem(422, detail="run.ranks = 9: this server has 2 slots (and 1 more)", errors=errors))
    with pytest.raises(CaseError) as caught:
        session.submit({"name": "bar"})
    problems = list(map(str, caught.value.problems))
    assert problems == ["run.ranks = 9: this server has 2 slots", "parts[0].mesh: this key is missing"]


def test_a_missing_file_is_the_same_error_locally_and_on_a_server(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError):
        Result.open(tmp_path / "nothing")
    with pytest.raises(NotFoundError, match="there is none") as caught:
        served(problem(404, detail="run 'x': there is none")).run("x").status()
    assert isinstance(caught.value, ServiceError)
    assert all(issubclass(each, ConoidError) for each in (CaseError, NotFoundError, ServiceError, UnreachableError))


def test_an_answer_without_problem_json_is_one_line() -> None:
    with pytest.raises(ServiceError, match=r"^the server answered 502$") as caught:
        served(lambda _: httpx2.Response(502, text="<html>Bad gateway</html>")).me()
    assert caught.value.retryable
    with pytest.raises(UnreachableError, match="cannot be read"):
        served(lambda _: httpx2.Response(200, text="<html>Welcome</html>")).me()


def test_a_missing_server_is_reported_with_the_command_that_starts_one() -> None:
    with Session("http://127.0.0.1:1") as session, pytest.raises(UnreachableError) as caught:
        session.me()
    hint = "is a server running there? (conoid serve; another address: CONOID_URL or --url)"
    assert str(caught.value) == f"no answer from http://127.0.0.1:1: {hint}"


def test_a_submission_is_tried_again_with_the_same_key() -> None:
    keys: list[str | None] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        keys.append(request.headers.get("Idempotency-Key"))
        if len(keys) < 3:
            raise httpx2.ReadError("connection reset")
        return httpx2.Response(202, json=RECEIPT)

    assert served(answer).submit({"name": "bar"}).id == "r1"
    assert len(keys) == 3
    assert keys[0]
    assert set(keys) == {keys[0]}


def test_a_cancel_is_sent_once() -> None:
    sent: list[str] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        sent.append(str(request.url))
        raise httpx2.ReadError("connection reset")

    with pytest.raises(UnreachableError, match="connection reset"):
        Run(served(answer), "r1").cancel()
    assert sent == ["http://conoid.test/v1/runs/r1:cancel"]


def test_the_token_is_shown_and_nothing_else_with_it() -> None:
    seen: list[httpx2.Request] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        seen.append(request)
        return httpx2.Response(200, json={"owner": "ann"})

    assert served(answer).me().zenoh is None
    assert seen[0].headers["Authorization"] == "Bearer conoid_1_secret"
    served(answer, token=None).me()
    assert "Authorization" not in seen[1].headers


def test_lists_are_read_page_by_page() -> None:
    def answer(request: httpx2.Request) -> httpx2.Response:
        page = {"a": ("r2", None)}.get(request.url.params.get("cursor", ""), ("r1", "a"))
        assert request.url.params["state"] == "queued,running"
        return httpx2.Response(200, json={"runs": [{**RECEIPT, "id": page[0]}], "next": page[1]})

    assert [run.id for run in served(answer).runs(["queued", "running"])] == ["r1", "r2"]


def test_an_outcome_with_a_missing_number_is_read() -> None:
    check = {"name": "contact_time", "value": None, "expected": 1.0, "tolerance": 0.1, "pass": False}
    ended = {**RECEIPT, "state": "failed", "outcome": {"state": "failed", "reference": [check]}}
    outcome = served(lambda _: httpx2.Response(200, json=ended)).run("r1").status().outcome
    assert outcome is not None
    assert math.isnan(outcome.reference[0].value)
    assert served(lambda _: httpx2.Response(200, json=RECEIPT)).run("r1").status().outcome is None


def test_a_download_that_arrives_damaged_is_not_kept(tmp_path: Path) -> None:
    answer = httpx2.Response(200, content=b"abc", headers={"Repr-Digest": "sha-256=:AAAA:"})
    with pytest.raises(UnreachableError, match="arrived damaged"):
        Run(served(lambda _: answer), "r1").download(tmp_path, "outcome.json")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["../x", "/etc/passwd", "a/../../x", ""])
def test_a_file_name_cannot_leave_the_folder(name: str, tmp_path: Path) -> None:
    with pytest.raises(ClientError, match="outside"):
        inside(tmp_path, name)


# The case that is sent ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("elsewhere", ["http://evil.test/v1/runs/r1/files/a", "/v1/runs/r2/files/a", ""])
def test_files_are_fetched_only_from_addresses_of_the_server(tmp_path: Path, elsewhere: str) -> None:
    """A file name that is not valid UTF-8 is shown as text; its address contains the exact bytes."""
    asked: list[str] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        asked.append(str(request.url))
        files = [
            {"path": "a\\xffb", "size": 1, "url": "/v1/runs/r1/files/a%FFb"},
            {"path": "a b", "size": 1, "url": elsewhere},
        ]
        return httpx2.Response(200, json={**RECEIPT, "files": files})

    served(answer).run("r1").download(tmp_path)
    assert asked == [
        f"http://conoid.test/v1/runs/r1{name}" for name in ("", "", "/files", "/files/a%FFb", "/files/a%20b")
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a b", "a\\xffb"]


def test_a_download_for_which_there_is_no_room_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> Iterator[bytes]:
        yield b"x"
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    session = served(lambda _: httpx2.Response(200, content=b"x"))
    monkeypatch.setattr(session, "_chunks", full)
    with pytest.raises(OSError, match="No space left on device") as raised:
        Run(session, "r").download(tmp_path, "a.csv")
    assert raised.value.filename == str(tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())


def test_a_file_is_sent_as_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "bar.toml"
    path.write_text("# a comment\nname = 'bar'\n")
    assert body_of(path) == ("application/toml", b"# a comment\nname = 'bar'\n")


def test_a_shipped_case_is_named_and_overridden(quiet_home: Path) -> None:
    (quiet_home / "demo").mkdir()
    kind, body = body_of("demo", ["run.ranks=1", "run.end_time=5 us"])
    assert kind == "application/json"
    assert json.loads(body)["run"]["ranks"] == 1
    assert json.loads(body)["run"]["end_time"] == "5 us"


@pytest.mark.parametrize(
    ("source", "message"),
    [("dmeo", "did you mean 'demo'"), ("nothing.toml", "cannot read this file"), ("README.md", r"ends in \.toml or")],
)
def test_text_that_is_not_a_case_is_refused(source: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        body_of(source)


# Where the server is --------------------------------------------------------------------------------------------------


def save(home: Path, text: str) -> None:
    path = home / "config" / "conoid" / "client.toml"
    path.parent.mkdir(parents=True)
    path.write_text(text)


def test_options_come_before_environment_before_file(quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert (target().url, target().token) == (DEFAULT_URL, None)
    save(quiet_home, 'url = "http://site:1/"\ntoken = "from-file"\n')
    assert (target().url, target().token) == ("http://site:1", "from-file")
    monkeypatch.setenv("CONOID_TOKEN", "from-environment")
    assert target().token == "from-environment"
    assert target(token="given").token == "given"


def test_a_saved_token_is_not_shown_to_another_server(quiet_home: Path) -> None:
    save(quiet_home, 'url = "http://site:1"\ntoken = "from-file"\n')
    assert target("http://elsewhere:1").token is None


@pytest.mark.parametrize(
    ("text", "message"),
    [("url = 3", "allowed keys: url and token"), ("key = 'x'", "allowed keys"), ("url = ", "cannot be read")],
)
def test_a_wrong_configuration_names_the_file(quiet_home: Path, text: str, message: str) -> None:
    save(quiet_home, text)
    with pytest.raises(ClientError, match=rf"client\.toml.*{message}"):
        target()


def test_an_address_needs_its_scheme(quiet_home: Path) -> None:
    with pytest.raises(ClientError, match="http://"):
        target("localhost:8750")


def test_errors_of_the_worker_are_in_the_same_tree() -> None:
    from conoid.worker import errors

    with pytest.raises(ConoidError, match="slipped"):
        raise errors.MeshError("the mesh has slipped")


def listing(size: int, state: str = "succeeded") -> Answer:
    """Returns a fake server that lists a file of the given size and sends three bytes."""

    def answer(request: httpx2.Request) -> httpx2.Response:
        if request.url.path.endswith("/files"):
            return httpx2.Response(200, json={"files": [{"path": "a.csv", "size": size, "url": ""}]})
        if request.url.path.endswith("a.csv"):
            return httpx2.Response(200, content=b"abc")
        return httpx2.Response(200, json=RECEIPT | {"state": state})

    return answer


def test_a_file_that_is_not_as_large_as_it_is_listed_is_refused(tmp_path: Path) -> None:
    run = Run(served(listing(5)), "r1")
    (file,) = run.files()
    with pytest.raises(AnswerError, match=r"a.csv has 3 bytes instead of the 5"):
        run.fetch(tmp_path, file, run.over())
    with pytest.raises(AnswerError, match=r"a.csv has 3 bytes instead of the 5"):
        run.download(tmp_path)
    assert not list(tmp_path.iterdir())
    for fits in (Run(served(listing(3)), "r1"), Run(served(listing(5, "running")), "r1")):
        (file,) = fits.files()
        assert fits.fetch(tmp_path, file, fits.over()).read_bytes() == b"abc"


@pytest.mark.parametrize(("seconds", "times"), [(0.0, 3), (30.0, 1)])
def test_a_server_that_hangs_is_asked_once(seconds: float, times: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an earlier version the client waited 93 s for a server that never answers."""
    asked, clock = [0], [0.0]
    monkeypatch.setattr("conoid.client.remote.http.time.monotonic", lambda: clock[0])

    def answer(_: httpx2.Request) -> httpx2.Response:
        asked[0] += 1
        clock[0] += seconds
        raise httpx2.ReadTimeout("timed out")

    with pytest.raises(UnreachableError, match=r"no answer from http://conoid\.test"):
        served(answer).me()
    assert asked == [times]


def test_an_empty_name_of_a_case_is_reported() -> None:
    for name in ("", " "):
        with pytest.raises(CaseError, match=r"^case = '': the name is empty: write a .toml or .json file, or the name"):
            body_of(name)
