"""A Zenoh router in a separate process, with a subscriber to all keys: ``python -m tests.bench.router PORT``."""

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zenoh

Router = subprocess.Popen[bytes]


@contextmanager
def started() -> Iterator[tuple[Router, str]]:
    """Yields the process of a listening router and its endpoint; the router is killed at the end of the block."""
    port = _free_port()
    words = [sys.executable, "-m", "tests.bench.router", str(port)]
    with subprocess.Popen(words, cwd=Path(__file__).parents[2], stdout=subprocess.PIPE) as router:
        try:
            assert router.stdout is not None
            router.stdout.readline()
            yield router, f"tcp/127.0.0.1:{port}"
        finally:
            router.kill()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def main(port: str) -> None:
    """Starts the router, prints "ready", and runs until the process is killed."""
    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [f"tcp/127.0.0.1:{port}"],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    received = session.declare_subscriber("conoid/**", lambda sample: None)
    print("ready", flush=True)
    threading.Event().wait()
    received.undeclare()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main(sys.argv[1])
