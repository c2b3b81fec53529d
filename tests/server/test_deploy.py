"""The files of deploy/ in use: nginx with TLS in front of a server, and a backup that is restored."""

import hashlib
import json
import os
import shutil
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2
import pytest

from conoid.cases.run import State

from .running import TOML, MakeProcess, User, case_text

DEPLOY = Path(__file__).parents[2] / "deploy"
NGINX = shutil.which("nginx", path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")
WITH_NGINX = pytest.mark.skipif(not (NGINX and shutil.which("openssl")), reason="needs nginx and openssl")
NAME = "conoid.example.org"
MAIN = """
daemon off;
worker_processes 1;
pid {place}/pid;
error_log {place}/error.log;
events {{ }}
http {{
    access_log off;
    client_body_temp_path {place}/body;
    proxy_temp_path {place}/proxy;
    fastcgi_temp_path {place}/fastcgi;
    uwsgi_temp_path {place}/uwsgi;
    scgi_temp_path {place}/scgi;
    include {place}/site.conf;
}}
"""


def certificate(place: Path) -> None:
    """A self-signed certificate that nginx uses for ``NAME``."""
    command = [
        "openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={NAME}",
        "-addext", f"subjectAltName=DNS:{NAME}", "-keyout", str(place / "key.pem"), "-out", str(place / "chain.pem"),
    ]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True)


def placed(place: Path, port: int, server: int) -> Path:
    """Writes a shipped file with the addresses and the certificate of this test; each text that is replaced must exist
    in the file.
    """
    text = (DEPLOY / "nginx.conf").read_text()
    for shipped, here in {
        "listen 443 ssl;": f"listen 127.0.0.1:{port} ssl;",
        "/etc/ssl/conoid/fullchain.pem": f"{place}/chain.pem",
        "/etc/ssl/conoid/key.pem": f"{place}/key.pem",
        "server 127.0.0.1:8750;": f"server 127.0.0.1:{server};",
    }.items():
        assert text.count(shipped) == 1, shipped
        text = text.replace(shipped, here)
    (place / "site.conf").write_text(text)
    (place / "nginx.conf").write_text(MAIN.format(place=place))
    return place / "nginx.conf"


def answers(port: int) -> bool:
    """Returns True if a program listens at the port."""
    with socket.socket() as knock:
        return knock.connect_ex(("127.0.0.1", port)) == 0


@contextmanager
def proxy(place: Path, server: int) -> Iterator[int]:
    """Starts an nginx in front of the server at a port; yields the port of nginx."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
    certificate(place)
    child = subprocess.Popen([str(NGINX), "-p", str(place), "-c", str(placed(place, port, server))])
    try:
        deadline = time.monotonic() + 20.0
        while not answers(port):
            assert child.poll() is None, (place / "error.log").read_text()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        yield port
    finally:
        child.terminate()
        child.wait(20.0)


def visitor(place: Path, port: int, token: str) -> httpx2.Client:
    """Returns a client that uses the name of the site and trusts only the certificate of the site."""
    trust = ssl.create_default_context(cafile=str(place / "chain.pem"))
    trust.check_hostname = False
    headers = {"Authorization": token, "Host": NAME}
    return httpx2.Client(base_url=f"https://127.0.0.1:{port}", verify=trust, headers=headers, timeout=20.0)


def running(process: MakeProcess, place: Path) -> tuple[User, str]:
    """A user of a new server, and a run that waits for the file "go"."""
    server = process("--no-zenoh")
    ann = server.user(server.start()["url"])
    run = ann.submit(wait=str(place / "go"))
    ann.wait_for(run, State.RUNNING)
    return ann, run


@contextmanager
def behind(ann: User, place: Path) -> Iterator[httpx2.Client]:
    """Returns the user with requests through nginx."""
    port = ann.http.base_url.port
    assert port is not None
    with proxy(place, port) as outside, visitor(place, outside, ann.http.headers["authorization"]) as far:
        yield far


def backup(*words: Path) -> "subprocess.CompletedProcess[bytes]":
    """Runs the shipped script with this Python."""
    command = [str(DEPLOY / "backup.sh"), *map(str, words)]
    return subprocess.run(command, check=False, capture_output=True, env={**os.environ, "PYTHON": sys.executable})


@WITH_NGINX
def test_events_pass_through_nginx_when_they_happen(process: MakeProcess, tmp_path: Path) -> None:
    ann, run = running(process, tmp_path)
    with (
        behind(ann, tmp_path) as far,
        far.stream("GET", f"/v1/runs/{run}/stream") as stream,
    ):
        assert stream.headers["content-type"].startswith("text/event-stream")
        lines = stream.iter_lines()
        assert any('"running"' in line for line in lines), "the event arrives while the run continues"
        (tmp_path / "go").touch()
        assert any('"succeeded"' in line for line in lines)
        assert ann.wait_for(run)["state"] == "succeeded"
        assert far.get(f"/v1/runs/{run}").json()["state"] == "succeeded"
        assert far.post("/v1/runs", content=b"x" * 3_000_000).status_code == 413
        assert far.get("/readyz").status_code == 200
        mesh = b"x" * 3_000_000
        assert far.put(f"/v1/files/{hashlib.sha256(mesh).hexdigest()}", content=mesh).status_code == 201
        assert far.post("/v1/cases:validate", content=case_text(), headers=TOML).json()["valid"]
        far.headers["Authorization"] = "Bearer wrong"
        assert far.get("/v1/me").status_code == 401


@WITH_NGINX
@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_log_without_new_lines_passes_through_nginx(process: MakeProcess, tmp_path: Path) -> None:
    """nginx ends an answer from which no bytes arrive for 90 s."""
    ann, run = running(process, tmp_path)
    with (
        behind(ann, tmp_path) as far,
        far.stream("GET", f"/v1/runs/{run}/logs/0", params={"follow": True}) as log,
    ):
        threading.Timer(100.0, (tmp_path / "go").touch).start()
        text = b"".join(log.iter_raw())
    assert text.count(b"\0") >= 5
    assert text.replace(b"\0", b"") == b"rank 0 greets\n"


def test_a_backup_taken_beside_the_server_brings_tokens_and_runs_back(process: MakeProcess, tmp_path: Path) -> None:
    server = process("--no-zenoh")
    ann = server.user(server.start()["url"])
    run = ann.submit()
    ann.wait_for(run)
    database, kept = server.runs / "server.sqlite", tmp_path / "kept.sqlite"
    assert backup(database, kept).returncode == 0
    assert kept.stat().st_mode & 0o077 == 0
    later = ann.submit()
    ann.wait_for(later)
    server.close()
    for path in server.runs.glob("server.sqlite*"):
        path.unlink()
    shutil.copy2(kept, database)
    headers = {"Authorization": ann.http.headers["authorization"]}
    with httpx2.Client(base_url=server.start()["url"], headers=headers) as http:
        assert {found["id"] for found in json.loads(http.get("/v1/runs").content)["runs"]} == {run, later}
        assert http.get(f"/v1/runs/{later}").json()["state"] == "succeeded", "from its folder"


def test_a_backup_that_fails_leaves_the_last_one(tmp_path: Path) -> None:
    kept = tmp_path / "kept.sqlite"
    kept.write_bytes(b"the last one")
    assert backup(tmp_path / "nothing.sqlite", kept).returncode != 0
    assert kept.read_bytes() == b"the last one"
