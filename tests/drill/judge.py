"""Checks whether the reported state of a run is true, from the record of the workers, the processes, and the folder of
the run."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from conoid.cases.output import layout
from conoid.server.launch import processes
from conoid.server.runs import folder, journal

from .situations import Truth
from .stand import FINAL, Stand

TRUE = "true"


@dataclass
class Row:
    """A row of the table."""

    fault: str
    family: str
    happened: str
    seconds: float
    verdict: str


def settled(stand: Stand, truths: Sequence[Truth], since: float) -> list[tuple[str, float]]:
    """Returns the final or expected state of each run, and the time from ``since`` at which the state was reported,
    s.
    """
    found: dict[str, tuple[str, float]] = {}
    while True:
        late = time.monotonic() > since + stand.patience
        for truth in truths:
            if truth.run not in found:
                seen = stand.state(truth.run)
                if late or seen in truth.states or seen.partition("/")[0] in FINAL:
                    found[truth.run] = seen, time.monotonic() - since
        if len(found) == len({truth.run for truth in truths}):
            return [found[truth.run] for truth in truths]
        time.sleep(0.1)


def settle(stand: Stand, truth: Truth, since: float) -> tuple[str, float]:
    """Returns the final or expected state of one run, and the time of this state."""
    return settled(stand, [truth], since)[0]


def verdict(stand: Stand, truth: Truth, seen: str, seconds: float) -> str:
    """Returns the most severe error; ``TRUE`` if there is no error."""
    if truth.run == "none":
        return "never accepted"
    if "two runs" in truth.happened:
        return "double: two runs of one key"
    if seen in {"404", "0"}:
        return f"acknowledged and lost: {seen}"
    if seen not in truth.states:
        kind = "lie" if seen.partition("/")[0] in FINAL else "stranded"
        return f"{kind}: {seen}, not {' or '.join(sorted(truth.states))}"
    found = [_doubles(stand, truth), _orphans(stand, truth, seen), _success(stand, truth, seen)]
    if truth.whole:
        found.append(_folder(stand, truth, seen))
    found.append(f"late: after {seconds:.1f} s" if seconds > stand.patience else "")
    return next(filter(None, found), TRUE)


def _doubles(stand: Stand, truth: Truth) -> str:
    entries = stand.entries(truth.run)
    starts = [n for n, entry in enumerate(entries) if entry["what"] == "start"]
    ends = [n for n, entry in enumerate(entries) if entry["what"] == "end" and entry["code"] == 0]
    if any(entry["what"] == "double" for entry in entries):
        return "double: two workers at a time"
    if ends and starts and starts[-1] > ends[0]:
        return "double: run again after its end"
    return f"double: {len(starts)} launches" if len(starts) > truth.launches else ""


def _orphans(stand: Stand, truth: Truth, seen: str) -> str:
    """Returns an error if processes of a finished run still exist. Ranks end a moment after their launcher."""
    deadline = time.monotonic() + 2.0
    while seen.partition("/")[0] in FINAL and processes.of_run(truth.run):
        if time.monotonic() > deadline:
            return f"orphan: {len(processes.of_run(truth.run))} processes"
        time.sleep(0.1)
    return ""


def _success(stand: Stand, truth: Truth, seen: str) -> str:
    """Checks that a worker has succeeded: by the record, or by an outcome that only a worker writes. A worker may hang
    after it has written its outcome."""
    done = any(entry["what"] == "end" and entry["code"] == 0 for entry in stand.entries(truth.run))
    if not done and (ended := folder.outcome(stand.runs / truth.run)) is not None:
        done = ended.state == "succeeded" and bool(ended.digest)
    return "lie: no worker has succeeded" if seen == "succeeded" and not done else ""


def _folder(stand: Stand, truth: Truth, seen: str) -> str:
    """Checks that journal, outcome and list agree with the reported state."""
    path, state = stand.runs / truth.run, seen.partition("/")[0]
    reported, ended = journal.statuses(path / layout.JOURNAL), folder.outcome(path)
    if not reported or reported[-1].state != state:
        return f"lie: the journal has {reported[-1].state if reported else 'nothing'}, not {state}"
    if ended is None or ended.state != state:
        return f"lie: the outcome has {ended.state if ended else 'nothing'}, not {state}"
    listed = {run["id"]: run["state"] for run in stand.ask("GET", "/v1/runs?limit=500")[1]["runs"]}
    return "" if listed.get(truth.run) == state else f"lie: the list has {listed.get(truth.run)}"


def reads(stand: Stand, run: str) -> None:
    """Sends every GET request of a run; the stand stores server errors."""
    for path in ("", "/events", "/history", "/files", "/logs/0", "/snapshots"):
        stand.ask("GET", f"/v1/runs/{run}{path}")


def stranded(stand: Stand) -> str:
    """Returns an error if the metric ``conoid_stranded`` of the server is not 0."""
    text = str(stand.ask("GET", "/metrics")[1])
    found = [line for line in text.splitlines() if line.startswith("conoid_stranded ")]
    return "" if found and float(found[0].split()[1]) == 0.0 else f"stranded by its own account: {found}"
