"""State of a run from its messages, and display of the run in a terminal."""

import io
import threading
from collections.abc import Iterator

import msgspec
import pytest
from rich.console import Console

from conoid.cases.messages import AnyMessage, Load, Log
from conoid.cases.run import State
from conoid.client.commands import display, progress
from conoid.client.errors import UnreachableError
from conoid.client.live import Live, exit_code, grouped
from conoid.client.remote.link import Link
from conoid.client.watch import show, tell, watch

from . import run_messages


def progressed(last: int) -> Live:
    live = Live(run_messages.RUN, title="A bar")
    for message in run_messages.whole()[:last]:
        live.take(message)
    return live


def test_progress_is_a_share_of_the_simulated_time() -> None:
    assert progressed(4).fraction == 0.0
    assert progressed(6).fraction == 0.25
    assert progressed(15).fraction == 1.0


def test_time_stands_still_once_the_run_has_ended() -> None:
    assert progressed(15).elapsed == 15 - 4


def test_phases_are_grouped_and_the_rest_of_the_interval_is_descheduled() -> None:
    live = progressed(7)
    assert live.phases == {
        "compute": pytest.approx([1.2, 0.7]), "exchange": [0.2, 0.8], "output": [0.1, 0.0],
        "descheduled": pytest.approx([0.5, 0.5]),
    }  # fmt: skip
    assert live.busy == pytest.approx([1.3 / 2.0, 0.7 / 2.0])


def test_the_other_threads_of_a_rank_are_busy_by_the_time_of_their_tasks() -> None:
    live = progressed(6)
    load = next(each for each in run_messages.whole() if isinstance(each, Load))
    live.take(msgspec.structs.replace(load, threads=4, helped=[3.0, 0.0]))
    assert live.helped == [3.0 / (3 * 2.0), 0.0]
    assert "65 % busy, its threads 50 %" in rendered(live)
    assert progressed(7).helped == []


def test_waiting_for_other_ranks_is_not_exchange() -> None:
    """The file client/web/live.js has the same rule."""
    phases = {"elements": [1.0, 2.0], "exchange": [0.5, 0.25]}
    assert grouped(phases, interval=3.0, waiting=[0.25, 0.5]) == {
        "compute": [1.0, 2.0], "exchange": [0.25, 0.0], "wait": [0.25, 0.25], "descheduled": [1.5, 0.75],
    }  # fmt: skip


@pytest.mark.parametrize(
    ("state", "cause", "code"),
    [
        (State.SUCCEEDED, None, 0),
        (State.FAILED, "diverged", 1),
        (State.FAILED, "input", 2),
        (State.FAILED, "mesh", 2),
        (State.CANCELLED, "cancelled", 4),
        (State.TIMED_OUT, "walltime", 1),
        (State.LOST, "node", 1),
    ],
)
def test_exit_codes(state: State, cause: str | None, code: int) -> None:
    assert exit_code(state, cause) == code


def test_a_run_that_has_not_begun_shows_its_waiting_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conoid.client.commands.display.time.time", lambda: run_messages.START + 3 + 42)
    assert "starting  42 s" in rendered(progressed(3))
    assert "running  42 s" not in rendered(progressed(6))


def rendered(live: Live, width: int = 100, height: int = 60) -> str:
    out = Console(file=io.StringIO(), width=width, height=height, force_terminal=False)
    out.print(display.panel(live))
    assert isinstance(out.file, io.StringIO)
    return out.file.getvalue()


@pytest.mark.parametrize("width", [60, 80, 100])
def test_the_panel_shows_everything_that_is_watched(width: int) -> None:
    text = rendered(progressed(11), width)
    for shown in (
        "A bar", "running", "50.0 %", "40.0 µs of 80.0 µs", "8.10 ns", "tet 7 (bar): sound speed", "30 s",
        "9.70 M updates/s", "rank 0", "65 % busy", "35 % busy", "imbalance 1.20", "kinetic", "6.00 J", "2.0e-4",
        "warning: the foot has folded", "310 nodes", "fragments", "descheduled 25 %", run_messages.RUN,
    ):  # fmt: skip
        assert shown in text, shown
    assert "elastic" not in text, "terms that are zero are left out"
    assert "…" not in text, "nothing is cut off"


def test_a_warning_is_shown_once_and_whole() -> None:
    live, words = progressed(9), "contact has let some tets of the dust into each other, " * 3
    for n in range(20, 24):
        live.take(Log(run=run_messages.RUN, seq=n, wall=run_messages.START, level="warning", text=words + "the end"))
    text = rendered(live, 60)
    assert (text.count("warning: contact"), "the end (4 times)" in text) == (1, True)


@pytest.mark.parametrize("width", [60, 100, 200])
def test_the_panel_fits_the_terminal(width: int) -> None:
    assert max(map(len, rendered(progressed(13), width).splitlines())) <= width


def test_the_panel_fits_the_height_of_the_terminal() -> None:
    live = progressed(11)
    live.phases = {"compute": [1.0] * 40}
    for n in range(20, 30):
        live.take(Log(run=run_messages.RUN, seq=n, wall=run_messages.START, level="warning", text=f"tet {n} is flat"))
    text = rendered(live, 60, height=24)
    assert len(text.splitlines()) < 24
    assert "tet 29 is flat" in text
    assert "energy residual 2.0e-4" in text
    assert "kinetic" in rendered(live, 60, height=60)


def test_bars_of_the_ranks_are_in_proportion() -> None:
    lines = [line for line in rendered(progressed(7)).splitlines() if "rank" in line and "busy" in line]
    assert [line.count("█") for line in lines] == [36, 36], "both ranks took the whole interval"


def test_a_chart_of_many_ranks_is_shortened_with_a_note() -> None:
    live = progressed(6)
    live.phases = {"compute": [1.0] * 40}
    assert "and 28 more ranks" in rendered(live)


def test_plain_lines_print_each_state_percent_and_warning_once() -> None:
    lines: list[str] = []
    story = run_messages.whole()
    often = [msgspec.structs.replace(run_messages.progress(6, 0.25 + n / 1e4), seq=6) for n in range(100)]
    live = tell([*story[:6], *often, *story[6:10], *story[9:]], Live(run_messages.RUN), lines.append)
    assert live.state is State.SUCCEEDED
    assert [line.split()[2] for line in lines] == [
        "accepted", "queued", "starting", "running", "running", "warning:", "running", "running", "running",
        "succeeded",
    ]  # fmt: skip
    percents = [line.split()[3] for line in lines if "%" in line and "succeeded" not in line]
    assert percents == ["25.0", "50.0", "75.0", "100.0"]


def test_progress_of_the_start_is_reported_and_changes_no_state() -> None:
    lines: list[str] = []
    words = [run_messages.status(4 + n, "starting", message=f"compiling kernels: {n} of 3") for n in range(4)]
    live = tell([run_messages.status(3, "starting"), *words], Live(run_messages.RUN), lines.append)
    assert [line.partition("starting")[2].strip() for line in lines] == ["", *(word.message for word in words)]
    assert live.changed == run_messages.START + 3


def test_a_run_without_messages_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "LONGEST", 0.05)
    lines: list[str] = []
    received = threading.Event()

    def write(text: str) -> None:
        lines.append(text)
        if "still" in text:
            received.set()

    def story() -> Iterator[AnyMessage]:
        yield run_messages.status(1, "starting", message="meshing tile, part 2 of 3")
        assert received.wait(30.0)
        yield run_messages.status(2, "running")

    tell(story(), Live(run_messages.RUN), write)
    assert lines[0].endswith("starting  meshing tile, part 2 of 3")
    assert "still starting, for " in lines[1]
    assert lines[1].endswith(": meshing tile, part 2 of 3")
    assert lines[-1].endswith("running")


def test_a_failure_gives_its_cause() -> None:
    lines: list[str] = []
    tell([run_messages.status(1, "failed", "energy", "the residual passed 0.05")], Live(run_messages.RUN), lines.append)
    assert lines[0].endswith("failed  energy  the residual passed 0.05")


def test_the_live_screen_ends_with_the_last_picture() -> None:
    out = Console(file=io.StringIO(), width=100, height=40, force_terminal=True)
    show(run_messages.whole(), Live(run_messages.RUN), out)
    assert isinstance(out.file, io.StringIO)
    assert "succeeded" in out.file.getvalue()


class Queued:
    """A fake run that waits until the reason of the wait has been printed."""

    id, title, reason = run_messages.RUN, "A bar", "waiting for 4 of 2 slots; 1 free"

    def __init__(self) -> None:
        self.received = threading.Event()

    def status(self) -> "Queued":
        return self

    def link(self) -> Link:
        return Nothing()

    def messages(self, *, link: Link) -> Iterator[AnyMessage]:
        yield run_messages.status(1, "queued")
        assert self.received.wait(10)
        yield run_messages.status(2, "running")
        yield run_messages.status(3, "succeeded")


class Deserted(Queued):
    """A fake run without messages whose server has stopped; it continues after the message about the server has been
    printed.
    """

    def status(self) -> "Queued":
        if self.asked:
            raise UnreachableError("no answer from http://x: is a server running there? (conoid serve)")
        self.asked = True
        return self

    asked = False

    def messages(self, *, link: Link) -> Iterator[AnyMessage]:
        yield run_messages.status(1, "running")
        assert self.received.wait(10)
        yield run_messages.status(2, "succeeded")


def test_a_server_that_has_ended_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """After the server has stopped, the client cannot find out whether the run still runs."""
    monkeypatch.setattr(progress, "LONGEST", 0.05)
    monkeypatch.setattr("conoid.client.watch.REASON_EVERY", 0.01)
    run, lines = Deserted(), list[str]()

    class Recorder(Console):
        def print(self, *objects: object, **options: object) -> None:
            lines.append(str(objects[0]))
            if "no server answers, for " in lines[-1]:
                run.received.set()

    known = watch(run, live=False, console=Recorder(file=io.StringIO()))
    assert any(line.endswith("it was running at its last message") for line in lines)
    assert "no server answers" not in rendered(known), "it has come back"
    known.away = run_messages.START
    assert "no server answers" in rendered(known), "the panel shows it too"


class Nothing:
    """A fake subscription without messages."""

    name, trouble = "none", ""

    def get(self, timeout: float) -> AnyMessage | None:
        return None

    def close(self) -> None:
        """Replaces a method and does nothing."""


def test_the_reason_of_waiting_in_the_queue_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "LONGEST", 0.05)
    monkeypatch.setattr("conoid.client.watch.REASON_EVERY", 0.01)
    run, out = Queued(), io.StringIO()

    class Recorder(Console):
        def print(self, *objects: object, **options: object) -> None:
            super().print(*objects, **options)  # type: ignore[arg-type]
            if run.reason in str(objects):
                run.received.set()

    known = watch(run, live=False, console=Recorder(file=out, width=200))
    lines = [line for line in out.getvalue().splitlines() if run.reason in line]
    assert lines
    assert all("still queued" in line for line in lines)
    assert run.reason not in rendered(known)
    known.state = State.QUEUED
    assert run.reason in rendered(known), "the panel shows it too"
