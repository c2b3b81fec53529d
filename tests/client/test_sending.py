"""Upload of files from a client to a real server: over slow and broken connections, and from paths that are not
files.
"""

import hashlib
import os
import random
import socket
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from conoid.cases.load import CaseError
from conoid.cases.output import layout
from conoid.cases.reading.files import Named
from conoid.client.cli import app
from conoid.client.errors import ClientError, ServiceError
from conoid.client.local.local_files import Hashes, LocalFile, state_of
from conoid.client.local.own_server import LocalServer
from conoid.client.remote import sending
from conoid.client.remote.session import Session

from .slow_proxy import line_to

CASE = """
name = "bar"
contact = "none"
run.end_time = "1 us"
[[parts]]
name = "bar"
material = "steel"
mesh = { shape = "file", path = "meshes/bar.inp", unit = "1 mm" }
"""
BAR = """*NODE
1, 0, 0, 0
2, 10, 0, 0
3, 0, 10, 0
4, 0, 0, 10
*ELEMENT, TYPE=C3D4, ELSET=All
1, 1, 2, 3, 4
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A case with a mesh file in the same folder."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "bar.inp").write_text(BAR)
    (tmp_path / "bar.toml").write_text(CASE)
    return tmp_path


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sending, "_PAUSE", 0.02)


def file_of(folder: Path, size: int, seed: int = 1) -> Path:
    """Writes a file of random bytes that differs from the files of all other tests."""
    path = folder / f"{seed}.inp"
    path.write_bytes(random.Random(f"{folder} {seed}").randbytes(size))
    return path


def case_with(path: Path | str) -> dict[str, object]:
    mesh = {"shape": "file", "path": str(path), "unit": "1 mm"}
    return {"name": "bar", "parts": [{"name": "bar", "material": "steel", "mesh": mesh}], "run": {"end_time": 1e-6}}


def arrived(server: LocalServer, path: Path) -> bool:
    """Returns True if the server has a copy of the local file."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    there = server.runs / "uploads" / "local" / digest
    return there.exists() and there.read_bytes() == path.read_bytes()


def test_a_file_arrives_over_a_line_that_breaks_again_and_again(
    server: LocalServer, tmp_path: Path, impatient: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sending, "_LARGEST", 1 << 17)
    path = file_of(tmp_path, 3_000_000)
    received: list[str] = []
    cuts = (1000, 200_000, 200_100, 1_000_000, 1_900_000, 2_900_000)
    with line_to(server.session.url, *cuts) as line, Session(line.url, server.token) as session:
        session.outbox.say = received.append
        session.outbox.ready(case_with(path), Path())
        assert line.broken == len(cuts)
        assert line.carried < 3_000_000 + len(cuts) * (1 << 17) + 60_000, "what had arrived was not sent again"
        before = line.carried
        session.outbox.ready(case_with(path), Path())
        assert line.carried < before + 1000, "the server lacks nothing"
    assert arrived(server, path)
    assert received[0] == "sending 1.inp, 0 B of 3.00 MB"


@pytest.mark.slow
def test_a_large_file_arrives_over_a_slow_line_that_breaks(server: LocalServer, tmp_path: Path) -> None:
    """A file of 200 MB is sent at 10 MB/s over a connection that is cut eleven times. After the upload the hash is
    right, and neither the server nor the client has used much memory.
    """
    path, size = tmp_path / "large.inp", 200_000_000
    with path.open("wb") as file:
        made = random.Random(7)
        for _ in range(200):
            file.write(made.randbytes(size // 200))
    assert server._process is not None
    who = [os.getpid(), server._process.pid]
    before = [peak(pid) for pid in who]
    cuts = [1_000_000, *range(20_000_000, size, 20_000_000), size - 1000]
    with line_to(server.session.url, *cuts, rate=10e6) as line, Session(line.url, server.token) as session:
        session.outbox.ready(case_with(path), Path())
        print(f"{line.broken} breaks, {line.carried / 1e6:.1f} MB sent")
        assert line.broken == len(cuts)
    grown = [peak(pid) - had for pid, had in zip(who, before, strict=True)]
    print(f"client and server grew by {grown[0] / 1e6:.1f} and {grown[1] / 1e6:.1f} MB")
    assert max(grown) < 20e6
    digest = server.runs / "uploads" / "local" / sha256sum(path)
    assert digest.stat().st_size == size


def sha256sum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def peak(process: int) -> int:
    """Returns the largest memory that a process has used so far, bytes."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith("VmHWM")).split()[1])


def test_a_slow_line_gets_smaller_pieces(
    server: LocalServer, tmp_path: Path, impatient: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With smaller pieces of a file no answer is late, and a broken connection loses little."""
    monkeypatch.setattr(sending, "_WANTED", 0.05)
    sizes: list[int] = []
    path = file_of(tmp_path, 1_500_000)
    with line_to(server.session.url, rate=1e6) as line, Session(line.url, server.token) as session:
        real = session.put

        def put(kind: type[sending.SentFile], place: str, body: bytes, *more: object) -> sending.SentFile:
            sizes.append(len(body))
            return real(kind, place, body, *more)  # type: ignore[arg-type]

        monkeypatch.setattr(session, "put", put)
        session.outbox.ready(case_with(path), Path())
    assert arrived(server, path)
    assert sizes[0] == sending._FIRST
    assert min(sizes[:-1]) <= sizes[0] / 4


def test_two_that_send_the_same_file_at_once_both_succeed(
    server: LocalServer, tmp_path: Path, impatient: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sending, "_LARGEST", 1 << 16)
    path, failed = file_of(tmp_path, 2_000_000), list[BaseException]()

    def bring() -> None:
        try:
            with Session(server.session.url, server.token) as session:
                session.outbox.ready(case_with(path), Path())
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=bring) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not failed
    assert arrived(server, path)


def test_a_server_that_is_killed_in_the_middle_goes_on_when_it_is_started_again(
    tmp_path: Path, impatient: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sending, "_LARGEST", 1 << 18)
    path, parts = file_of(tmp_path, 4_000_000), tmp_path / "runs" / "uploads" / "local"
    first = LocalServer(tmp_path / "runs", 2).__enter__()
    with line_to(first.session.url, rate=4e6) as line, Session(line.url, first.token) as session:
        sender = threading.Thread(target=session.outbox.ready, args=(case_with(path), Path()))
        sender.start()
        while not any(part.stat().st_size > 1_000_000 for part in parts.glob("*.part")):
            assert sender.is_alive()
        assert first._process is not None
        first._process.kill()
        first._process.wait()
        (part,) = parts.iterdir()
        assert 1_000_000 < part.stat().st_size < 4_000_000
        with LocalServer(tmp_path / "runs", 2) as second:
            line.server = int(second.session.url.rpartition(":")[2])
            sender.join(60)
            assert not sender.is_alive()
            assert line.carried < 4_000_000 + 3 * (1 << 18) + 60_000, "it went on with what it had"
            assert arrived(second, path)
    first.session.close()


def test_a_file_that_changes_after_it_was_hashed_is_refused(server: LocalServer, tmp_path: Path) -> None:
    """A file that changes before sending is detected by the client, which compares the state of the file. A file that
    changes during sending has another hash: the server refuses the file and stores nothing.
    """
    path = file_of(tmp_path, 2_500_000)
    (local,) = Hashes().of(case_with(path), Path())
    path.write_bytes(path.read_bytes() + b"x")
    with pytest.raises(
        ClientError, match=r"1\.inp: the file changed while it was read; nothing was submitted: try again$"
    ):
        sending.send(server.session, local)
    (local,) = Hashes().of(case_with(path), Path())

    def meddle(text: str) -> None:
        if "0 B" not in text:
            with path.open("r+b") as file:
                file.seek(2_400_000)
                file.write(b"?")

    with pytest.raises(ClientError, match="changed while it was read"):
        sending.send(server.session, local, meddle)
    assert not list((server.runs / "uploads" / "local").glob(f"{local.sha256}*"))


def unusable(folder: Path, kind: str) -> str:
    """A path in a case at which there is no file that can be sent."""
    path = folder / kind.replace(" ", "-")
    match kind:
        case "a pipe":
            os.mkfifo(path)
        case "a link to a device":
            path.symlink_to("/dev/zero")
        case "a link to itself":
            path.symlink_to(path)
        case "a folder":
            path.mkdir()
        case "a socket":
            with socket.socket(socket.AF_UNIX) as made:
                made.bind(str(path))
        case "a device":
            return "/dev/zero"
        case "memory":
            return "/proc/self/mem"
        case "a link to nothing":
            path.symlink_to("nowhere")
        case "no name":
            return "a\0b"
    return str(path)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("a pipe", "is not a regular file"), ("a link to a device", "is not a regular file"),
        ("a link to itself", "is not a regular file"), ("a folder", "is not a regular file"),
        ("a socket", "is not a regular file"), ("a device", "is not a regular file"), ("memory", "Input/output error"),
        ("a link to nothing", "no such file"), ("nothing", "no such file"), ("no name", "embedded null byte"),
    ],
)  # fmt: skip
def test_a_path_that_is_not_a_file_is_refused_in_one_line(folder: Path, kind: str, message: str) -> None:
    """The client refuses the wrong path before any request to a server, and does not hang."""
    with Session("http://127.0.0.1:9") as session, pytest.raises(CaseError) as raised:
        session.submit(case_with(unusable(folder, kind)))
    (problem,) = raised.value.problems
    assert problem.key == "parts[0].mesh.path"
    assert problem.message.startswith(message)
    assert "\n" not in str(problem)


def test_a_link_to_a_file_is_followed_and_a_wrong_hash_is_reported(folder: Path) -> None:
    (folder / "link.inp").symlink_to(folder / "meshes" / "bar.inp")
    digest = hashlib.sha256(BAR.encode()).hexdigest()
    case = case_with("link.inp")
    (local,) = Hashes().of(case, folder)
    assert local.sha256 == digest
    case["parts"][0]["mesh"]["sha256"] = "0" * 64  # type: ignore[index]
    with pytest.raises(CaseError, match=rf"^parts\[0\]\.mesh\.sha256 = '0{{64}}': 'link\.inp' has {digest}$"):
        Hashes().of(case, folder)


def conoid(*words: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, result.stdout.strip(), result.stderr


def test_commands_send_what_a_case_names(server: LocalServer, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths in a case are relative to the folder of the case; a point of a sweep may have a separate file.

    A copied run's folder can be submitted again without the original mesh file.
    """
    monkeypatch.setenv("CONOID_URL", server.session.url)
    monkeypatch.setenv("CONOID_TOKEN", server.token)
    (folder / "meshes" / "other.inp").write_text(BAR.replace("10, 0, 0\n", "11, 0, 0\n"))
    hashes = [hashlib.sha256((folder / "meshes" / name).read_bytes()).hexdigest() for name in ("bar.inp", "other.inp")]
    code, run, printed = conoid("submit", folder / "bar.toml")
    assert code == 0, printed
    assert [path.name for path in (server.runs / run / layout.FILES).iterdir()] == [f"{hashes[0]}.inp"]
    names = "parts[0].mesh.path=meshes/bar.inp,meshes/other.inp"
    code, sweep, printed = conoid("sweep", folder / "bar.toml", "--set", names, "--wait")
    assert code == 0, printed
    points = server.session.find_sweep(sweep).status().points
    copies = [next((server.runs / point.run.id / layout.FILES).iterdir()).stem for point in points]
    assert copies == hashes
    assert "parts[0].mesh.sha256" not in points[0].values
    assert conoid("get", run, "--out", folder / "here")[0] == 0
    (folder / "meshes" / "bar.inp").unlink()
    server.session.delete(f"/v1/files/{hashes[0]}")
    code, again, printed = conoid("submit", folder / "here" / "case.json")
    assert code == 0, printed
    assert (server.runs / again / layout.FILES / f"{hashes[0]}.inp").read_text() == BAR


def test_a_refusal_is_shown_in_the_words_of_the_server(server: LocalServer, tmp_path: Path) -> None:
    """A file that the server has refused is not sent again."""
    path = tmp_path / "large.inp"
    with path.open("wb") as file:
        file.truncate(5 << 30)  # a sparse file, which uses no disk space
    with path.open("rb") as file:
        local = LocalFile(Named((), "large.inp", None), path, "0" * 64, state_of(file.fileno()))
    with pytest.raises(ServiceError, match=r"^the file has 5\.37 GB; this server allows 4\.29 GB$") as raised:
        sending.send(server.session, local)
    assert raised.value.status == 413
