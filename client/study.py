"""The runs of one case on several numbers of ranks, as tables: speed-up, what is lost and where, what is sent."""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from conoid.cases.figures import count, fixed, percent, si

from .projection import Network, Projection


@dataclass(frozen=True)
class Study:
    """Runs of a case by their ranks; the first is on one."""

    case: str
    changes: Sequence[str]
    """Keys of the case that were set."""
    cores: int
    network: Network
    runs: Sequence[Projection]

    @property
    def equal(self) -> bool:
        """Whether all runs have the same answer."""
        return len({run.digest for run in self.runs}) == 1

    def speed_up(self, run: Projection) -> float:
        """Projected."""
        return self.runs[0].time / run.time

    def losses(self, run: Projection) -> dict[str, tuple[float, float]]:
        """What each phase adds to the time of a rank, s: its share of the work beyond that of one rank, imbalance."""
        one = self.runs[0].phases
        found = {name: ((p.total - one[name].total) / run.ranks, p.imbalance) for name, p in run.phases.items()}
        return {**found, "messages": (run.messages, 0.0), "collectives": (run.collectives, 0.0)}


def to_json(study: Study) -> bytes:
    """All numbers."""
    runs = [
        {
            **msgspec.to_builtins(run), "projected": run.time, "coarser": run.coarse, "at_worst": run.worst,
            "speed_up": study.speed_up(run),
        }
        for run in study.runs
    ]  # fmt: skip
    data = {
        "case": study.case, "changes": study.changes, "cores": study.cores, "network": study.network,
        "digests_equal": study.equal, "runs": runs,
    }  # fmt: skip
    return msgspec.json.format(msgspec.json.encode(data), indent=2)


def from_json(data: bytes) -> Study:
    """What ``to_json`` wrote."""
    document = msgspec.json.decode(data)
    network = msgspec.convert(document["network"], Network)
    runs = msgspec.convert(document["runs"], tuple[Projection, ...])
    return Study(document["case"], document["changes"], document["cores"], network, runs)


def to_markdown(study: Study) -> str:
    """The tables, with what they mean."""
    network, crowded = study.network, [str(run.ranks) for run in study.runs if run.ranks > study.cores]
    parts = [
        ", ".join(f"`{text}`" for text in (study.case, *study.changes)),
        f"On {study.cores} cores. Projected: with a core a rank, {si(network.latency, 's')} a message, "
        f"{si(network.bandwidth, 'B/s')}; coarser: from windows twice as long; at worst: if ranks waited for each "
        "other after every phase.",
        f"Ranks took turns on the cores, with MPIR_CVAR_ENABLE_HEAVY_YIELD=1: {', '.join(crowded)}." if crowded else "",
        _speeds(study),
        "Projected time of a rank beyond that of one rank over the number of ranks, s: more work + imbalance, and the "
        "share in all of it.",
        _losses(study),
        "Sent in a step:",
        _traffic(study),
        f"Digests: equal, {study.runs[0].digest[:16]}." if study.equal else "Digests: NOT EQUAL.",
    ]
    return "\n\n".join(filter(None, parts)) + "\n"


def _speeds(study: Study) -> str:
    head = (
        "ranks", "steps", "steps a window", "wall s", "work of one / of all %", "projected s", "coarser s",
        "at worst s", "projected speed-up", "projected efficiency %", "speed-up at worst", "imbalance",
        "rebalances",
    )  # fmt: skip
    rows = [
        [
            str(run.ranks), count(run.steps), fixed(run.steps / run.windows, 1),
            fixed(run.wall, 1) if run.ranks <= study.cores else "-", fixed(100 * study.runs[0].work / run.work, 0),
            _seconds(run.time), _seconds(run.coarse), _seconds(run.worst), fixed(study.speed_up(run)),
            fixed(100 * study.speed_up(run) / run.ranks, 0), fixed(study.runs[0].time / run.worst),
            fixed(run.imbalance), str(run.rebalances),
        ]
        for run in study.runs
    ]  # fmt: skip
    return table(head, rows)


def _losses(study: Study) -> str:
    one, runs = study.runs[0].phases, study.runs[1:]
    tables = [study.losses(run) for run in runs]
    wholes = [sum(map(sum, table.values())) for table in tables]
    rows = [
        [name, _seconds(one[name].total) if name in one else "-"]
        + [_loss(*table[name], whole) for table, whole in zip(tables, wholes, strict=True)]
        for name in (tables[0] if tables else ())
        if any(sum(table[name]) for table in tables)
    ]
    return table(["phase", "one rank s", *(f"{run.ranks} ranks" for run in runs)], rows)


def _loss(more: float, imbalance: float, whole: float) -> str:
    share = f" ({percent((more + imbalance) / whole, 0)})" if whole > 0.0 else ""
    return f"{_seconds(more)} + {_seconds(imbalance)}{share}"


def _traffic(study: Study) -> str:
    head = ("ranks", "messages a rank", "kB a rank", "bytes a shared node", "collectives")
    rows = [
        [
            str(run.ranks), fixed(run.messages_sent, 1), fixed(run.bytes_sent / 1000, 1), fixed(run.bytes_shared, 0),
            fixed(run.collectives_made, 1),
        ]
        for run in study.runs[1:]
    ]  # fmt: skip
    return table(head, rows)


def _seconds(value: float) -> str:
    return fixed(value, 0 if abs(value) >= 100 else 2)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown with aligned columns, the first to the left."""
    widths = [max(len(line[i]) for line in (head, *rows)) for i in range(len(head))]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = [
        [line[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(line[1:], widths[1:], strict=True))]
        for line in (head, rule, *rows)
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
