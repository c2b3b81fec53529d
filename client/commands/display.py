"""Display of a run in the terminal: a panel that is redrawn, or, without a terminal, one text line for each update."""

import time
from collections import Counter
from itertools import pairwise

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from conoid.cases.figures import alike, clock, count, counted, duration, fixed, large, percent, rough, si
from conoid.cases.messages import Energy, Log, Snapshot
from conoid.cases.run import State

from ..live import DESCHEDULED, Live
from .console import one_line

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
    DESCHEDULED: "red",
}
_LEVEL_STYLE = {"warning": "yellow", "error": "red"}
_MOST_RANKS = 12
"""Largest number of ranks with a bar in the panel (chosen value: a terminal has no space for more bars)."""
_BAR = 36
"""Largest length of a bar in characters (chosen value for a terminal of 80 columns)."""
_FRAME = 4
"""Number of characters of each line of the panel that its border takes."""
_APART = 2
"""Number of blanks between two columns."""
_DETAILS = (_MOST_RANKS, 6, True), (4, 3, True), (2, 2, True), (2, 2, False), (1, 1, False)
"""Layouts of the panel from large to small. Each layout has the number of ranks with a bar, the number of lines of the
log, and whether energy terms are shown. The first layout that fits the height of the terminal is used."""
_SMALL = 0.005
"""Fraction of the total energy below which energy terms share one text line (chosen value: the bar of such a term would
have no length)."""
Pair = tuple[str, str]


class panel:  # noqa: N801
    """The panel with the progress of a run; rich.live draws it with the width and height of the terminal."""

    def __init__(self, live: Live, log_lines: int = 6) -> None:
        """``log_lines``: largest number of lines of the log in the panel."""
        self.live, self.log_lines = live, log_lines

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Returns the panel; rich calls this method."""
        for detail in _DETAILS:
            drawn = self._drawn(options.max_width - _FRAME, detail)
            if len(console.render_lines(drawn, options, pad=False)) < console.size.height:
                break
        yield drawn

    def _drawn(self, width: int, detail: tuple[int, int, bool]) -> Panel:
        live, (ranks, lines, terms) = self.live, detail
        parts: list[RenderableType] = [_bar(live), *_why(live), *_numbers(_facts(live), width)]
        if live.phases:
            parts += [Text(), *_ranks(live, width, ranks)]
        if live.progress is not None:
            parts += [Text(), _ledger(live.progress.energy, width, terms=terms)]
        if live.log:
            parts += [Text(), *(_log_line(entry, times) for entry, times in _once(live)[-min(lines, self.log_lines) :])]
        return Panel(
            Group(*parts), title=Text(live.title or live.run, style="bold", overflow="ellipsis"), title_align="left",
            border_style="bright_black", padding=(0, 1), subtitle=_under(live), subtitle_align="right",
        )  # fmt: skip


def _under(live: Live) -> str | None:
    """Returns the name of the run and the name of its subscription, for the line below the panel."""
    return " ".join([*([live.run] if live.title else []), *([f"over {live.link}"] if live.link else [])]) or None


def _state(live: Live) -> Text:
    waiting = live.progress is None and not live.state.final and live.changed
    text = Text(live.state.value, style=STATE_STYLE.get(live.state, "bold"))
    return text.append(f"  {duration(time.time() - live.changed)}", style="default") if waiting else text


def _why(live: Live) -> list[Text]:
    """Returns the cause of the end and the message as separate text lines."""
    return [Text(one_line(" · ".join(words)), overflow="fold")] if (words := _explained(live)) else []


def _explained(live: Live) -> list[str]:
    """Returns the cause of the end and the message, unless the state implies them, and a note if no server answers."""
    if live.away:
        return ["state of the last message; no server answers"]
    return [part for part in (live.cause, live.explanation) if part and part != live.state.value]


def _bar(live: Live) -> RenderableType:
    row = Table.grid(padding=(0, 2), expand=True)
    row.add_column(no_wrap=True)
    row.add_column(ratio=1)
    row.add_column(justify="right", no_wrap=True)
    waiting = live.progress is None and not live.state.final
    bar = ProgressBar(total=1.0, completed=live.fraction, pulse=waiting, complete_style="cyan", finished_style="green")
    row.add_row(_state(live), bar, f"{percent(live.fraction):>7}")
    return row


def _numbers(facts: list[Pair], width: int) -> list[RenderableType]:
    """Returns names and values in as many columns as fit into the width; a long text has a line of its own."""
    columns = next((n for n in (3, 2) if _fits(facts, width, n)), 1)
    share = (width - _APART * (columns - 1)) // columns
    name = max((len(name) for name, _ in facts), default=0)
    long = [pair for pair in facts if name + 1 + len(pair[1]) > share]
    short = [pair for pair in facts if pair not in long]
    grid = Table.grid(padding=(0, _APART, 0, 0))
    for _ in range(columns):
        grid.add_column(no_wrap=True, width=share)
    for first in range(0, len(short), columns):
        grid.add_row(*(_named(pair, name) for pair in short[first : first + columns]))
    return [grid, *(_named(pair, name) for pair in long)]


def _fits(facts: list[Pair], width: int, columns: int) -> bool:
    """Returns True if at least three quarters of ``facts`` fit into ``columns`` columns."""
    share, name = (width - _APART * (columns - 1)) // columns, max((len(name) for name, _ in facts), default=0)
    return sum(name + 1 + len(value) > share for _, value in facts) <= max(2, len(facts) // 4)


def _named(pair: Pair, width: int) -> Text:
    return Text(f"{pair[0]:<{width}} ", style="bright_black", overflow="fold").append(pair[1], style="default")


def _facts(live: Live) -> list[Pair]:
    progress, counts, started = live.progress, live.counts, live.started
    facts: list[Pair] = []
    if progress is not None:
        facts += [("time", _time(live)), ("left", "–" if live.state.final else duration(progress.eta)),
                  ("elapsed", duration(live.elapsed)), ("step", count(progress.step)),
                  ("dt", si(progress.dt, "s")), ("held by", progress.limiter)]  # fmt: skip
    size = counts or started
    if size is not None:
        facts += [("elements", count(size.elements)), ("nodes", count(size.nodes))]
    if progress is not None:
        facts.append(("speed", f"{large(progress.updates_per_second)} updates/s"))
    if counts is not None:
        facts += [("fragments", count(counts.fragments)), ("shared", counted(counts.shared, "node")),
                  ("frames", str(live.frames))]  # fmt: skip
        facts += [("particles", counted(counts.particles, "node"))] if counts.particles else []
    if live.snapshot is not None:
        facts.append(("seen", seen(live.snapshot)))
    return facts


def _time(live: Live) -> str:
    end = live.progress.end_time if live.progress is not None else 0.0
    return " of ".join(alike((live.fraction * end, end), "s"))


def _ranks(live: Live, width: int, most: int) -> list[RenderableType]:
    """Returns a bar for each rank, the legend of the colours, and the load imbalance."""
    phases, busy = live.phases, live.busy
    totals = [sum(seconds) for seconds in zip(*phases.values(), strict=True)]
    longest = max(totals, default=0.0) or 1.0
    beside = [f"{percent(busy[rank], 0):>5} busy{_helped(live, rank)}" for rank in range(min(len(totals), most))]
    bar = min(_BAR, max(8, width - len("rank 00") - 2 - max(map(len, beside), default=0)))
    grid = Table.grid(padding=(0, 1))
    grid.add_column(justify="right", style="bright_black", no_wrap=True)
    grid.add_column(no_wrap=True)
    grid.add_column(no_wrap=True)
    for rank, note in enumerate(beside):
        parts = {name: seconds[rank] for name, seconds in phases.items()}
        grid.add_row(f"rank {rank}", _stacked(parts, longest, bar), note)
    whole = sum(totals) or 1.0
    legend = [
        Text(f"■ {name} {percent(sum(seconds) / whole, 0)}", style=_PHASE_STYLE[name])
        for name, seconds in phases.items()
    ]
    more = [Text(f"and {counted(len(totals) - most, 'more rank')}")] if len(totals) > most else []
    imbalance = Text(f"imbalance {fixed(live.load.imbalance if live.load is not None else 1.0)}")
    return [grid, *_flow([*more, *legend, imbalance], width)]


def _flow(items: list[Text], width: int) -> list[Text]:
    """Joins items into as few text lines as possible; no item is broken across lines."""
    lines = [items[0]] if items else []
    for item in items[1:]:
        if len(lines[-1]) + _APART + len(item) <= width:
            lines[-1] = Text(" " * _APART).join([lines[-1], item])
        else:
            lines.append(item)
    return lines


def _helped(live: Live, rank: int) -> str:
    """Returns the CPU load of the threads of a rank, except its first thread, as text."""
    return f", its threads {percent(live.helped[rank], 0)}" if rank < len(live.helped) else ""


def _stacked(parts: dict[str, float], longest: float, cells: int) -> Text:
    """Returns a bar of at most ``cells`` characters. The pieces of the bar end at the cumulative sums, so that
    rounding errors do not add up.
    """
    edges, total = [0], 0.0
    for seconds in parts.values():
        total += seconds
        edges.append(round(cells * total / longest))
    text = Text()
    for name, (low, high) in zip(parts, pairwise(edges), strict=True):
        text.append("█" * (high - low), style=_PHASE_STYLE[name])
    return text.append(" " * (cells - edges[-1]))


def _ledger(energy: Energy, width: int, *, terms: bool) -> RenderableType:
    """Returns a bar for each energy term, with small terms in one line; without ``terms`` only the residual."""
    residual = Text("energy residual ", style="bright_black").append(_residual(energy.residual))
    supplied = f"energy: {si(energy.initial, 'J')} at the start, {si(energy.external, 'J')} from outside"
    residual.append(f"  {supplied}", style="bright_black")
    if not terms:
        return residual
    every = {
        "kinetic": energy.kinetic, "elastic": energy.elastic, "plastic": energy.plastic,
        "viscous": energy.viscous, "contact": energy.contact,
        "friction": energy.friction, "eroded": energy.eroded,
        "fracture": energy.fracture, "cohesive": energy.cohesive, "stepping": energy.stepping,
        "averaging": energy.averaging,
    }  # fmt: skip
    whole = max(abs(energy.initial + energy.external), *(abs(value) for value in every.values()), 1e-300)
    grid = Table.grid(padding=(0, 1))
    grid.add_column(style="bright_black", no_wrap=True)
    grid.add_column(no_wrap=True)
    grid.add_column(justify="right", no_wrap=True)
    bar = min(_BAR, max(8, width - 22))
    large = {name: value for name, value in every.items() if abs(value) >= _SMALL * whole}
    for name, value in large.items():
        length = min(bar, round(bar * abs(value) / whole))
        grid.add_row(name, Text("━" * length + " " * (bar - length), style="blue"), si(value, "J"))
    small = [
        Text(f"{name} {si(value, 'J')}", style="bright_black")
        for name, value in every.items()
        if value and name not in large
    ]
    return Group(grid, *_flow(small, width), residual)


def _residual(residual: float) -> Text:
    style = "green" if residual < 1e-3 else "yellow" if residual < 1e-2 else "bold red"
    return Text(rough(residual), style=style)


def _once(live: Live) -> list[tuple[Log, int]]:
    """Returns each log text once, at its last position, with the number of repetitions; warnings are last."""
    times = Counter(entry.text for entry in live.log)
    last = {entry.text: entry for entry in live.log}
    ordered = sorted(last.values(), key=lambda entry: (entry.level in _LEVEL_STYLE, entry.seq))
    return [(entry, times[entry.text]) for entry in ordered]


def _log_line(entry: Log, times: int) -> Text:
    """Returns a log message as text: a warning is shown completely, another message is cut to one line."""
    warns = entry.level in _LEVEL_STYLE
    text = Text(overflow="fold" if warns else "ellipsis", no_wrap=not warns)
    text.append(f"{clock(entry.wall)} ", style="bright_black")
    again = f" ({times} times)" if times > 1 else ""
    return text.append(one_line(f"{_who(entry)}{entry.text}{again}"), style=_LEVEL_STYLE.get(entry.level, "default"))


def _who(entry: Log) -> str:
    """Returns the level of a log message, or the rank that wrote it."""
    return f"{entry.level}: " if entry.level in _LEVEL_STYLE else f"[{entry.rank}] "


def seen(snapshot: Snapshot) -> str:
    """Returns a short description of a snapshot of the fragments."""
    return f"snapshot {snapshot.n} at t {si(snapshot.t, 's')}: {counted(snapshot.fragments, 'fragment')}"


def line(live: Live) -> str:
    """Returns an update of the run as one plain text line."""
    parts = [clock(live.wall) if live.wall else "", live.run, live.state.value]
    parts += _explained(live)
    progress = live.progress
    if progress is not None:
        parts += [
            percent(live.fraction), f"t {_time(live)}",
            f"step {progress.step}", f"dt {si(progress.dt, 's')} ({progress.limiter})",
            "" if live.state.final else f"left {duration(progress.eta)}",
            f"energy residual {rough(progress.energy.residual)}", f"{large(progress.updates_per_second)} updates/s",
        ]  # fmt: skip
    if live.load is not None:
        parts.append(f"imbalance {fixed(live.load.imbalance)}")
    return "  ".join(part for part in parts if part)
