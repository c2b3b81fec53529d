"""Command line of the server: one line for each error, tokens, one server for each folder."""

import mmap
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from conoid.cases.estimates.cores import usable_cores
from conoid.server.__main__ import main
from conoid.server.database.engine import StoreError
from conoid.server.database.store import Store
from conoid.server.launch import Access, Job, LaunchError, processes
from conoid.server.launch.local import binding, environment, find_mpiexec
from conoid.server.requests.tokens import check_token
from conoid.server.settings import Settings, SettingsError, loopback

from .running import MakeProcess

Printed = Callable[..., tuple[int, str, str]]


@pytest.fixture
def say(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Printed:
    """Runs the command on a separate folder; returns exit code, output and errors."""

    def run(*arguments: str) -> tuple[int, str, str]:
        code = main(["--runs", str(tmp_path / "runs"), *arguments])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--host", "0.0.0.0", "--no-auth"], "--no-auth with --host 0.0.0.0: allowed only on a loopback address"),
        (["--slots", "0"], "--slots 0: at least one core"),
        (["--port", "70000"], "--port 70000: 0 (any free port) to 65535"),
        (["--web", "/no/such/folder"], "--web /no/such/folder: there is no such folder"),
        (["--grace", "0"], "--grace 0.0: a number of seconds above 0"),
        (["--worker", "'"], '--worker "\'": No closing quotation'),
        (["--mpiexec", "'"], '--mpiexec "\'": No closing quotation'),
        (["--mpiexec", " "], "--mpiexec '': a command is needed"),
        (["--mpiexec", "/no/such/mpiexec -n"], "--mpiexec /no/such/mpiexec: there is no such program"),
        (["--worker", "nosuch -m worker"], "--worker nosuch: there is no such program"),
        (["--grace", "nan"], "--grace nan: a number of seconds above 0"),
        (["--max-queued", "-1"], "--max-queued -1: above 0"),
        (["--max-wall-time", "nan"], "--max-wall-time nan: above 0"),
        (["--max-core-seconds", "inf"], "--max-core-seconds inf: above 0, finite"),
    ],
)
def test_an_invalid_argument_is_one_line(say: Printed, arguments: list[str], words: str) -> None:
    code, out, err = say(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"conoid.server: {words}")
    assert err.count("\n") == 1


def test_a_port_that_is_taken(say: Printed) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        message = say("--port", port)
        assert message[::2] == (1, f"conoid.server: --host 127.0.0.1 --port {port}: Address already in use\n")
        message = say("--port", "0", "--zenoh-port", port)
        assert message[0] == 1
        taken_too = (
            f"the Zenoh router cannot listen on port {port}: address already in use; --zenoh-port 0 takes a free one"
        )
        assert message[2] == f"conoid.server: {taken_too}\n"


def test_a_failed_command_ends_with_1(say: Printed, tmp_path: Path) -> None:
    assert say("--host", "192.0.2.1")[::2] == (
        1, "conoid.server: --host 192.0.2.1 --port 8750: Cannot assign requested address\n"
    )  # fmt: skip
    (tmp_path / "file").touch()
    assert say("--runs", str(tmp_path / "file"))[::2] == (1, f"conoid.server: {tmp_path}/file: File exists\n")


@pytest.mark.parametrize(("url", "code"), [("sqlite:////no/folder/x", 1), ("nonsense", 2), ("postgresql+none://x", 2)])
def test_a_database_that_cannot_be_opened(url: str, code: int) -> None:
    with pytest.raises(StoreError, match="the database cannot be opened") as raised:
        Store(url)
    assert "\n" not in str(raised.value)
    assert raised.value.exit_code == code


def test_tokens(say: Printed, tmp_path: Path) -> None:
    code, out, err = say("token", "add", "ann", "--scopes", "read")
    assert code == 0
    assert (
        err == f"conoid.server: {tmp_path}/runs/server.sqlite is new: the token is valid at a server with this --runs\n"
    )
    assert say("token", "add", "ben", "--scopes", "read, submit")[::2] == (0, "")
    store = Store(f"sqlite:///{tmp_path}/runs/server.sqlite")
    found = check_token(store, out.strip())
    assert found is not None
    assert (found.owner, found.scopes) == ("ann", frozenset({"read"}))
    listed = say("token", "list")[1].splitlines()[0]
    assert listed.split()[:3] == [found.id, "ann", "read"]
    assert out.strip().split("_", 2)[2] not in listed
    assert say("token", "revoke", found.id)[0] == 0
    assert check_token(store, out.strip()) is None
    assert found.id not in say("token", "list")[1]
    assert say("token", "revoke", found.id)[::2] == (
        2,
        f"conoid.server: token '{found.id}': there is none; 'token list' shows all\n",
    )
    store.close()


@pytest.mark.parametrize("asked", [("list",), ("revoke", "0123456789")])
def test_a_folder_without_tokens_is_named_and_not_made(
    asked: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["token", *asked, "--runs", "elsewhere"]) == 2
    message = f"conoid.server: --runs {tmp_path}/elsewhere: no server has used this folder, and it has no tokens\n"
    assert capsys.readouterr().err == message
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a/b"], "a name starts with"),
        (["ann", "--scopes", ""], "unknown scope ''; known: read, submit"),
        (["ann", "--scopes", "read,rule"], "unknown scope 'rule'; known: read, submit"),
    ],
)
def test_tokens_that_cannot_be(say: Printed, arguments: list[str], words: str) -> None:
    code, out, err = say("token", "add", *arguments)
    assert (code, out) == (2, "")
    assert words in err


def test_one_server_a_folder(process: MakeProcess) -> None:
    first = process("--no-zenoh")
    address = first.start()
    assert address["pid"] == first.child.pid if first.child else False
    assert address["zenoh"] is None
    second = subprocess.run(
        [sys.executable, "-m", "conoid.server", "--runs", str(first.runs), "--port", "0", "--no-zenoh"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert second.returncode == 1
    assert (
        second.stderr == f"conoid.server: --runs {first.runs}: another server or 'conoid run' uses this folder; "
        "wait until it ends, or choose another folder\n"
    )
    assert first.end(signal.SIGINT) == 0


@pytest.mark.parametrize(
    ("host", "own"),
    [("127.0.0.1", True), ("127.8.8.8", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("a.b", False)],
)
def test_loopback(host: str, own: bool) -> None:
    assert loopback(host) is own


def test_settings_guard_themselves_without_the_command_line(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="--no-auth"):
        Settings(runs=tmp_path, host="0.0.0.0", auth=False)


# The launch -----------------------------------------------------------------------------------------------------------


def job(ranks: int, telemetry: Access | None = None) -> Job:
    return Job("r1", ranks, Path("case.toml"), Path("."), telemetry)


def test_crowded_ranks_sleep_while_they_wait() -> None:
    assert "MPIR_CVAR_ENABLE_HEAVY_YIELD" not in environment({}, job(4 * usable_cores() - 1))
    assert environment({}, job(4 * usable_cores()))["MPIR_CVAR_ENABLE_HEAVY_YIELD"] == "1"
    chosen = {"MPIR_CVAR_ENABLE_HEAVY_YIELD": "0"}
    assert environment(chosen, job(1000))["MPIR_CVAR_ENABLE_HEAVY_YIELD"] == "0"


def test_ranks_that_take_the_whole_machine_get_cores_of_their_own() -> None:
    assert binding(2, 2, [0, 1, 4, 5]) == ["-bind-to", "user:0+1,4+5"]
    assert binding(4, 1, [0, 1, 2, 3]) == binding(1, 4, [0, 1, 2, 3]) == []
    assert binding(2, 2, list(range(8))) == [], "another run may have the rest"


def test_the_environment_of_a_worker() -> None:
    access = Access("tcp/127.0.0.1:7447", "conoid/v1/ann/r1", "worker.ann", "secret")
    env = environment({"PATH": "/bin", "OMP_NUM_THREADS": "8", "CONOID_TOKEN": "x"}, job(1, access))
    assert (env["PATH"], env["OMP_NUM_THREADS"], env["CONOID_RUN"]) == ("/bin", "1", "r1")
    assert (env["CONOID_ZENOH_USER"], env["CONOID_ZENOH_PASSWORD"]) == ("worker.ann", "secret")
    assert "CONOID_TOKEN" not in env


def test_the_sites_own_launcher_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert find_mpiexec("/opt/mpi/mpiexec --oversubscribe") == ("/opt/mpi/mpiexec", "--oversubscribe")
    (tmp_path / "mpiexec").touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    beside = Path(sys.executable).with_name("mpiexec")
    assert find_mpiexec("") == (str(beside if beside.is_file() else tmp_path / "mpiexec"),)
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    assert find_mpiexec("") == (str(tmp_path / "mpiexec"),)
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(LaunchError, match="no mpiexec"):
        find_mpiexec("")


def test_all_processes_of_a_run_are_known_and_ended() -> None:
    env = {**os.environ, processes.RUN_VARIABLE: "a-run-of-this-test"}
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import time; time.sleep(60)'])"
    leader = subprocess.Popen([sys.executable, "-c", code], env=env, start_new_session=True)
    while len(processes.of_run("a-run-of-this-test")) < 2:
        assert leader.poll() is None
    assert processes.leader_of(processes.of_all_runs()["a-run-of-this-test"]) == leader.pid
    assert processes.end_run("a-run-of-this-test") == 2
    assert leader.wait(10) == -signal.SIGKILL
    assert processes.start_time(leader.pid) is None
    assert processes.start_time(os.getpid()) is not None


def test_shared_memory_without_a_user_is_found(tmp_path: Path) -> None:
    for name in ("mpich_shm_old", "mpich_shm_new", "mpich_shm_used", "other_old"):
        (tmp_path / name).write_bytes(b"x" * 4096)
        if not name.endswith("new"):
            os.utime(tmp_path / name, (1.0, 1.0))
    with (tmp_path / "mpich_shm_used").open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ):
        found = processes.unused_shared_memory(tmp_path, "mpich_shm_", 60.0)
    assert found == [tmp_path / "mpich_shm_old"]
