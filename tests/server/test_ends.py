"""End of a run whose worker wrote no outcome, determined from the files of the run."""

import math
import os
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from conoid.cases.messages import AnyMessage, Counts, Progress, Started, Status, to_json
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.outcome import to_json as outcome_to_json
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.launch import Exit, Phase
from conoid.server.runs import ends
from conoid.server.runs.events import Run, WorkerExited
from conoid.server.runs.watch import Watch

from .fake_worker import progress
from .running import Running

LOST = Outcome(state="lost", cause="service", ranks=2)
RUN = Run("a", "ann", "bar", 2, submitted=1.0, state=State.LOST, started=10.0, finished=14.5)
STARTED = Started(run="a", wall=11.0, ranks=2, elements=50, nodes=30, end_time=1.0, setup=0.5, parts={"rod": 50})
COUNTS = Counts(run="a", elements=45, nodes=33, shared=2, fragments=4, elements_per_rank=[20, 25], facets=9)


def journaled(folder: Path, *messages: AnyMessage) -> Path:
    """Makes a folder whose journal has the given messages and an incomplete line."""
    (folder / layout.JOURNAL).write_bytes(b"".join(to_json(each) + b"\n" for each in messages) + b'{"type":"prog')
    return folder


def at(step: int) -> Progress:
    return msgspec.structs.replace(progress("a", step, 10), worst_residual=3e-4)


def test_a_journal_without_the_worst_residual_is_read_too(tmp_path: Path) -> None:
    ended = ends.so_far(LOST, RUN, journaled(tmp_path, STARTED, progress("a", 3, 10)))
    assert ended.steps == 3
    assert math.isnan(ended.worst_residual)


def test_a_lost_run_has_the_progress_of_its_journal(tmp_path: Path) -> None:
    journaled(
        tmp_path, Status(run="a", state="starting"), STARTED, at(3), COUNTS, at(7), Status(run="a", state="running")
    )
    ended = ends.so_far(LOST, RUN, tmp_path)
    assert (ended.steps, ended.time, ended.elements, ended.setup, ended.elapsed) == (7, 0.7, 50, 0.5, 4.5)
    assert (ended.nodes_initial, ended.nodes, ended.eroded, ended.fragments, ended.broken) == (30, 33, 5, 4, 9)
    assert ended.energy == at(7).energy
    assert ended.worst_residual == 3e-4, "of lines of the history between the reports, too"
    assert (ended.state, ended.cause, ended.digest) == ("lost", "service", "")


@pytest.mark.parametrize("messages", [[], [Status(run="a", state="queued")]])
def test_values_without_a_message_are_null(messages: list[AnyMessage], tmp_path: Path) -> None:
    ended = ends.so_far(LOST, replace(RUN, started=0.0), journaled(tmp_path, *messages) if messages else tmp_path)
    assert ended == LOST
    text = outcome_to_json(ended)
    assert b'"steps": null' in text
    assert text.count(b"null") > 12
    assert from_json(text).steps is None
    assert math.isnan(from_json(text).elapsed)


def test_the_end_is_the_last_received_message(tmp_path: Path) -> None:
    assert ends.when(tmp_path) == 0.0
    (tmp_path / layout.OUTCOME).write_bytes(b"{}")
    os.utime(tmp_path / layout.OUTCOME, (70.0, 70.0))
    assert ends.when(tmp_path) == 70.0
    assert ends.when(journaled(tmp_path, STARTED)) == 11.0


class Gone:
    """A worker that has ended; with ``alive`` the worker still runs."""

    def __init__(self, alive: bool) -> None:
        self.alive_now = alive

    def exited(self) -> Exit | None:
        return None if self.alive_now else Exit(None, False, "")

    def phase(self) -> Phase:
        return "runs"

    def began(self) -> float:
        return 5.0


@pytest.mark.parametrize(("seen", "at"), [(True, 0.0), (False, 11.0)], ids=["seen alive", "gone when first looked at"])
def test_an_unobserved_end_has_the_time_of_the_last_message(seen: bool, at: float, tmp_path: Path) -> None:
    """The Slurm job ended while no server was running."""
    worker = Gone(alive=seen)
    watch = Watch(journaled(tmp_path, STARTED), worker, None)  # type: ignore[arg-type]
    looks = [*watch.look()]
    worker.alive_now = False
    looks += watch.look()
    assert [event.at for event in looks if isinstance(event, WorkerExited)][:1] == [at]


def test_a_run_that_never_started_has_no_numbers(server: Running, tmp_path: Path) -> None:
    go = tmp_path / "go"
    for _ in range(2):
        server.ann.wait_for(server.ann.submit(wait=str(go)), State.RUNNING)
    waits = server.ann.submit()
    server.ann.http.post(f"/v1/runs/{waits}:cancel")
    ended = server.ann.wait_for(waits)["outcome"]
    known = {name for name, value in ended.items() if value not in (None, [], {})}
    assert known == {"state", "cause", "message", "ranks", "threads", "digest"}
    go.touch()
