"""What the command line prints once: lists of runs, one run, estimates, outcomes, reference numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

from rich import box
from rich.table import Table
from rich.text import Text

from conoid.cases.estimate import Estimate, estimate
from conoid.cases.library import Constant
from conoid.cases.loaded import Load
from conoid.cases.materials import Material
from conoid.cases.outcome import Check, Outcome
from conoid.cases.placed import Bulk
from conoid.cases.run import State
from conoid.cases.schema import Boundary, Case, Traction
from conoid.cases.stages import without

from .compare import AT_THE_END, Comparison
from .display import STATE_STYLE
from .figures import count, day, duration, known, number, rough, si
from .replay import Account
from .run import RunInfo

_LONGEST = 60
"""Characters of the value of a key that are shown. Chosen: two lines beside another one; a description is a page."""
_NUMBERS = ("A", "B", "difference", "%")
_LEAST = 26
"""Characters of names beside numbers. Chosen: what they leave of 80, and most names fit."""


def table(*columns: str, right: Sequence[str] = (), wide: Sequence[str] = ("case",), least: int | None = None) -> Table:
    """An open table with these columns; those named in ``right`` are numbers, ``wide`` ones are wrapped where need be,
    the first of them to ``least`` characters.
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
    """Names and values in two columns; entries without a value are left out."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="bright_black", no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in entries.items():
        if value:
            grid.add_row(name, value)
    return grid


def state_text(state: State, cause: str | None = None) -> Text:
    """The state in its colour, with the cause of the end."""
    text = Text(state.value, style=STATE_STYLE.get(state, "bold"))
    return text.append(f" ({cause})", style="default") if cause and cause != state.value else text


def runs_table(runs: Sequence[RunInfo]) -> Table:
    """One line a run: where the terminal is too narrow, names and causes end in an ellipsis."""
    made = table("run", "case", "state", "ranks", "submitted", "took", right=("ranks", "took"), wide=("case", "state"))
    made.padding = 0
    for run in runs:
        took = duration((run.finished or 0) - run.started) if run.started and run.finished else ""
        name, state = Text(run.name), state_text(run.state, run.cause)
        for text in (name, state):
            text.no_wrap, text.overflow = True, "ellipsis"
        made.add_row(run.id, name, state, str(run.ranks), day(run.submitted), took)
    return made


def run_table(run: RunInfo) -> Table:
    """Everything about one run."""
    progress = run.progress
    done = None if progress is None else 100 * progress.t / progress.end_time
    return pairs({
        "run": run.id,
        "case": f"{run.name}  {run.title}".strip(),
        "state": state_text(run.state, run.cause),
        "why": run.message or run.reason,
        "owner": run.owner,
        "ranks": str(run.ranks),
        "submitted": day(run.submitted),
        "started": day(run.started) if run.started else "",
        "finished": day(run.finished) if run.finished else "",
        "progress": "" if progress is None or done is None else (
            f"{done:.1f} %, step {count(progress.step)}, dt {si(progress.dt, 's')} held by {progress.limiter}, "
            f"{duration(progress.eta)} left"
        ),
    })  # fmt: skip


def estimate_table(case: Case, expected: Estimate) -> Table:
    """What a case needs, about; a dash where a mesh file does not tell. And what of it which stage takes."""
    total = expected.core_seconds or 1.0
    shares = sorted(expected.costs.items(), key=lambda cost: -cost[1])
    return pairs({
        "tets": _about(expected.elements, count),
        "nodes": _about(expected.nodes, count),
        "time step": _about(expected.dt, lambda value: si(value, "s")),
        "steps": _about(expected.steps, count),
        "memory": _up_to(expected.memory_bytes, expected.dust_bytes, lambda value: si(value, "B")),
        "core time": _up_to(expected.core_seconds, expected.breaking, duration),
        "of which": ", ".join(f"{name} {100 * seconds / total:.0f} %" for name, seconds in shares),
        "without": ", ".join(without(case)),
    })  # fmt: skip


def _up_to(value: float | None, more: float, shown: Callable[[float], str]) -> str:
    """What it takes, and what where bodies turn to dust, which takes so much ``more``."""
    if value is None or not more:
        return _about(value, shown)
    return f"{_about(value, shown)}, up to {shown(value + more)} if all that may break turns to dust"


def parts_table(case: Case, expected: Estimate) -> Table:
    """What is modelled of each part, about: its size, and what it brings along at the start."""
    right = ("tets", "mass", "extent", "momentum", "energy")
    made = table("part", "material", *right, right=right, wide=("material",))
    for part, size in zip(case.parts, expected.parts, strict=True):
        tets = "–" if size.elements is None else count(size.elements)
        made.add_row(part.name, part.material, tets, *(_brings(size.bulk) if size.bulk is not None else "–" * 4))
    return made


def loads_table(case: Case, acted_on: Sequence[Load]) -> Table:
    """What each traction and each prescribed velocity acts on, about, of what is modelled."""
    columns = ("area", "faces", "nodes")
    made = table("boundary", "acts by", *columns, right=columns, wide=("acts by",))
    for load in acted_on:
        area = "–" if load.area is None else f"about {1e6 * load.area:.3g} mm^2"
        nodes = count(load.nodes) if load.nodes is not None and load.exact else _about(load.nodes, count)
        acts = _acts(case.boundaries[load.boundary])
        made.add_row(f"boundaries[{load.boundary}]", acts, area, _about(load.faces, count), nodes)
    return made


def _acts(spec: Boundary) -> str:
    if isinstance(spec, Traction):
        return f"pressure of {si(spec.pressure, 'Pa')}" if spec.pressure is not None else "stress"
    return spec.kind


def _brings(bulk: Bulk) -> tuple[str, str, str, str]:
    """Mass, extent, momentum and kinetic energy."""
    mass = si(1e3 * bulk.mass, "g") if bulk.mass < 1.0 else f"{bulk.mass:.3g} kg"
    momentum = math.hypot(*bulk.momentum)
    return mass, _extent(bulk.extent), si(momentum, "N s"), si(bulk.energy, "J")


def _extent(lengths: tuple[float, float, float]) -> str:
    """``6 x 6 x 30 mm``."""
    unit, scale = next(((u, s) for u, s in (("m", 1.0), ("mm", 1e3)) if max(lengths) * s >= 1.0), ("µm", 1e6))
    return f"{' x '.join(f'{scale * length:.3g}' for length in lengths)} {unit}"


def _about(value: float | None, shown: Callable[[float], str]) -> str:
    return "–" if value is None else f"about {shown(value)}"


def cases_table(cases: Mapping[str, Case]) -> Table:
    """One line a shipped case, with the CPU time that it takes, about."""
    made = table("case", "title", "tets", "core time", right=("tets", "core time"), wide=("title",))
    for name, case in cases.items():
        expected = estimate(case)
        tets, core = expected.elements, expected.core_seconds
        made.add_row(name, case.title, "–" if tets is None else count(tets), "–" if core is None else duration(core))
    return made


def materials_table(materials: Mapping[str, Material]) -> Table:
    """One line a material of the library."""
    made = table("material", "kg/m^3", "what it is", right=("kg/m^3",), wide=("what it is",))
    for name, each in sorted(materials.items()):
        made.add_row(name, number(each.density), each.description)
    return made


def constants_table(constants: Sequence[Constant]) -> Table:
    """One line a constant: how sure it is, and the key of its source."""
    made = table("key", "value", "known", "source", right=("value",))
    for each in constants:
        made.add_row(each.key, each.value, each.confidence, each.source)
    return made


def sources_table(constants: Sequence[Constant]) -> Table:
    """What the keys of the sources stand for."""
    return pairs({each.source: each.cited for each in constants})


def outcome_table(outcome: Outcome) -> Table:
    """How a run ended."""
    energy, ranks = outcome.energy, f"{outcome.ranks} rank{'' if outcome.ranks == 1 else 's'}"
    entries: dict[str, str | Text] = {"state": state_text(State(outcome.state), outcome.cause), "why": outcome.message}
    speed, setup, worst = outcome.element_updates_per_second, outcome.setup, rough(outcome.worst_residual)
    if outcome.steps:
        entries |= {
            "simulated": f"{si(outcome.time, 's')} in {count(outcome.steps)} steps",
            "took": f"{duration(outcome.elapsed)} on {ranks}, {duration(setup)} to the first step",
            "model": f"{count(outcome.elements)} tets, {count(outcome.nodes)} nodes",
            "speed": "" if math.isnan(speed) else f"{si(speed, '')} element updates a CPU-second and core",
            "memory": f"{si(max(outcome.peak_memory), 'B')} in the largest rank" if outcome.peak_memory else "",
            "energy": "" if energy is None else f"residual {rough(energy.residual)}, worst {worst}",
            "digest": outcome.digest[:16],
        }
    return pairs({**entries, "warnings": "\n".join(outcome.warnings)})


def balance_table(accounts: Sequence[Account], happened: Account) -> Table:
    """What balance policies come to, beside what happened; the time saved is against no cut at all."""
    made = table(
        "policy", "cuts", "lost", "cost of cuts", "total", "saved", "imbalance",
        right=("cuts", "lost", "cost of cuts", "total", "saved", "imbalance"),
    )  # fmt: skip
    never = next((account.total for account in accounts if account.policy == "never"), math.nan)
    for account in (*accounts, happened):
        saved = si(never - account.total, "s") if account is not happened else ""
        times = [si(seconds, "s") for seconds in (account.lost, account.cost, account.total)]
        name = f"the run: {account.policy}" if account is happened else account.policy
        made.add_row(name, str(len(account.cuts)), *times, saved, f"{account.imbalance:.3f}")
    return made


def checks_table(checks: Sequence[Check]) -> Table:
    """The reference numbers: value, expected, tolerance, and whether they agree."""
    made = table("reference", "value", "expected", "tolerance", "", right=("value", "expected", "tolerance"))
    for check in checks:
        verdict = Text("pass", style="bold green") if check.passed else Text("FAIL", style="bold red")
        value, expected = (f"{number(each)} {check.unit}".strip() for each in (check.value, check.expected))
        made.add_row(check.name, value, expected, f"± {number(check.tolerance)}", verdict)
    return made


def _brief(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"


def comparison_tables(found: Comparison) -> list[Table | str]:
    """What differs between two runs, what their ends are, and what is said of their fragments."""
    same = "the same answer, to the bit" if found.same_answer else "different answers"
    keys = table("key", "A", "B", wide=("A", "B"))
    for each in found.keys:
        keys.add_row(each.key, *("–" if value is None else _brief(str(value)) for value in (each.a, each.b)))
    runs = pairs(dict(zip("AB", found.names, strict=True)))
    parts: list[Table | str] = [runs, same, "", keys if found.keys else "no key of the case differs"]
    for title, values in (("at the end", found.ends), ("fragments", found.sizes)):
        if values:
            made = table(title, "unit", *_NUMBERS, right=_NUMBERS, wide=(title,), least=_LEAST)
            made.padding = 0
            for one in values:
                share = known(100 * one.relative, "+.2f") if one.difference else ""
                change = number(one.difference) if one.difference else "same"
                made.add_row(one.name.removesuffix(AT_THE_END), one.unit, number(one.a), number(one.b), change, share)
            parts += ["", made]
    return parts
