"""A run in the terminal: a panel that is drawn again and again, or one line an update where there is no terminal."""

import time
from itertools import pairwise

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from conoid.cases.figures import alike, clock, count, counted, duration, fixed, large, percent, rough, si
from conoid.cases.messages import Energy, Log, Snapshot
from conoid.cases.run import State

from .console import one_line
from .live import Live

STATE_STYLE = {
    State.RUNNING: "bold cyan", State.SUCCEEDED: "bold green", State.STOPPING: "bold yellow",
    State.CANCELLED: "bold yellow", State.FAILED: "bold red", State.LOST: "bold red", State.TIMED_OUT: "bold red",
}  # fmt: skip
_PHASE_STYLE = {
    "compute": "cyan",
    "contact": "magenta",
    "exchange": "yellow",
    "output": "green",
    "wait": "bright_black",
}
_LEVEL_STYLE = {"warning": "yellow", "error": "red"}
_MOST_RANKS = 12
"""Ranks with a bar of their own in the panel. Chosen: more do not fit a terminal beside the rest."""
_BAR = 36
"""Characters of a full bar. Chosen for a terminal of 80 columns."""


def panel(live: Live, log_lines: int = 6) -> RenderableType:
    """The whole picture of a run, for rich.live."""
    parts: list[RenderableType] = [_bar(live), _numbers(live)]
    if live.phases:
        parts += [Text(), _ranks(live)]
    if live.progress is not None:
        parts += [Text(), _ledger(live.progress.energy)]
    if live.log:
        parts += [Text(), *(_log_line(entry) for entry in list(live.log)[-log_lines:])]
    title = Text.assemble((live.title or live.run, "bold"), f"  {live.run}" if live.title else "")
    return Panel(
        Group(*parts), title=title, title_align="left", border_style="bright_black", padding=(0, 1),
        subtitle=f"over {live.link}" if live.link else None, subtitle_align="right",
    )  # fmt: skip


def _state(live: Live) -> Text:
    text = Text(live.state.value, style=STATE_STYLE.get(live.state, "bold"))
    waiting = live.progress is None and not live.state.final and live.changed
    told = " · ".join([*_told(live), *([duration(time.time() - live.changed)] if waiting else [])])
    return text.append(f"  {told}", style="default") if told else text


def _told(live: Live) -> list[str]:
    """Cause and message, where they say more than the state; that nobody can say more now."""
    if live.away:
        return ["when it was last heard of; no server answers"]
    return [part for part in (live.cause, live.told) if part and part != live.state.value]


def _bar(live: Live) -> RenderableType:
    row = Table.grid(padding=(0, 2), expand=True)
    row.add_column(no_wrap=True)
    row.add_column(ratio=1)
    row.add_column(justify="right", no_wrap=True)
    waiting = live.progress is None and not live.state.final
    bar = ProgressBar(total=1.0, completed=live.fraction, pulse=waiting, complete_style="cyan", finished_style="green")
    row.add_row(_state(live), bar, f"{percent(live.fraction):>7}")
    return row


def _numbers(live: Live) -> RenderableType:
    grid = Table.grid(padding=(0, 2))
    for _ in range(3):
        grid.add_column(style="bright_black", no_wrap=True)
        grid.add_column(no_wrap=True)
    for row in _number_rows(live):
        grid.add_row(*row)
    return grid


def _number_rows(live: Live) -> list[list[str]]:
    progress, counts, started = live.progress, live.counts, live.started
    rows = []
    if progress is not None:
        left = "–" if live.state.final else duration(progress.eta)
        rows += [
            ["time", _time(live), "step", count(progress.step), "left", left],
            ["dt", si(progress.dt, "s"), "held by", progress.limiter, "elapsed", duration(live.elapsed)],
        ]
    elements = counts.elements if counts is not None else started.elements if started is not None else None
    nodes = counts.nodes if counts is not None else started.nodes if started is not None else None
    if elements is not None and nodes is not None:
        speed = f"{large(progress.updates_per_second)} updates/s" if progress is not None else "–"
        rows.append(["elements", count(elements), "nodes", count(nodes), "speed", speed])
    if counts is not None:
        shared = counted(counts.shared, "node")
        rows.append(["shared", shared, "fragments", count(counts.fragments), "frames", str(live.frames)])
        if counts.particles:
            rows.append(["particles", counted(counts.particles, "node"), "", "", "", ""])
    if live.snapshot is not None:
        rows.append(["seen", seen(live.snapshot), "", "", "", ""])
    return rows


def _time(live: Live) -> str:
    end = live.progress.end_time if live.progress is not None else 0.0
    return " of ".join(alike((live.fraction * end, end), "s"))


def _ranks(live: Live) -> RenderableType:
    phases, busy = live.phases, live.busy
    totals = [sum(seconds) for seconds in zip(*phases.values(), strict=True)]
    longest = max(totals, default=0.0) or 1.0
    grid = Table.grid(padding=(0, 1))
    grid.add_column(justify="right", style="bright_black", no_wrap=True)
    grid.add_column(no_wrap=True)
    grid.add_column(justify="right", no_wrap=True)
    for rank in range(min(len(totals), _MOST_RANKS)):
        parts = {name: seconds[rank] for name, seconds in phases.items()}
        grid.add_row(f"rank {rank}", _stacked(parts, longest), f"{percent(busy[rank], 0):>5} busy{_helped(live, rank)}")
    legend = Text("  ").join(Text(f"■ {name}", style=_PHASE_STYLE[name]) for name in phases)
    imbalance = live.load.imbalance if live.load is not None else 1.0
    more = len(totals) - _MOST_RANKS
    grid.add_row(
        "", legend.append(f"   and {counted(more, 'more rank')}" if more > 0 else ""), f"imbalance {fixed(imbalance)}"
    )
    return grid


def _helped(live: Live, rank: int) -> str:
    """How busy the other threads of a rank are."""
    return f", its threads {percent(live.helped[rank], 0)}" if rank < len(live.helped) else ""


def _stacked(parts: dict[str, float], longest: float) -> Text:
    """A bar of at most ``_BAR`` cells; its pieces end where the sum so far ends, so that rounding does not add up."""
    edges, total = [0], 0.0
    for seconds in parts.values():
        total += seconds
        edges.append(round(_BAR * total / longest))
    text = Text()
    for name, (low, high) in zip(parts, pairwise(edges), strict=True):
        text.append("█" * (high - low), style=_PHASE_STYLE[name])
    return text.append(" " * (_BAR - edges[-1]))


def _ledger(energy: Energy) -> RenderableType:
    terms = {
        "kinetic": energy.kinetic, "elastic": energy.elastic, "plastic": energy.plastic,
        "viscous": energy.viscous, "contact": energy.contact,
        "friction": energy.friction, "eroded": energy.eroded,
        "fracture": energy.fracture, "cohesive": energy.cohesive, "stepping": energy.stepping,
        "averaging": energy.averaging,
    }  # fmt: skip
    whole = max(abs(energy.initial + energy.external), *(abs(value) for value in terms.values()), 1e-300)
    grid = Table.grid(padding=(0, 1))
    grid.add_column(style="bright_black", no_wrap=True)
    grid.add_column(no_wrap=True)
    grid.add_column(justify="right", no_wrap=True)
    for name, value in terms.items():
        if value != 0.0:
            length = min(_BAR, round(_BAR * abs(value) / whole))
            grid.add_row(name, Text("━" * length + " " * (_BAR - length), style="blue"), si(value, "J"))
    supplied = f"of {si(energy.initial, 'J')} at the start and {si(energy.external, 'J')} from outside"
    grid.add_row("residual", _residual(energy.residual).append(f"  {supplied}", style="bright_black"), "")
    return grid


def _residual(residual: float) -> Text:
    style = "green" if residual < 1e-3 else "yellow" if residual < 1e-2 else "bold red"
    return Text(rough(residual), style=style)


def _log_line(entry: Log) -> Text:
    text = Text(overflow="ellipsis", no_wrap=True)
    text.append(f"{clock(entry.wall)} ", style="bright_black")
    return text.append(one_line(f"[{entry.rank}] {entry.text}"), style=_LEVEL_STYLE.get(entry.level, "default"))


def seen(snapshot: Snapshot) -> str:
    """A snapshot of the fragments in some words."""
    return f"snapshot {snapshot.n} at t {si(snapshot.t, 's')}: {counted(snapshot.fragments, 'fragment')}"


def line(live: Live) -> str:
    """One update as one plain line."""
    parts = [clock(live.wall) if live.wall else "", live.run, live.state.value]
    parts += _told(live)
    progress = live.progress
    if progress is not None:
        parts += [
            percent(live.fraction), f"t {_time(live)}",
            f"step {progress.step}", f"dt {si(progress.dt, 's')} ({progress.limiter})",
            "" if live.state.final else f"left {duration(progress.eta)}",
            f"residual {rough(progress.energy.residual)}", f"{large(progress.updates_per_second)} updates/s",
        ]  # fmt: skip
    if live.load is not None:
        parts.append(f"imbalance {fixed(live.load.imbalance)}")
    return "  ".join(part for part in parts if part)
