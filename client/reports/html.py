"""HTML elements for reports and notebooks."""

import base64
from collections.abc import Sequence
from html import escape
from importlib import metadata

from conoid.cases.figures import count, counted, crew, duration, exacts, percent, rough, si
from conoid.cases.outcome import Outcome

_NUMBERS = ("value", "expected", "tolerance", "deviation")


def table(
    head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = (), stacked: bool = False
) -> str:
    """Returns an HTML table with escaped text. ``numbers``: indices of the columns that are aligned to the right.
    ``stacked``: on a narrow window, a row becomes a list of names and values.
    """

    def cells(row: Sequence[str], tag: str) -> str:
        return "".join(f"<{tag}{' class=n' * (i in numbers)}>{escape(each)}</{tag}>" for i, each in enumerate(row))

    def line(row: Sequence[str]) -> str:
        if not stacked:
            return f"<tr>{cells(row, 'td')}</tr>"
        return f"<tr>{''.join(cell(name, escape(each)) for name, each in zip(head, row, strict=True))}</tr>"

    top = f"<thead><tr>{cells(head, 'th')}</tr></thead>" if any(head) else ""
    kind = " class=stacked" if stacked else ""
    return f"<div class=wide-table tabindex=0><table{kind}>{top}<tbody>{''.join(map(line, rows))}</tbody></table></div>"


def cell(name: str, body: str, kind: str = "") -> str:
    """Returns a cell of a stacked table with the name of its column; ``body`` is HTML."""
    return f'<td{f" class={kind}" if kind else ""} data-name="{escape(name)}">{body}</td>'


def image(data: bytes, kind: str, alt: str) -> str:
    """Returns an HTML image whose data are embedded in the page."""
    return f'<img alt="{escape(alt)}" src="data:image/{kind};base64,{base64.b64encode(data).decode()}">'


def head(name: str, title: str, ended: Outcome | None) -> str:
    """Returns title, state and main numbers of a run; ``ended`` is None before the end of the run."""
    release = f"Conoid {metadata.version('conoid')}"
    if ended is None:
        state, rows = "<span class=bad>not ended</span>", [["run", name], ["written by", release]]
    else:
        good = "good" if ended.state == "succeeded" else "bad"
        state = f"<span class={good}>{escape(ended.state)}</span> {escape(ended.message)}"
        rows = [
            ["run", name], ["simulated", f"{si(ended.time, 's')} in {counted(ended.steps, 'step')}"],
            ["took", f"{duration(ended.elapsed)} on {crew(ended.ranks, ended.threads)}"],
            ["tets", f"{count(ended.elements)}, of which {count(ended.eroded)} eroded"],
            ["nodes", f"{count(ended.nodes_initial)} at the start, {count(ended.nodes)} at the end"],
            ["fragments", f"{count(ended.fragments)}; {counted(ended.broken, 'facet')} broken"],
            ["worst energy residual", rough(ended.worst_residual)], ["digest", ended.digest],
            ["written by", release],
        ]  # fmt: skip
    return f"<header><h1>{escape(title)}</h1><p>{state}</p>{table(['', ''], rows)}</header>"


def references(ended: Outcome | None) -> str:
    """Returns the references of a run, each with pass or fail; empty for a run without references."""
    if ended is None or not ended.reference:
        return ""
    rows = []
    for check in ended.reference:
        verdict = "<span class=good>pass</span>" if check.passed else "<span class=bad>FAIL</span>"
        value, expected, tolerance = exacts((check.value, check.expected, check.tolerance), check.unit)
        off = percent((check.value - check.expected) / abs(check.expected)) if check.expected else "–"
        values = zip(_NUMBERS, (value, expected, f"± {tolerance}", off), strict=True)
        cells = "".join(cell(name, escape(each), "n") for name, each in values)
        source = cell("source", escape(check.source))
        rows.append(f"<tr>{cell('reference', escape(check.name))}{cells}{cell('result', verdict)}{source}</tr>")
    head = "".join(f"<th class=n>{each}</th>" for each in _NUMBERS)
    head = f"<th>reference</th>{head}<th>result</th><th>source</th>"
    lines = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    return f'<div class="wide-table sources" tabindex=0><table class=stacked>{lines}</table></div>'
