"""``conoid report``: a run as one HTML file that needs no server, no network and nothing beside it."""

import json
import tempfile
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

from conoid.cases.figures import alike, count, counted, exact, percent, si, vector
from conoid.cases.fragments import Fit
from conoid.cases.messages import Balance, Load, Log
from conoid.cases.outcome import Outcome

from . import html, replay3d
from .columns import by_part
from .compare import summary
from .errors import UnfinishedError, ViewError
from .result import Result
from .saving import save_text

_SHOTS = 3
"""Times of a picture, evenly over the frames. Chosen: they fit beside each other."""
_CUTS = 50
"""Cuts that are listed. Chosen."""
_STYLE = """
:root { color-scheme: light; --ink: #1d2733; --pale: #5a6775; --line: #d9e0e7; --good: #1d6b36; --bad: #a3211d }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: #fff; max-width: 72rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.6rem; margin: 0 0 .3rem } h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid var(--line) }
table { border-collapse: collapse; margin: .4rem 0 } th, td { text-align: left; padding: .15rem .9rem .15rem 0; vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums } th { color: var(--pale); font-weight: 500 }
img { max-width: 100%; height: auto } pre { overflow-x: auto; font-size: 12.5px; background: #f5f7f9; padding: .8rem }
.good { color: var(--good); font-weight: 600 } .bad { color: var(--bad); font-weight: 600 } .pale { color: var(--pale) }
.wide { overflow-x: auto } summary { cursor: pointer }
"""  # noqa: E501


def write(
    result: Result, out: Path, fields: Sequence[str] | None = None, at: Callable[[str], None] = lambda _: None
) -> Path:
    """Writes the report of a run; ``fields`` are drawn, none for no pictures, by default what tells most. ``at`` is
    called with what it is at.

    Raises ClientError, UnfinishedError where not even the case is there.
    """
    case = result.case
    title = str(case.get("title") or case.get("name"))
    sections: dict[str, Callable[[], str]] = {
        "Case": lambda: _case(case),
        "References": lambda: html.references(_outcome(result)),
        "Pictures": lambda: _pictures(result, fields, at),
        "Replay": lambda: replay3d.html(result),
        "Energy": lambda: _energy(result),
        "Fragments": lambda: _fragments(result),
        "Time step": lambda: _curve(result, "steps", "Length of the time step over time"),
        "Probes": lambda: _curve(result, "columns", "Probes over time"),
        "Ranks and balance": lambda: _balance(result),
        "Messages": lambda: _messages(result),
        "All keys of the case": lambda: _keys(case),
    }
    parts = [html.head(result.folder.name, title, _outcome(result))]
    for name, made in sections.items():
        at(f"writing {out}: {name.lower()}")
        parts.append(_section(name, made()))
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{escape(title)}: {escape(result.folder.name)}</title><style>{_STYLE}</style></head>"
        f"<body>{''.join(parts)}</body></html>"
    )
    save_text(out, page)
    return out


def _section(title: str, body: str) -> str:
    return f"<section><h2>{escape(title)}</h2>{body}</section>" if body else ""


def _outcome(result: Result) -> Outcome | None:
    try:
        return result.outcome
    except UnfinishedError:
        return None


def _case(case: dict[str, object]) -> str:
    parts = case.get("parts")
    rows = []
    for part in parts if isinstance(parts, list) else []:
        velocity = part.get("velocity")
        breaks = (part.get("fracture") or {}).get("model", "")
        mesh = part.get("mesh") or {}
        size = mesh.get("element_size")
        rows.append([
            part["name"], str(part.get("material", "")), str(mesh.get("shape", "")),
            exact(size, "m") if isinstance(size, float) else "", vector(velocity, "m/s", 6) if velocity else "", breaks,
        ])  # fmt: skip
    told = f"<p>{escape(str(case.get('description', '')))}</p>" if case.get("description") else ""
    return told + html.table(["part", "material", "shape", "element size", "velocity", "breaks"], rows)


def telling(result: Result) -> list[str]:
    """The fields that say most of a run: its fragments, its plastic strain or its stress; and the speed."""
    ended = _outcome(result)
    if result.fragment_tables:
        return ["fragment", "speed"]
    energy = ended.energy if ended is not None else None
    return ["plastic_strain" if energy is not None and energy.plastic > 0.0 else "mises", "speed"]


def _pictures(result: Result, fields: Sequence[str] | None, at: Callable[[str], None]) -> str:
    """Each field at some times; what cannot be drawn is said."""
    frames, fields = [frame.index for frame in result.frames], telling(result) if fields is None else fields
    if not frames or not fields:
        return ""
    chosen = sorted({frames[round((len(frames) - 1) * (k + 1) / _SHOTS)] for k in range(_SHOTS)})
    drawn = []
    with tempfile.TemporaryDirectory() as folder:
        for field in fields:
            at(f"drawing {field} at {len(chosen)} times")
            try:
                out = Path(folder) / f"{field}.png"
                result.view(field, out, frame=chosen, size=(1400, 800), mirror="auto")
                drawn.append(html.image(out.read_bytes(), "png", f"{field} at {len(chosen)} times"))
            except ViewError as error:
                drawn.append(f"<p class=pale>{escape(field)}: {escape(str(error))}</p>")
    return "".join(drawn)


def _svg(draw: Callable[[Path], object], alt: str) -> str:
    """A chart, or what it lacks."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "chart.svg"
        try:
            draw(out)
        except UnfinishedError:
            return ""
        except ModuleNotFoundError as error:
            return f"<p class=pale>charts need the extra 'view' of conoid: {escape(str(error))}</p>"
        return html.image(out.read_bytes(), "svg+xml", alt)


def _curve(result: Result, name: str, alt: str) -> str:
    def draw(out: Path) -> None:
        from . import curves  # matplotlib is loaded when it is needed

        curves.save(getattr(curves, name)(result.history), out)

    return _svg(draw, alt)


def _energy(result: Result) -> str:
    ended = _outcome(result)
    rows = []
    if ended is not None and ended.energy is not None:
        terms = ((name, getattr(ended.energy, name)) for name in ended.energy.__struct_fields__ if name != "residual")
        there = [(name, value) for name, value in terms if value]
        rows = list(map(list, zip((name for name, _ in there), alike([value for _, value in there], "J"), strict=True)))
    at_the_end = html.table(["energy at the end", ""], rows, [1]) if rows else ""
    return _curve(result, "energy", "The energy ledger over time") + at_the_end + _parts(result)


def _parts(result: Result) -> str:
    """The energy of each part at the end of the history; nothing where there is one part alone."""
    try:
        told = by_part(result.history)
    except UnfinishedError:
        return ""
    parts = next(iter(told.values()), {})
    ended = [part for part, values in parts.items() if values]
    columns = [alike([of[part][-1] for part in ended], "J") for of in told.values()]
    rows = [list(row) for row in zip(ended, *columns, strict=True)]
    return html.table(["part, at the end", *told], rows, [1, 2]) if rows else ""


def _fragments(result: Result) -> str:
    if not result.fragment_tables:
        return ""

    def draw(out: Path) -> None:
        from . import curves  # matplotlib is loaded when it is needed

        curves.save(curves.fragments([result.fragments_of(index) for index in result.fragment_tables]), out)

    said = summary(result)
    assert said is not None
    rows = [
        ["fragments of ten tets or more", count(said.fragments)],
        ["dust", f"{count(said.dust)}, {percent(said.dust_share)} of the mass"],
        ["largest fragment", f"{percent(said.largest_share)} of the mass"],
        *([f"masses, {fit.law} law", _fit(fit, "kg")] for fit in said.masses),
        *([f"extents, {fit.law} law", _fit(fit, "m")] for fit in said.sizes),
    ]
    return _svg(draw, "Number of fragments over time and by mass") + html.table(["", ""], rows)


def _fit(fit: Fit, unit: str) -> str:
    """The exponent of a power law has no unit."""
    return f"{exact(fit.parameter, '' if fit.law == 'power' else unit, 4)}, ln L {exact(fit.log_likelihood, '', 5)}"


def _balance(result: Result) -> str:
    messages = result.messages
    ended = _outcome(result)
    if not any(isinstance(message, Load) for message in messages):
        return ""

    def draw(out: Path) -> None:
        from . import charts  # matplotlib is loaded when it is needed

        name = str(result.case.get("name", ""))
        charts.balance(charts.course(messages), f"{name}, {result.folder.name}", name, out)

    cuts = [message for message in messages if isinstance(message, Balance)]
    some = cuts[:_CUTS]
    times, costs, gains = (
        alike(column, "s") for column in ([c.t for c in some], [c.cost for c in some], [c.saved for c in some])
    )
    rows = [
        [t, count(cut.step), cut.cause, count(cut.tets), cost, saved]
        for cut, t, cost, saved in zip(some, times, costs, gains, strict=True)
    ]
    told = f"<p>{counted(len(cuts), 'cut')}{f', the first {_CUTS} of them:' if len(cuts) > _CUTS else ''}</p>"
    if cuts:
        told += html.table(["time", "step", "cause", "tets moved", "cost", "saved by those before"], rows, [1, 3, 4, 5])
    if cuts and ended is not None:
        told += f"<p>They cost {si(ended.balancing_cost, 's')} and saved {si(ended.balancing_saved, 's')}.</p>"
    return _svg(draw, "Outside nodes of each rank, and CPU time by phase") + told


def _messages(result: Result) -> str:
    ended = _outcome(result)
    lines = [*(ended.warnings if ended is not None else [])]
    lines += [f"{message.level}: {message.text}" for message in result.messages if isinstance(message, Log)]
    return f"<pre tabindex=0>{escape(chr(10).join(lines))}</pre>" if lines else ""


def _keys(case: dict[str, object]) -> str:
    text = escape(json.dumps(case, indent=2, ensure_ascii=False))
    return f"<details><summary>with every default filled in, in SI</summary><pre tabindex=0>{text}</pre></details>"
