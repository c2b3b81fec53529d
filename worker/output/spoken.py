"""Standard output of a worker that runs without a server. The module prints the start, a line for each percent of
progress, warnings, and the end.
"""

import contextlib
import sys
from pathlib import Path

from conoid.cases import messages
from conoid.cases.figures import alike, clock, count, counted, crew, duration, percent, rough, si
from conoid.cases.outcome import Outcome
from conoid.cases.output import layout
from conoid.cases.run import State


class Speaker:
    """Prints the messages of a run's journal on rank 0."""

    def __init__(self, folder: Path) -> None:
        """``folder``: folder of the run."""
        self._folder = folder
        self._percent = -1
        self._warned = set[str]()

    def tell(self, message: messages.AnyMessage, blob: bytes = b"") -> None:
        """Print the content of a message if it is new to the user."""
        match message:
            case messages.Status() if message.state == State.STARTING and message.message:
                self._say(message, message.message)
            case messages.Started():
                self._say(message, self._start(message))
            case messages.Progress():
                self._progress(message)
            case messages.Log() if message.level in {"warning", "error"} and message.text not in self._warned:
                self._warned.add(message.text)
                self._say(message, f"{message.level}: {message.text}")

    def _start(self, started: messages.Started) -> str:
        size = f"{count(started.elements)} tets, {count(started.nodes)} nodes"
        cores = crew(started.ranks, started.threads)
        return f"running {size} to {si(started.end_time, 's')} on {cores}; results in {self._folder}"

    def _progress(self, now: messages.Progress) -> None:
        share = min(1.0, now.t / now.end_time) if now.end_time > 0.0 else 0.0
        whole = int(100.0 * share + 1e-9)
        if whole <= self._percent:
            return
        self._percent = whole
        t, last = alike((now.t, now.end_time), "s")
        left = f"  left {duration(now.eta)}" if share < 1.0 else ""
        self._say(
            now,
            f"{percent(share)}  t {t} of {last}  step {count(now.step)}  dt {si(now.dt, 's')} ({now.limiter}){left}  "
            f"residual {rough(now.energy.residual)}",
        )

    def close(self, outcome: Outcome) -> None:
        """Print how the run has ended, and the path of its results."""
        why = outcome.message or outcome.cause or ""
        end = f"{outcome.state}: {why}" if why else outcome.state
        steps = f", {counted(outcome.steps, 'step')} in {duration(outcome.elapsed)}" if outcome.steps else ""
        _write(f"{end}{steps}")
        for check in outcome.reference:
            verdict = "met" if check.passed else "missed"
            value = " of ".join(alike((check.value, check.expected), check.unit))
            _write(f"reference {verdict}: {check.name} {value}")
        for text in outcome.warnings:
            if text not in self._warned:
                _write(f"warning: {text}")
        _write(f"results in {self._folder}: {layout.OUTCOME}, {layout.HISTORY}, {layout.JOURNAL}, {layout.LOGS}/")

    def _say(self, message: messages.AnyMessage, text: str) -> None:
        _write(f"{clock(message.wall)}  {text}")


def _write(text: str) -> None:
    """Print a line. A closed standard output does not stop the run."""
    with contextlib.suppress(OSError):
        print(text.replace("\n", "\\n"), file=sys.stdout, flush=True)
