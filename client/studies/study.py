"""Report of a scaling study: speed-up, losses by phase, communication, serial times."""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from conoid.cases.figures import alike, count, crew, fixed, percent, si

from .projection import Network, Projection


@dataclass(frozen=True)
class Study:
    """Runs of a case with different numbers of ranks and threads; the first run has one rank and one thread."""

    case: str
    changes: Sequence[str]
    """Keys of the case that the study changes."""
    cores: int
    network: Network
    runs: Sequence[Projection]

    @property
    def equal(self) -> bool:
        """True if all runs of the study have the same answer."""
        return len({run.digest for run in self.runs}) == 1

    def speed_up(self, run: Projection) -> float:
        """Returns the projected speed-up of a run. For a run with timed tasks it is relative to one thread, computed
        from the same tasks under the same load of the cores.
        """
        alone = next((each for each in self.runs if each.by_tasks and each.cores == 1), self.runs[0])
        return (alone if run.by_tasks else self.runs[0]).time / run.time

    def within(self, run: Projection) -> bool:
        """Returns True if each thread of the run had its own core, so that the wall time is significant."""
        return run.cores <= self.cores and not run.by_tasks

    @property
    def error(self) -> tuple[Projection, Projection] | None:
        """Two runs with two threads: projected from the tasks of one thread, and measured; None if one of these runs
        is missing.
        """
        two = {run.by_tasks: run for run in self.runs if (run.ranks, run.threads) == (1, 2)}
        return (two[True], two[False]) if len(two) == 2 else None

    def losses(self, run: Projection) -> dict[str, tuple[float, float]]:
        """Returns, for each phase, two additional times of a rank, s: the work beyond the equal division of the work
        of one rank, and the imbalance.
        """
        one = self.runs[0].phases
        share = {name: one[name].total / run.threads for name in run.phases}
        found = {name: ((p.total - share[name]) / run.ranks, p.imbalance) for name, p in run.phases.items()}
        return {**found, "messages": (run.messages, 0.0), "collectives": (run.collectives, 0.0)}


def to_json(study: Study) -> bytes:
    """Returns all numbers of the study as JSON."""
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
    """Returns the study from the JSON text that ``to_json`` makes."""
    document = msgspec.json.decode(data)
    network = msgspec.convert(document["network"], Network)
    runs = msgspec.convert(document["runs"], tuple[Projection, ...])
    return Study(document["case"], document["changes"], document["cores"], network, runs)


def to_markdown(study: Study) -> str:
    """Returns the report as Markdown: tables with explanations."""
    network, crowded = study.network, [run.name for run in study.runs if run.cores > study.cores and not run.by_tasks]
    parts = [
        ", ".join(f"`{text}`" for text in (study.case, *study.changes)),
        f"On {study.cores} cores. Projected times assume a core for each thread, {si(network.latency, 's')} latency "
        "and "
        f"{si(network.bandwidth, 'B/s')} bandwidth; coarser: from windows twice as long; at worst: if ranks waited for "
        "each other after every phase.",
        f"Ranks shared cores, with MPIR_CVAR_ENABLE_HEAVY_YIELD=1: {', '.join(crowded)}." if crowded else "",
        _speeds(study),
        _by_tasks(study),
        *_serial(study),
        "Additional projected time of a rank compared with an equal division of the work of one rank, s: additional "
        "work + imbalance, and the share of the phase in the sum.",
        _losses(study),
        *_traffic(study),
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
            run.name, count(run.steps), fixed(run.steps / run.windows, 1),
            fixed(run.wall, 1) if study.within(run) else "-",
            fixed(100 * study.runs[0].work / (run.work + run.helped), 0) if not run.by_tasks else "-",
            _seconds(run.time), _seconds(run.coarse), _seconds(run.worst), fixed(study.speed_up(run)),
            fixed(100 * study.speed_up(run) / run.cores, 0), fixed(study.runs[0].time / run.worst),
            fixed(run.imbalance), str(run.rebalances),
        ]
        for run in study.runs
    ]  # fmt: skip
    return table(head, rows)


def _by_tasks(study: Study) -> str:
    """Returns the explanation of the stars in the tables, with the error of projections."""
    sharing = next((run.sharing for run in study.runs if run.by_tasks), None)
    if sharing is None:
        return ""
    a_step = f"{fixed(sharing.regions / sharing.steps, 1)} parallel regions per step"
    made = (
        f"{fixed(sharing.colours / sharing.regions, 1)} colours per region, {fixed(sharing.tasks / sharing.colours, 1)}"
    )
    turn, call, wake = alike((sharing.turn, sharing.call, sharing.wake), "s")
    text = (
        "With a star: the machine has fewer cores than the run has threads. Therefore the tasks of each parallel "
        "region "
        f"were timed one after the other, and their times were distributed to the threads, colour after colour: "
        f"{a_step}, {made} tasks per colour. Assumed costs, as measured on this machine: {turn} for sharing a colour, "
        f"{call} for calling a sleeping thread, and {wake} until it works. The projection does not include that "
        "threads "
        "slow each other down through the memory."
    )
    if study.error is None:
        return text
    predicted, was = study.error
    so, there = study.speed_up(predicted), study.speed_up(was)
    off = percent(so / there - 1.0, 0)
    compared = f"Two threads are {fixed(so)} times as fast as one thread if projected, {fixed(there)} times if measured"
    return f"{text} {compared}: {off} off."


def _serial(study: Study) -> list[str]:
    """Returns the limits of the gain by threads; empty if the runs lack the data."""
    runs = [run for run in study.runs if run.serial and not run.by_tasks]
    names = [name for name in (runs[0].serial if runs else ()) if any(run.serial[name] for run in runs)]
    rows = [[name, *(_parted(run, [name]) for run in runs)] for name in names]
    if not runs:
        return []
    rows.append(["all", *(_parted(run, names) for run in runs)])
    caption = "Wall time of a step on the busiest rank, ms: serial code + parallel regions."
    return [caption, table(["phase", *(run.name for run in runs)], rows)]


def _parted(run: Projection, names: Sequence[str]) -> str:
    serial, parallel = (1e3 * sum(each[name] for name in names) / run.steps for each in (run.serial, run.parallel))
    return f"{fixed(serial, 3)} + {fixed(parallel, 3)}"


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
    return table(
        ["phase", "one rank s", *(crew(run.ranks, run.threads) + ("*" if run.by_tasks else "") for run in runs)], rows
    )


def _loss(more: float, imbalance: float, whole: float) -> str:
    share = f" ({percent((more + imbalance) / whole, 0)})" if whole > 0.0 else ""
    return f"{_seconds(more)} + {_seconds(imbalance)}{share}"


def _traffic(study: Study) -> list[str]:
    head = ("ranks", "messages a rank", "kB a rank", "bytes a shared node", "collectives")
    rows = [
        [
            run.name, fixed(run.messages_sent, 1), fixed(run.bytes_sent / 1000, 1), fixed(run.bytes_shared, 0),
            fixed(run.collectives_made, 1),
        ]
        for run in study.runs[1:] if run.ranks > 1 and not run.by_tasks
    ]  # fmt: skip
    return ["Sent in a step:", table(head, rows)] if rows else []


def _seconds(value: float) -> str:
    return fixed(value, 0 if abs(value) >= 100 else 2)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Returns a Markdown table with aligned columns; the first column is aligned to the left."""
    widths = [max(len(line[i]) for line in (head, *rows)) for i in range(len(head))]
    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = [
        [line[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(line[1:], widths[1:], strict=True))]
        for line in (head, rule, *rows)
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
