"""Fake worker of the tests of the server, with a record of each start and each end: the command is
``worker.py BOOK CASE --out DIR ...``.

The file BOOK is outside of the folder of the run. After any damage of the run's folder the file BOOK still contains the
number of starts of the run, whether two workers ran at the same time, and the end of the run.
"""

import json
import os
import runpy
import sys
from pathlib import Path

from conoid.cases.run import ExitCode

FAKE = Path(__file__).parents[1] / "server" / "fake_worker.py"


def main() -> int:
    book, run = Path(sys.argv.pop(1)), sys.argv[sys.argv.index("--run") + 1]
    if os.environ.get("PMI_RANK", "0") != "0":
        return run_fake()
    living = [entry["pid"] for entry in entries(book, run) if entry["what"] == "start" and lives(entry["pid"], run)]
    if living:
        write(book, run, "double", living[0])
    write(book, run, "start", os.getpid())
    try:
        code = run_fake()
    except OSError as error:
        print(error.strerror, file=sys.stderr)
        code = ExitCode.STORAGE
    write(book, run, "end", int(code))
    return code


def run_fake() -> int:
    code: int = runpy.run_path(str(FAKE))["main"]()
    return code


def lives(pid: int | str, run: str) -> bool:
    try:
        return run.encode() in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def entries(book: Path, run: str) -> list[dict[str, int | str]]:
    lines = book.read_text().splitlines() if book.exists() else []
    return [entry for entry in map(json.loads, lines) if entry["run"] == run]


def write(book: Path, run: str, what: str, number: int | str) -> None:
    with book.open("a") as file:
        file.write(json.dumps({"run": run, "what": what, "pid" if what != "end" else "code": number}) + "\n")


if __name__ == "__main__":
    sys.exit(main())
