"""The Zenoh router for the nodes of a cluster has its own port, TLS, and the credentials of the run's owner."""

import json
import shutil
import socket
import subprocess
import threading
from pathlib import Path

import pytest
import zenoh

from conoid.cases.messages import Log
from conoid.cases.site.batch import Slurm
from conoid.server.database.store import Token
from conoid.server.telemetry import Telemetry
from conoid.worker.output import telemetry as worker

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates")
ANN = Token("tann", "ann", "", frozenset({"read"}), 0.0)


def certificates(place: Path) -> tuple[str, str, str]:
    """A certificate authority, and a certificate and a key of a router on this machine."""
    (place / "san").write_text("subjectAltName=IP:127.0.0.1,DNS:localhost")
    for words in (
        "req -x509 -newkey rsa:2048 -nodes -keyout ca.key -out ca.pem -subj /CN=authority -days 2",
        "req -newkey rsa:2048 -nodes -keyout router.key -out router.csr -subj /CN=localhost",
        "x509 -req -in router.csr -CA ca.pem -CAkey ca.key -CAcreateserial -out router.pem -days 2 -extfile san",
    ):
        subprocess.run(["openssl", *words.split()], cwd=place, check=True, capture_output=True, timeout=60)
    return str(place / "ca.pem"), str(place / "router.pem"), str(place / "router.key")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_a_node_publishes_with_tls_and_only_with_the_authority(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    authority, certificate, key = certificates(tmp_path)
    listen = f"tls/127.0.0.1:{free_port()}"
    nodes = Slurm(profiles={}, listen=listen, certificate=certificate, key=key, authority=authority)
    router = Telemetry(tmp_path, "127.0.0.1", 0, [ANN], nodes)
    access, reader = router.worker("ann", "run"), router.reader("ann", ANN)
    monkeypatch.setenv("CONOID_ZENOH_USER", access.user)
    monkeypatch.setenv("CONOID_ZENOH_PASSWORD", access.password)
    stranger = worker.Telemetry(listen, access.prefix)
    assert stranger._open() is None, "a router without a trusted certificate"
    stranger.close()
    monkeypatch.setenv("CONOID_ZENOH_AUTHORITY", authority)
    received = threading.Event()
    config = zenoh.Config()
    for name, value in {
        "mode": "client", "connect/endpoints": [router.local_endpoint], "scouting/multicast/enabled": False,
        "transport/auth/usrpwd": {"user": reader.user, "password": reader.password},
    }.items():  # fmt: skip
        config.insert_json5(name, json.dumps(value))
    with zenoh.open(config) as session:
        session.declare_subscriber(f"{reader.prefix}/**", lambda sample: received.set())
        rank = worker.Telemetry(listen, access.prefix)
        for _ in range(200):
            rank.tell(Log(run="run", level="info", text="from a node"))
            if received.wait(0.1):
                break
        rank.close()
    router.close()
    assert received.is_set()
