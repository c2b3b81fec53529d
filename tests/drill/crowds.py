"""Effect of one attacker on two other users of the same server. The attacker is a separate process; the two other users
send requests at the rate of a person.

The verdict is true if three conditions hold. Of the GET requests of the two other users, 99 % are answered within 0.2 s
and all within 1 s. No answer is wrong. The memory of the server does not grow. Other load on the machine also delays
GET requests. A thread that only sleeps measures the delay by other load; a slow attack on a busy machine is tried
again.
"""

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import httpx2
import msgspec

from conoid.cases.messages import Log, Status, to_json
from conoid.cases.outcome import Measured, Outcome
from conoid.cases.outcome import to_json as outcome_json
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.database.store import Store
from conoid.server.requests.tokens import create_token
from conoid.server.runs import folder
from conoid.server.runs.folder import Submission
from conoid.server.settings import Settings

from ..server.journal_lines import lines_of_run, write
from ..server.sweep_bodies import wish
from .attacker import KINDS
from .judge import TRUE, Row
from .stand import Stand

SECONDS = 6.0
"""Duration of each attack, s."""
P99, WORST = 0.2, 1.0
"""Largest time of a GET request of the two other users at p99, and of the slowest request, s."""
BUSY, TRIES = 0.02, 3
"""Delay of a sleeping thread at p99 from which the machine counts as busy, s; largest number of tries on a busy machine
(chosen values: a GET request changes threads about ten times).
"""
REST = 2.0
"""Pause after an attack, in which the remaining requests of the attack end, s."""
GROWTH = 200 << 20
"""Largest growth of the memory of the server during an attack, bytes."""
PAUSE = 0.02
"""Pause between two GET requests of a person, s."""
RUNS, EVENTS, REPORTS, FILES = 3000, 2500, 20_000, 2000
"""Data of the attacker: number of runs with labels; number of events of 20 kB and number of reports in the journal of
the long run; number of files of another run."""
MANY, LINES = 20, 1_000_000
"""Data of the attacker: number of runs with long journals, and number of lines of such a journal. The server caches the
histories of fewer runs than this number."""
ALLOWED = {-1, 200, 202, 204, 206, 304, 400, 401, 404, 405, 408, 409, 410, 413, 415, 416, 422, 429, 500, 503}
"""Statuses that an attacker may get as an answer; -1 means that the attacker does not read the answer."""


@dataclass
class Person:
    """A user with regular GET requests for a run; ``took`` has the time of each answer, s."""

    http: httpx2.Client
    paths: tuple[str, ...]
    took: list[float] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)

    def asks(self, until: float) -> None:
        """Sends GET requests one after the other."""
        n = 0
        while time.monotonic() < until:
            began, n = time.monotonic(), n + 1
            try:
                status = self.http.get(self.paths[n % len(self.paths)]).status_code
            except httpx2.HTTPError as error:
                self.wrong.append(type(error).__name__)
            else:
                self.wrong += [str(status)] if status != 200 else []
            self.took.append(time.monotonic() - began)
            time.sleep(PAUSE)


@dataclass(frozen=True)
class Scene:
    """Token and runs of the attacker, and the two other users."""

    token: str
    run: str
    long: str
    many: list[str]
    sweep: str
    people: tuple[Person, Person]


_scenes: dict[int, Scene] = {}
"""Scenes by process id of the server."""


def groups() -> dict[str, tuple[str, Callable[[Stand], Iterator[Row]]]]:
    """Returns the groups of faults; each group is one attack."""
    return {f"beside others: {kind}": ("plain", partial(rows, kind=kind)) for kind in KINDS}


def rows(stand: Stand, kind: str) -> Iterator[Row]:
    """Tries one attack; tries the attack again while it is slow and the machine is busy."""
    for n in range(1, TRIES + 1):
        row, late = _tried(stand, kind)
        row.happened += f"; try {n}" if n > 1 else ""
        if not row.verdict.startswith("slow") or late < BUSY:
            break
    yield row


def _tried(stand: Stand, kind: str) -> tuple[Row, float]:
    """Returns the table row of one try, and the delay of a sleeping thread at p99, s."""
    assert stand.http is not None
    assert stand.child is not None
    scene = _scenes.get(stand.child.pid) or _scenes.setdefault(stand.child.pid, _made(stand))
    url = str(stand.http.base_url)
    time.sleep(REST)
    quiet = _asked(scene.people, 1.0)
    before, load = _memory(stand), os.getloadavg()[0]
    words = [sys.executable, "-m", "tests.drill.attacker", kind, url, scene.token, scene.run, scene.long]
    words += [",".join(scene.many), scene.sweep, str(SECONDS)]
    attacker = subprocess.Popen(words, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
    grown, machine = _Growth(stand, before), _Machine()
    during = _asked(scene.people, SECONDS + 1.0)
    statuses = {int(status): n for status, n in json.loads(attacker.communicate(timeout=120.0)[0]).items()}
    worst, late = during.took[-1], machine.end()
    happened = (
        f"GET p99 {p99(during.took) * 1e3:.0f} ms, worst {worst * 1e3:.0f} ms of {len(during.took)} (alone p99 "
        f"{p99(quiet.took) * 1e3:.0f} ms, a sleeper is {late * 1e3:.0f} ms late, load {load:.0f}); answers "
        f"{' '.join(f'{status}: {n}' for status, n in statuses.items())}; {grown.end() / 1e6:+.0f} MB"
    )
    return Row(f"beside others: {kind}", "crowd", happened, worst, _verdict(during, statuses, grown.most)), late


def p99(times: Sequence[float]) -> float:
    """Returns the time at p99 of sorted times."""
    return times[int(0.99 * (len(times) - 1))]


def _verdict(during: Person, statuses: dict[int, int], grown: int) -> str:
    most, worst = p99(during.took), during.took[-1]
    if during.wrong:
        return f"others refused: {len(during.wrong)} times, {during.wrong[0]}"
    if odd := [status for status in statuses if status not in ALLOWED and status != 0]:
        return f"lie: the attacker is answered {odd[0]}"
    if grown > GROWTH:
        return f"grown: by {grown >> 20} MiB"
    return f"slow: p99 {most:.2f} s, worst {worst:.2f} s" if most > P99 or worst > WORST else TRUE


def _asked(people: tuple[Person, Person], seconds: float) -> Person:
    """Returns the requests of both persons together, with ascending times."""
    for person in people:
        person.took, person.wrong = [], []
    until = time.monotonic() + seconds
    crowd = [threading.Thread(target=person.asks, args=(until,)) for person in people]
    for one in crowd:
        one.start()
    for one in crowd:
        one.join()
    took = sorted(time for person in people for time in person.took)
    return Person(people[0].http, (), took, [word for person in people for word in person.wrong])


class _Machine:
    """Measures the delay of a thread that only sleeps."""

    def __init__(self) -> None:
        self._late: list[float] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._sleep)
        self._thread.start()

    def _sleep(self) -> None:
        while not self._over.is_set():
            began = time.monotonic()
            time.sleep(PAUSE)
            self._late.append(time.monotonic() - began - PAUSE)

    def end(self) -> float:
        """Ends the measurement; returns the delay at p99, s."""
        self._over.set()
        self._thread.join()
        return p99(sorted(self._late))


class _Growth:
    """Measures the memory of the server during an attack."""

    def __init__(self, stand: Stand, before: int) -> None:
        self._stand, self._before, self.most = stand, before, 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def _look(self) -> None:
        while not self._over.wait(0.1):
            self.most = max(self.most, _memory(self._stand) - self._before)

    def end(self) -> int:
        """Ends the measurement; returns the largest growth of the memory, bytes."""
        self._over.set()
        self._thread.join()
        return self.most


def _memory(stand: Stand) -> int:
    """Returns the resident memory of the server, bytes."""
    assert stand.child is not None
    with suppress(OSError):
        return int(Path(f"/proc/{stand.child.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0


# The users ------------------------------------------------------------------------------------------------------------


def _made(stand: Stand) -> Scene:
    """Creates the data of the attacker: 3,000 runs, one of which has a long journal, and a run in progress with many
    files."""
    assert stand.http is not None
    store = Store(Settings(runs=stand.runs).database_url)
    token = create_token(store, "mallory", frozenset({"read", "submit", "metrics"}))
    people = tuple(_person(stand, store, name) for name in ("bob", "eve"))
    with store._engine.begin() as connection:
        for n in range(RUNS):
            ended = replace(folder.first(_record(f"{n:022d}")), state=State.SUCCEEDED, started=1.0, finished=2.0)
            _laid(stand.runs, ended.id, n)
            store._put(connection, ended)
            store._label(connection, ended, {"point": str(n % 100), "a": "b", "c": "d"})
    store.close()
    mallory = httpx2.Client(
        base_url=str(stand.http.base_url), headers={"Authorization": f"Bearer {token}"}, timeout=60.0
    )
    stand.http, own = mallory, stand.http
    answer = mallory.post("/v1/sweeps", content=wish(), headers={"Content-Type": "application/json"})
    sweep = answer.json()
    for point in sweep["points"]:
        mallory.post(f"/v1/runs/{point['run']['id']}:cancel")
    run, long = stand.running(), stand.submit()
    stand.reached(long)
    stand.reached(run, "running")
    stand.http = own
    mallory.close()
    _long_journal(stand.runs / long)
    many = [f"{n:022d}" for n in range(MANY)]
    write(
        stand.runs / many[0],
        (message for message in lines_of_run(3 * LINES // 7) if not isinstance(message, Status)),
        1,
    )
    for each in many[1:]:
        (stand.runs / each / layout.JOURNAL).hardlink_to(stand.runs / many[0] / layout.JOURNAL)
    for n in range(FILES):
        (stand.runs / run / f"file-{n}.txt").touch()
    with (stand.runs / run / "large.bin").open("wb") as file:
        file.truncate(1 << 28)
    return Scene(token, run, long, many, sweep["id"], (people[0], people[1]))


def _person(stand: Stand, store: Store, name: str) -> Person:
    assert stand.http is not None
    token = create_token(store, name, frozenset({"read", "submit"}))
    http = httpx2.Client(base_url=stand.http.base_url, headers={"Authorization": f"Bearer {token}"}, timeout=60.0)
    stand.http, own = http, stand.http
    run = stand.submit()
    stand.reached(run)
    stand.http = own
    paths = (f"/v1/runs/{run}", "/v1/runs", f"/v1/runs/{run}/events", f"/v1/runs/{run}/history", "/healthz")
    return Person(http, paths)


def _laid(runs: Path, run: str, n: int) -> None:
    """Creates the folder of a finished run; few other runs have the same values of the case."""
    (runs / run).mkdir()
    values = {f"key{n % 60}": {f"value{k}": f"{n} {'x' * 40}" for k in range(200)}, "run": {"end_time": n}}
    (runs / run / layout.RESOLVED_CASE).write_text(json.dumps(values))
    (runs / run / layout.SUBMISSION).write_bytes(msgspec.json.encode(_record(run)))
    probes = [Measured(name=f"probe{k}", value=float(n), unit="m/s") for k in range(20)]
    (runs / run / layout.OUTCOME).write_bytes(outcome_json(Outcome(state="succeeded", probes=probes)))


def _record(run: str) -> Submission:
    return Submission(
        id=run, owner="mallory", name="bar", title="", ranks=1, submitted=1.0, case_file="case.toml", body_sha256="",
        idempotency_key=None, wall_time=None, estimate={},
    )  # fmt: skip


def _long_journal(path: Path) -> None:
    """Writes a journal of 20,000 reports and 2,500 lines of 20 kB."""
    last = write(path, (message for message in lines_of_run(REPORTS) if not isinstance(message, Status)), 100)
    with (path / layout.JOURNAL).open("ab") as file:
        for n in range(EVENTS):
            file.write(to_json(Log(run=path.name, seq=last + 1 + n, level="info", text="x" * 20_000)) + b"\n")
