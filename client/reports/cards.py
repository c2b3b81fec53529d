"""Texts and tables of a report, one function for each card. The module ``pictures`` makes pictures and charts."""

import json
from collections.abc import Sequence
from html import escape

from conoid.cases.figures import alike, count, counted, crew, duration, exact, percent, rough, shared_unit, si, vector
from conoid.cases.messages import Balance, Log
from conoid.cases.outcome import Outcome
from conoid.cases.output.fragments import Fit

from ..columns import by_part
from ..errors import UnfinishedError
from ..result import Result
from . import html
from .compare import summary

_CUTS = 50
"""Largest number of changes of the load balance in the table (chosen value)."""
_PARAMETERS = {"rayleigh": "mode", "exponential": "mean", "power": "exponent"}


def strip(ended: Outcome | None) -> str:
    """Returns the five main numbers of a run; empty for a run that has not ended."""
    if ended is None:
        return ""
    passed = sum(check.passed for check in ended.reference)
    cost = f"{duration(ended.elapsed)}<small>on {escape(crew(ended.ranks, ended.threads))}</small>"
    entries = [
        ("simulated", f"{escape(si(ended.time, 's'))}<small>{escape(counted(ended.steps, 'step'))}</small>"),
        ("took", cost), ("energy residual", f"{escape(rough(ended.worst_residual))}<small>at worst</small>"),
        ("fragments", f"{count(ended.fragments)}<small>{escape(counted(ended.broken, 'facet'))} broken</small>"),
        ("references", f"{passed} of {len(ended.reference)}<small>pass</small>" if ended.reference else "none"),
    ]  # fmt: skip
    shown = "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in entries)
    return f'<dl class="facts strip">{shown}</dl>'


def references(ended: Outcome | None) -> str:
    """Returns a table of the references: value, expected value, deviation, verdict and source."""
    return html.references(ended)


def results(ended: Outcome | None) -> str:
    """Returns a table of the probes: unit, last value and extremes."""
    rows = []
    for probe in ended.probes if ended is not None else ():
        values = probe.value, probe.least, probe.most
        worth, unit = shared_unit([value for value in values if value is not None], probe.unit)
        rows.append([probe.name, *alike(None if value is None else value / worth for value in values), unit])
    return html.table(["probe", "at the end", "least", "most", "unit"], rows, [1, 2, 3]) if rows else ""


def warnings(ended: Outcome | None) -> str:
    """Returns the warnings of the run."""
    texts = ended.warnings if ended is not None else []
    return (
        f"<ul class=warnings tabindex=0>{''.join(f'<li>{escape(line)}</li>' for line in texts)}</ul>" if texts else ""
    )


def case(entries: dict[str, object]) -> str:
    """Returns title, description and parts of the case."""
    parts = entries.get("parts")
    rows = []
    for part in parts if isinstance(parts, list) else []:
        velocity = part.get("velocity")
        mesh = part.get("mesh") or {}
        size = mesh.get("element_size")
        rows.append([
            part["name"], str(part.get("material", "")), str(mesh.get("shape", "")),
            exact(size, "m") if isinstance(size, float) else "", vector(velocity, "m/s", 6) if velocity else "",
            (part.get("fracture") or {}).get("model", ""),
        ])  # fmt: skip
    about = f"<p>{escape(str(entries.get('description', '')))}</p>" if entries.get("description") else ""
    names = ["part", "material", "shape", "element size", "velocity", "breaks"]
    return about + html.table(names, rows, stacked=True)


def cost(ended: Outcome | None) -> str:
    """Returns a table of the cost of the run and of its errors."""
    if ended is None:
        return ""
    updates = (ended.steps or 0) * (ended.elements or 0)
    each = ended.cpu / updates if updates else None
    rows = [
        ["core time of the time steps", duration(ended.cpu)],
        ["clock time", f"{duration(ended.elapsed)} on {crew(ended.ranks, ended.threads)}"],
        ["tets", f"{count(ended.elements)}, of which {count(ended.eroded)} eroded"],
        ["nodes", f"{count(ended.nodes_initial)} at the start, {count(ended.nodes)} at the end"],
        ["core time for each tet and step", si(each, "s")], ["worst energy residual", rough(ended.worst_residual)],
    ]  # fmt: skip
    off = [
        (abs(check.value - check.expected) / abs(check.expected), check.name)
        for check in ended.reference
        if check.expected
    ]
    if off:
        worst, name = max(off)
        rows.append(["largest deviation of a reference", f"{percent(worst)} ({name})"])
    if ended.peak_memory:
        rows.append(["memory of the rank with most memory", si(max(ended.peak_memory), "B")])
    return html.table(["", ""], rows) + f'<p class="hint digest">digest {escape(ended.digest)}</p>'


def energy(result: Result, ended: Outcome | None) -> str:
    """Returns the energy balance, and the energies of the parts at the end."""
    rows = []
    if ended is not None and ended.energy is not None:
        terms = ((name, getattr(ended.energy, name)) for name in ended.energy.__struct_fields__ if name != "residual")
        there = [(name, value) for name, value in terms if value]
        rows = list(map(list, zip((name for name, _ in there), alike([value for _, value in there], "J"), strict=True)))
    at_the_end = html.table(["energy at the end", ""], rows, [1]) if rows else ""
    return at_the_end + _parts(result)


def _parts(result: Result) -> str:
    """Returns the energy of each part at the end of the history; empty for a case with one part."""
    try:
        energies = by_part(result.history)
    except UnfinishedError:
        return ""
    parts = next(iter(energies.values()), {})
    ended = [part for part, values in parts.items() if values]
    columns = [alike([of[part][-1] for part in ended], "J") for of in energies.values()]
    rows = [list(row) for row in zip(ended, *columns, strict=True)]
    return html.table(["part, at the end", *energies], rows, [1, 2]) if rows else ""


def fragments(result: Result) -> str:
    """Returns the totals of the fragments, and the fitted laws of their masses and extents."""
    found = summary(result)
    if found is None:
        return ""
    rows = [
        ["fragments of ten tets or more", count(found.fragments)],
        ["dust", f"{count(found.dust)}, {percent(found.dust_share)} of the mass"],
        ["largest fragment", f"{percent(found.largest_share)} of the mass"],
    ]
    laws = [*_laws("mass", found.masses, "kg"), *_laws("extent", found.sizes, "m")]
    fits = html.table(["of", "law", "parameter", "value", "ln L"], laws, [3, 4]) if laws else ""
    return html.table(["", ""], rows) + fits


def _laws(what: str, fits: Sequence[Fit], unit: str) -> list[list[str]]:
    """Returns the table rows of the fitted laws, the likeliest law first. The exponent of a power law has no unit."""
    return [
        [what, fit.law, _PARAMETERS[fit.law], exact(fit.parameter, "" if fit.law == "power" else unit, 4),
         exact(fit.log_likelihood, "", 5)]
        for fit in sorted(fits, key=lambda fit: -fit.log_likelihood)
    ]  # fmt: skip


def balance(result: Result, ended: Outcome | None) -> str:
    """Returns the changes of the load balance in the run."""
    cuts = [message for message in result.messages if isinstance(message, Balance)]
    if not cuts:
        return ""
    some = cuts[:_CUTS]
    times, costs, gains = (
        alike(column, "s") for column in ([c.t for c in some], [c.cost for c in some], [c.saved for c in some])
    )
    rows = [
        [t, count(cut.step), cut.cause, count(cut.tets), spent, saved]
        for cut, t, spent, saved in zip(some, times, costs, gains, strict=True)
    ]
    text = f"<p>{counted(len(cuts), 'cut')}{f', the first {_CUTS}:' if len(cuts) > _CUTS else ''}</p>"
    text += html.table(["time", "step", "cause", "tets moved", "cost", "saved by those before"], rows, [1, 3, 4, 5])
    if ended is not None:
        cost, saved = si(ended.balancing_cost, "s"), si(ended.balancing_saved, "s")
        text += f"<p>The changes of the load balance cost {cost} and saved {saved}.</p>"
    return text


def messages(result: Result) -> str:
    """Returns all messages of the log."""
    lines = [f"{message.level}: {message.text}" for message in result.messages if isinstance(message, Log)]
    return f"<pre class=log tabindex=0>{escape(chr(10).join(lines))}</pre>" if lines else ""


def keys(entries: dict[str, object]) -> str:
    """Returns the case with all defaults, in SI units."""
    text = escape(json.dumps(entries, indent=2, ensure_ascii=False))
    shown = f"<pre class=log tabindex=0>{text}</pre>"
    return f"<details><summary>with every default filled in, in SI</summary>{shown}</details>"
