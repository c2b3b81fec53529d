"""A Zenoh router in a process of its own, with a subscriber to everything: ``python -m tests.bench.router PORT``."""

import json
import sys
import threading

import zenoh


def main(port: str) -> None:
    """Listens, says "ready", and stays until it is killed."""
    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [f"tcp/127.0.0.1:{port}"],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    heard = session.declare_subscriber("conoid/**", lambda sample: None)
    print("ready", flush=True)
    threading.Event().wait()
    heard.undeclare()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main(sys.argv[1])
