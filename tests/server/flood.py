"""The command ``flood.py HOST PORT SECONDS THREADS`` sends requests without a token as fast as possible, and prints the
number of answers by status.
"""

import json
import socket
import sys
import threading
import time
from collections import Counter

REQUEST = b"GET /v1/runs HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer conoid_guess_%d\r\n\r\n"


def main(host: str, port: int, seconds: float, threads: int) -> None:
    answers: Counter[str] = Counter()
    deadline = time.monotonic() + seconds
    senders = [threading.Thread(target=ask, args=(host, port, deadline, answers)) for _ in range(threads)]
    for one in senders:
        one.start()
    for one in senders:
        one.join()
    print(json.dumps(answers))


def ask(host: str, port: int, deadline: float, answers: Counter[str]) -> None:
    with socket.create_connection((host, port), timeout=30.0) as connection, connection.makefile("rb") as answer:
        count = 0
        while time.monotonic() < deadline:
            count += 1
            connection.sendall(REQUEST % count)
            answers[answer.readline().split()[1].decode()] += 1
            length = 0
            while (line := answer.readline().strip().lower()) != b"":
                if line.startswith(b"content-length:"):
                    length = int(line.split(b":")[1])
            answer.read(length)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4]))
