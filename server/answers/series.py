"""The history of a run as an HTTP answer: columns of values over the samples of the history, reduced to the requested
number of points.
"""

import time
from collections.abc import Sequence
from typing import Any, TypeVar

import msgspec

from conoid.cases.messages import Counts, Energy, Load, Progress, Snapshot
from conoid.cases.output.history import OF_PARTS

from ..runs.journal import DAMAGED
from .history import History, Sample

T = TypeVar("T")
_NUMBERS = 100_000
"""Largest product of the numbers of ranks, phases and times in an answer: a megabyte of JSON (chosen value)."""
_ANSWERS = 4
"""Number of cached answers of a run; they differ in their numbers of points (chosen value)."""
_progress = msgspec.json.Decoder(Progress)
_load = msgspec.json.Decoder(Load)
_counts = msgspec.json.Decoder(Counts)
_snapshot = msgspec.json.Decoder(Snapshot)


def body(history: History, points: int) -> bytes:
    """Returns the whole history as an HTTP answer. For a run that has ended, the answer is made once and cached. The
    caller must hold the lock of the history.
    """
    last, known = history.answers.get(points, (-1, b""))
    if last == history.last and history.state.final:
        return known
    made = _body(history, points)
    history.answers = dict([*history.answers.items()][1 - _ANSWERS :])
    history.answers[points] = history.last, made
    return made


def _body(history: History, points: int) -> bytes:
    read = (_read(sample) for sample in _spread(_kept(history), points))
    reports = [report for report in read if report is not None]
    loads, once = [report.load for report in reports], _once(reports)
    final = history.state.final
    return msgspec.json.encode({
        "last": history.last,
        "state": history.state,
        "elapsed": 0.0 if history.began is None else (history.wall if final else time.time()) - history.began,
        "series": _columns(once, history.began or 0.0),
        "parts": _parts(once),
        "sizes": _sizes(once[-1].counted if once else None),
        "ranks": _ranks(_spread(loads, _NUMBERS // max(1, sum(map(len, loads[-1].phases.values()))) if loads else 1)),
        "balance": [msgspec.Raw(line) for line in history.cuts],
        "snapshots": listed(history),
        **history.notes.shown(),
    })  # fmt: skip


def listed(history: History) -> list[msgspec.Raw]:
    """Returns the journal messages about snapshots, by number."""
    return [msgspec.Raw(history.snapshots[n]) for n in sorted(history.snapshots)]


class _Report(msgspec.Struct, frozen=True):
    load: Load
    progress: Progress | None
    counts: Counts | None
    snapshot: Snapshot | None

    @property
    def counted(self) -> Counts | Snapshot | None:
        """Returns the newest message that contains numbers of fragments."""
        messages = [message for message in (self.counts, self.snapshot) if message is not None]
        return max(messages, key=lambda message: (_counted(message), message.seq)) if messages else None


def _read(sample: Sample) -> _Report | None:
    """Returns the decoded sample; None if its journal line with the load of the ranks is damaged. Other damaged lines
    are left out.
    """
    load = _sound(_load, sample.load)
    if load is None:
        return None
    return _Report(
        load, _sound(_progress, sample.progress), _sound(_counts, sample.counts), _sound(_snapshot, sample.snapshot)
    )


def _sound(decoder: msgspec.json.Decoder[T], line: bytes) -> T | None:
    """Decodes a journal line; returns None for an empty or damaged line."""
    try:
        return decoder.decode(line) if line else None
    except DAMAGED:
        return None


def _kept(history: History) -> list[Sample]:
    """Returns the samples that the history keeps, and the newest sample."""
    newest = history.newest
    if newest is None or (history.samples and history.samples[-1] is newest):
        return history.samples
    return [*history.samples, newest]


def _spread(items: Sequence[Any], most: int) -> list[Any]:
    """Returns at most ``most`` evenly spaced items; the last item is always one of them."""
    n, most = len(items), max(1, most)
    return list(items) if n <= most else [items[(k + 1) * n // most - 1] for k in range(most)]


def _columns(reports: list[_Report], began: float) -> dict[str, list[Any]]:
    """Returns the columns of the history by name."""
    columns: dict[str, list[Any]] = {
        "t": [r.load.t for r in reports],
        "step": [r.load.step for r in reports],
        "elapsed": [r.load.wall - began for r in reports],
        "imbalance": [r.load.imbalance for r in reports],
        "fragments": [r.counted.fragments if r.counted is not None else None for r in reports],
    }
    for name in ("elements", "nodes", "shared", "facets", "particles"):
        columns[name] = [getattr(r.counts, name, None) for r in reports]
    for name in ("dt", "limiter", "updates_per_second"):
        columns[name] = [getattr(r.progress, name, None) for r in reports]
    for name in Energy.__struct_fields__:
        columns[name] = [getattr(r.progress.energy, name) if r.progress is not None else None for r in reports]
    shares = [_shares(r.load) for r in reports]
    for name in {name: None for share in shares for name in share}:
        columns[f"share_{name}"] = [share.get(name) for share in shares]
    return columns


def _counted(message: Counts | Snapshot) -> int:
    """Returns the step at which the fragments of the message were counted."""
    return message.counted if isinstance(message, Counts) and message.counted >= 0 else message.step


def _sizes(message: Counts | Snapshot | None) -> dict[str, Any]:
    """Returns the size distribution of the fragments of a message; ``t`` in s."""
    return {"t": message.t, "smallest": message.smallest, "sizes": message.sizes} if message is not None else {}


def _parts(reports: list[_Report]) -> dict[str, dict[str, list[float | None]]]:
    """Returns the energies of each part by name, one value per sample; empty for a case with one part."""
    parts = [report.progress.parts if report.progress is not None else {} for report in reports]
    names = {part: None for each in parts for part in each}
    return {
        part: {name: [getattr(each.get(part), name, None) for each in parts] for name in OF_PARTS} for part in names
    }


def _once(reports: list[_Report]) -> list[_Report]:
    """Returns the samples without repeated times. A run that continued from a checkpoint reports some steps twice; the
    later report is kept.
    """
    kept: list[_Report] = []
    for report in reversed(reports):
        if not kept or report.load.step < kept[-1].load.step:
            kept.append(report)
    return kept[::-1]


def _shares(load: Load) -> dict[str, float]:
    """Returns the fraction of the CPU time of all ranks that each phase takes."""
    total = sum(map(sum, load.phases.values()))
    return {name: sum(seconds) / total if total > 0.0 else 0.0 for name, seconds in load.phases.items()}


def _ranks(loads: list[Load]) -> dict[str, Any]:
    """Returns, for each rank and phase, the CPU time since the previous sample, s, and the waiting time within the
    phase ``exchange``, s.
    """
    names = {name: None for load in loads for name in load.phases}
    return {
        "t": [load.t for load in loads], "steps": [load.steps for load in loads],
        **{name: [load.phases.get(name, []) for load in loads] for name in names},
        "waiting": [load.waiting for load in loads],
    }  # fmt: skip
