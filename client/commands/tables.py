"""Tables for the command line: list of runs, one run, outcome, reference numbers. The tables of estimates are in
``validated``.
"""

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Literal, TypeGuard

from rich import box
from rich.table import Table
from rich.text import Text

from conoid.cases.estimates.estimate import estimate
from conoid.cases.figures import (
    alike,
    count,
    counted,
    crew,
    day,
    duration,
    exact,
    exacts,
    fixed,
    large,
    number,
    percent,
    rough,
    si,
    size,
)
from conoid.cases.model.materials import Material
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Check, Compressed, Measured, Outcome
from conoid.cases.reading.library import Constant
from conoid.cases.reference.flat import Scalar
from conoid.cases.run import State

from ..remote.rows import RunRow
from ..remote.run_info import RunInfo
from ..studies.replay import Account
from .display import STATE_STYLE


def table(*columns: str, right: Sequence[str] = (), wide: Sequence[str] = ("case",), least: int | None = None) -> Table:
    """Returns a table without borders. Columns in ``right`` are aligned to the right. The texts of the columns in
    ``wide`` are wrapped if necessary; the first column in ``wide`` has at least ``least`` characters.
    """
    made = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, show_edge=False, padding=(0, 1, 0, 0))
    for column in columns:
        justify: Literal["left", "right"] = "right" if column in right else "left"
        made.add_column(
            column, justify=justify, overflow="fold", no_wrap=column not in wide,
            min_width=least if column == wide[0] else None,
        )  # fmt: skip
    return made


def pairs(entries: Mapping[str, str] | Mapping[str, str | Text]) -> Table:
    """Returns a table of names and values in two columns, without entries that have no value."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bright_black", no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in entries.items():
        if value:
            grid.add_row(name, value)
    return grid


def state_text(state: State, cause: str | None = None) -> Text:
    """Returns the state of a run in its colour, with the cause of the end."""
    text = Text(state.value, style=STATE_STYLE.get(state, "bold"))
    return text.append(f" ({cause})", style="default") if cause and cause != state.value else text


def runs_table(rows: Sequence[RunRow], keys: Sequence[str]) -> Table:
    """Returns a table with one row for each run and the values of ``keys``; in a narrow terminal long texts end with
    an ellipsis.
    """
    last = ("cores", "submitted", "took")
    named = short_names(keys)
    texts_of_values = [_differs(row, named) for row in rows]
    labels = [" ".join(f"{name}={value}" for name, value in _own(row.info).items()) for row in rows]
    more = [name for name, texts in (("values", texts_of_values), ("labels", labels)) if any(texts)]
    made = table("run", "case", "state", *more, *last, right=("cores", "took"), wide=("case", "state", *more))
    made.padding = 0
    for row, values, words in zip(rows, texts_of_values, labels, strict=True):
        run = row.info
        took = duration((run.finished or 0) - run.started) if run.started and run.finished else ""
        some = [text for name, text in (("values", values), ("labels", words)) if name in more]
        cells = [Text(run.name), _how(row), *map(Text, some)]
        for cell in cells:
            cell.no_wrap, cell.overflow = True, "ellipsis"
        made.add_row(run.short or run.id, *cells, _cores(run), day(run.submitted), took)
    return made


def row_of(row: RunRow) -> dict[str, Any]:
    """Returns a row of the list of runs as plain data."""
    return {
        **row.info.listed, "values": row.values, "results": row.results, "units": row.units,
        "references": row.references, "missed": row.missed,
    }  # fmt: skip


def _own(run: RunInfo) -> dict[str, str]:
    """Returns the labels of a run without the labels that a sweep has set."""
    return {name: value for name, value in run.labels.items() if name not in ("sweep", "point")}


def _how(row: RunRow) -> Text:
    """Returns the state of a run, its progress, and the number of failed references."""
    run, text = row.info, state_text(row.info.state, row.info.cause)
    if run.progress is not None and not run.state.final and run.progress.end_time > 0.0:
        text.append(f" {percent(run.progress.t / run.progress.end_time, 0)}", style="default")
    if row.missed:
        text.append(f" {len(row.missed)} of {row.references} missed", style="red")
    return text


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """Returns a short name for each key: as many parts from its end as make the name unique."""
    tails = {key: [".".join(key.split(".")[-n:]) for n in range(1, key.count(".") + 2)] for key in keys}
    times = Counter(tail for own in tails.values() for tail in own)
    return {key: next((tail for tail in own if times[tail] == 1), key) for key, own in tails.items()}


def _differs(row: RunRow, named: Mapping[str, str]) -> str:
    """Returns the values of the case that differ between the runs, each with the short name of its key."""
    there = [(key, name, row.values[key]) for key, name in named.items() if key in row.values]
    return ", ".join(
        f"{name} {exact(value, row.units.get(key, '')) if _is_number(value) else value}" for key, name, value in there
    )


def _is_number(value: Scalar) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _cores(run: RunInfo) -> str:
    return str(run.ranks) if run.threads == 1 else f"{run.ranks}x{run.threads}"


def run_table(run: RunInfo) -> Table:
    """Returns a table with all information about one run."""
    progress = run.progress
    done = progress.t / progress.end_time if progress is not None and progress.end_time > 0.0 else None
    return pairs({
        "run": run.id,
        "case": f"{run.name}  {run.title}".strip(),
        "state": state_text(run.state, run.cause),
        "why": run.message or run.reason,
        "owner": run.owner,
        "ranks": crew(run.ranks, run.threads),
        "submitted": day(run.submitted),
        "started": day(run.started) if run.started else "",
        "finished": day(run.finished) if run.finished else "",
        "progress": "" if progress is None or done is None else (
            f"{percent(done)}, step {count(progress.step)}, dt {si(progress.dt, 's')} limited by {progress.limiter}, "
            f"{duration(progress.eta)} left"
        ),
    })  # fmt: skip


def cases_table(cases: Mapping[str, Case]) -> Table:
    """Returns a table with one row for each shipped case and its approximate CPU time."""
    made = table("case", "title", "tets", "core time", right=("tets", "core time"), wide=("title",))
    for name, case in cases.items():
        expected = estimate(case)
        tets, core = expected.elements, expected.core_seconds
        made.add_row(name, case.title, count(tets), duration(core))
    return made


def materials_table(materials: Mapping[str, Material]) -> Table:
    """Returns a table with one row for each material of the library."""
    made = table("material", "kg/m^3", "what it is", right=("kg/m^3",), wide=("what it is",))
    for name, each in sorted(materials.items()):
        made.add_row(name, number(each.density), each.description)
    return made


def constants_table(constants: Sequence[Constant]) -> Table:
    """Returns a table with one row for each constant of a material, with its confidence and the key of its source."""
    made = table("key", "value", "known", "source", right=("value",))
    for each in constants:
        made.add_row(each.key, each.value, each.confidence, each.source)
    return made


def sources_table(constants: Sequence[Constant]) -> Table:
    """Returns a table of the sources of ``constants``."""
    return pairs({each.source: each.cited for each in constants})


def outcome_table(outcome: Outcome, printed: Collection[str] = ()) -> Table:
    """Returns a table of the outcome of a run with its warnings, except the warnings in ``printed``, which have
    already been printed.
    """
    energy, ranks = outcome.energy, crew(outcome.ranks, outcome.threads)
    entries: dict[str, str | Text] = {"state": state_text(State(outcome.state), outcome.cause), "why": outcome.message}
    speed, setup, worst = outcome.element_updates_per_second, outcome.setup, rough(outcome.worst_residual)
    if outcome.steps:
        entries |= {
            "simulated": f"{si(outcome.time, 's')} in {counted(outcome.steps, 'step')}",
            "took": f"{duration(outcome.elapsed)} on {ranks}, {duration(setup)} to the first step",
            "a step": _a_step(outcome),
            "model": f"{counted(outcome.elements, 'tet')}, {counted(outcome.nodes, 'node')}",
            "speed": "" if math.isnan(speed) else f"{large(speed)} element updates a CPU-second and core",
            "memory": f"{size(max(outcome.peak_memory))} in the largest rank" if outcome.peak_memory else "",
            "energy residual": "" if energy is None else f"{rough(energy.residual)} at the end, {worst} at worst",
            "compression": "; ".join(map(_compressed, outcome.compressed)),
            "digest": outcome.digest[:16],
        }
    return pairs({**entries, "warnings": "\n".join(each for each in outcome.warnings if each not in printed)})


def _a_step(outcome: Outcome) -> str:
    """Returns a text with the serial and the parallel wall time of a time step, for the rank with the longest serial
    time.
    """
    alone, steps = [sum(each) for each in zip(*outcome.serial.values(), strict=True)], outcome.steps
    if not alone or not steps:
        return ""
    rank = alone.index(max(alone))
    shared = sum(each[rank] for each in outcome.parallel.values())
    serial, regions = alike((alone[rank] / steps, shared / steps), "s")
    times = f"{serial} in serial code, {regions} in parallel regions"
    if outcome.threads == 1 or not shared:
        return times
    busy = outcome.helped[rank] / ((outcome.threads - 1) * shared)
    return f"{times}, in which the other threads are busy for {percent(busy, 0)}"


def _compressed(met: Compressed) -> str:
    """Returns the largest compressive stress of a part whose law has no failure in compression, relative to the
    strength of Griffith's criterion.
    """
    beyond = f", {counted(met.tets, 'tet')} beyond the criterion at the same time" if met.tets else ""
    return f"{met.part} up to {si(met.most, 'Pa')}, {fixed(met.times)} times Griffith's criterion{beyond}"


def balance_table(accounts: Sequence[Account], happened: Account) -> Table:
    """Returns a table with the costs of other policies of load balance beside the costs of the run. The saved time
    is relative to a run without load balance.
    """
    made = table(
        "policy", "cuts", "lost", "cost of cuts", "total", "saved", "imbalance",
        right=("cuts", "lost", "cost of cuts", "total", "saved", "imbalance"),
    )  # fmt: skip
    never = next((account.total for account in accounts if account.policy == "never"), math.nan)
    every = (*accounts, happened)
    columns = (
        [each.lost for each in every], [each.cost for each in every], [each.total for each in every],
        [never - each.total for each in every],
    )  # fmt: skip
    texts = zip(*(alike(column, "s") for column in columns), strict=True)
    for account, (lost, cost, total, saved) in zip(every, texts, strict=True):
        own = account is happened
        name, gain = (f"the run: {account.policy}", "") if own else (account.policy, saved)
        made.add_row(name, count(len(account.cuts)), lost, cost, total, gain, fixed(account.imbalance, 3))
    return made


def checks_table(checks: Sequence[Check]) -> Table:
    """Returns a table of the reference numbers: value, expected value, tolerance, verdict."""
    made = table("reference", "value", "expected", "tolerance", "", right=("value", "expected", "tolerance"))
    for check in checks:
        verdict = Text("pass", style="bold green") if check.passed else Text("FAIL", style="bold red")
        value, expected, tolerance = exacts((check.value, check.expected, check.tolerance), check.unit)
        made.add_row(check.name, value, expected, f"± {tolerance}", verdict)
    return made


def probes_table(probes: Sequence[Measured]) -> Table:
    """Returns a table with the last value, the minimum and the maximum of each probe."""
    made = table("probe", "at the end", "min", "max", right=("at the end", "min", "max"), wide=("probe",))
    for probe in probes:
        made.add_row(probe.name, *exacts((probe.value, probe.least, probe.most), probe.unit))
    return made


def end_tables(outcome: Outcome, printed: Collection[str] = ()) -> list[Table | str]:
    """Returns the tables of the outcome, probes and reference numbers of a run, with an empty line between the
    tables.
    """
    parts: list[Table | str] = [outcome_table(outcome, printed)]
    if outcome.probes:
        parts += ["", probes_table(outcome.probes)]
    if outcome.reference:
        parts += ["", checks_table(outcome.reference)]
    return parts
