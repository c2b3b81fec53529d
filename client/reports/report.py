"""Report of a run as one HTML file that needs no server, no network and no other file (``conoid report``). The
report has the style sheets of the live page: the bodies are drawn at the left, the main numbers stand beside them,
and charts stand below.
"""

from collections.abc import Callable, Sequence
from html import escape
from importlib import metadata
from pathlib import Path

from conoid.cases.outcome import Outcome

from ..errors import ClientError, UnfinishedError
from ..local.atomic import save_text
from ..result import Result
from . import cards, pictures, replay3d

_WEB = Path(__file__).parent.parent / "web"
_SHEETS = ("style.css", "run.css", "body.css")
_STYLE = """
:root { color-scheme: light dark }
main { max-width: 1880px; margin: 0 auto }
.stage, .now { height: max(420px, calc(100dvh - var(--top) - 92px)) }
.now { overflow: auto } .now > .card { flex: none } .now table { font-size: 13px }
.now th, .now td { padding-right: 9px } .now td:last-child { padding-right: 0 }
.plain, .plain + .now { position: static; height: auto } .plain > .card { height: auto }
.sheets { columns: 3 390px; column-gap: 12px } .sheets table { width: 100% } .sheets td:last-child { padding-right: 0 }
.sheets > .card { break-inside: avoid; margin-bottom: 12px; padding: 12px 14px }
.plates { display: grid; gap: 12px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 380px), 1fr)) }
.plate { margin: 0 } .plate img { display: block; width: 100%; height: auto }
.plate figcaption { display: flex; flex-wrap: wrap; align-items: center; gap: 4px 10px; font-size: 13.5px }
.scale { display: inline-flex; align-items: center; gap: 8px; color: var(--soft) }
.scale > i { width: 120px; height: 10px; border-radius: 3px; border: 1px solid var(--line) }
.card > svg { display: block; width: 100%; height: auto; color: var(--ink) }
.card > svg text { font-family: inherit !important; fill: currentColor !important }
table { border-collapse: collapse; margin: 2px 0 8px; font-size: 14px } .wide-table { overflow-x: auto }
th { text-align: left; font-weight: 500; font-size: 13px; color: var(--soft) }
th, td { padding: 5px 14px 5px 0; vertical-align: top } tbody tr { border-top: 1px solid var(--line) }
td.n, th.n { text-align: right; white-space: nowrap } td { overflow-wrap: break-word }
.sources td:first-child { min-width: 6em } .sources td:last-child { min-width: 15em }
.digest { overflow-wrap: anywhere; font: 12.5px var(--mono) }
span.good, span.bad { font-weight: 600 } summary { cursor: pointer }
.now p { margin: 0 0 8px } .log { max-height: 420px }
@media (max-width: 959px) { .stage, .now { height: auto } .now .warnings { max-height: none } }
@media (max-width: 760px) {
  .stacked td.n { text-align: left; white-space: normal } .sources td:last-child { min-width: 0 }
  th, td { padding-right: 8px } table { font-size: 13px }
}
@media print {
  .bench { grid-template-columns: 1fr } .stage { position: static; height: 480px } .plain, .now { height: auto }
  .card { break-inside: avoid; box-shadow: none } .log, .warnings { max-height: none }
  .tools3d, .controls, .scrub { display: none !important } .top { position: static }
}
"""
_MARK = (
    '<svg viewBox="0 0 32 32" width="26" height="26" aria-hidden="true"><path class="cone" d="M13 6h6l9 20H4z"/>'
    '<path class="crack" d="M16 6l-2 7 4 4-3 9"/><circle class="ball" cx="16" cy="3.2" r="2.4"/></svg>'
)


def write(
    result: Result, out: Path, fields: Sequence[str] | None = None, at: Callable[[str], None] = lambda _: None
) -> Path:
    """Writes the report of a run. ``fields``: fields to draw; by default the most informative fields, and an empty list
    draws no pictures. ``at`` is called with a description of each step of the work.

    Raises ClientError, UnfinishedError for a run without a case.
    """
    case, ended = result.case, _outcome(result)
    title = str(case.get("title") or case.get("name"))
    shown = telling(result) if fields is None else fields

    def say(what: str) -> None:
        at(f"writing {out}: {what}")

    say("replay")
    stage = replay3d.html(result)
    say("pictures")
    drawn = pictures.pictures(result, shown, at)
    pictured = _card("Pictures", f'<div class="plates">{drawn}</div>' if drawn else "")
    about = _card("Case", cards.case(case))
    kind = "stage" if stage else "stage plain"
    first, *others = filter(None, [stage, pictured, about])
    body = "".join([
        _head(result.folder.name, title, str(case.get("name", "")), ended),
        f'<div class="bench"><div class="{kind}">{first}</div>',
        f'<div class="now" tabindex="0" role="region" aria-label="main numbers">{_now(ended)}</div></div>',
        _card("References", cards.references(ended)), *others,
        f'<div class="cards charts">{_charts(result, say)}</div>',
        f'<div class="sheets">{_sheets(result, ended)}</div>',
        _card("Messages", cards.messages(result) if _has_journal(result) else ""),
        _card("All keys of the case", cards.keys(case)),
    ])  # fmt: skip
    save_text(out, _page(f"{title}: {result.folder.name}", body))
    return out


def _page(title: str, body: str) -> str:
    sheets = "".join((_WEB / name).read_text(encoding="utf-8") for name in _SHEETS if (_WEB / name).is_file())
    release = escape(f"Conoid {metadata.version('conoid')}")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{sheets}{_STYLE}</style></head><body>"
        f'<header class="top"><span class="brand">{_MARK}<span>Conoid</span></span><span class="grow"></span>'
        f'<span class="who">written by {release}</span></header>'
        f'<main><div class="work">{body}</div></main></body></html>'
    )


def _head(name: str, title: str, case: str, ended: Outcome | None) -> str:
    state = ended.state if ended is not None else "not ended"
    message = f'<p class="message">{escape(ended.message)}</p>' if ended is not None and ended.message else ""
    kind = state if ended is not None else "running"
    return (
        f'<header class="head"><div class="run-head"><div class="titles"><h1>{escape(title)}</h1>'
        f'<div class="sub">{escape(" · ".join(dict.fromkeys(filter(None, [case, name]))))}</div></div>'
        f'<div class="side"><span class="pill {escape(kind)}">{escape(state.replace("_", " "))}</span></div></div>'
        f"{message}</header>"
    )


def _now(ended: Outcome | None) -> str:
    """Returns the column beside the 3-D view."""
    return "".join([
        _card("Run", cards.strip(ended)), _card("Warnings", cards.warnings(ended)),
        _card("Results", cards.results(ended)), _card("Cost and error", cards.cost(ended)),
    ])  # fmt: skip


def _charts(result: Result, say: Callable[[str], None]) -> str:
    """Returns the charts, each on a card of its own."""
    say("energy")
    found = pictures.curve(result, "energy")
    say("fragments")
    found += pictures.fragments(result) if result.fragment_tables else []
    say("time step and probes")
    found += [*pictures.curve(result, "steps"), *pictures.curve(result, "columns")]
    say("balance")
    found += pictures.balance(result) if _has_journal(result) else []
    return "".join(f'<section class="card">{body}</section>' for body in found)


def _sheets(result: Result, ended: Outcome | None) -> str:
    """Returns the cards with tables, which have different heights."""
    return "".join([
        _card("Energy", cards.energy(result, ended)),
        _card("Fragments", cards.fragments(result) if result.fragment_tables else ""),
        _card("Ranks and balance", cards.balance(result, ended) if _has_journal(result) else ""),
    ])  # fmt: skip


def _card(title: str, body: str) -> str:
    head = f'<section class="card"><div class="card-head"><h2>{escape(title)}</h2></div>'
    return f"{head}{body}</section>" if body else ""


def _outcome(result: Result) -> Outcome | None:
    try:
        return result.outcome
    except UnfinishedError:
        return None


def _has_journal(result: Result) -> bool:
    try:
        return bool(result.messages)
    except ClientError:
        return False


def telling(result: Result) -> list[str]:
    """Returns the most informative fields of a run: fragments, plastic strain or stress, and speed."""
    ended = _outcome(result)
    if result.fragment_tables:
        return ["fragment", "speed"]
    energy = ended.energy if ended is not None else None
    return ["plastic_strain" if energy is not None and energy.plastic > 0.0 else "mises", "speed"]
