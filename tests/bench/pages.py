"""The page of the verification catalogue: one line for each row of the catalogue, followed by the details of each row;
failed rows are red.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .table import Cell, table

RED, GREEN, GREY = "🔴", "🟢", "⚪"
_HELD = 3
"""Number of assertions of a test that the page shows (chosen value)."""
_WIDE = 96
"""Number of characters of an assertion that the page shows (chosen value)."""


@dataclass
class Line:
    """Results for one row of the catalogue."""

    row: Mapping[str, Any]
    checks: list[list[Cell]] = field(default_factory=list)
    tests: list[list[Cell]] = field(default_factory=list)
    hard: list[list[Cell]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    held: int = 0
    cpu: float = 0.0

    @property
    def mark(self) -> str:
        """Colour of the row: red if a check fails, grey if no check was run."""
        if self.faults:
            return RED
        return GREEN if self.held else GREY


def book(rows: Sequence[Mapping[str, Any]], parts: Mapping[str, Any]) -> tuple[str, int]:
    """Returns the page, and the number of failed rows."""
    lines = [_line(row, parts) for row in rows]
    known = {row["id"] for row in rows}
    stray = sorted({r for v in _found(parts, "hard", []) for r in v["hard"]["rows"]} - known)
    failed = [line for line in lines if line.faults]
    summary: list[list[Cell]] = [
        [line.mark, line.row["id"], line.row["what"], line.held, len(line.faults), round(line.cpu, 1), _missing(line)]
        for line in lines
    ]
    text = [
        "# The accuracy book", _preface(parts, lines, failed),
        table(["", "row", "what", "held", "failed", "CPU s", "not held by anything, or not run here"], summary),
        *(f"Rows of the hard suite that the catalogue lacks: {', '.join(stray)}." for _ in stray[:1]),
        *(_detail(line) for line in lines if line.checks or line.tests or line.hard or line.faults),
    ]  # fmt: skip
    return "\n\n".join(text) + "\n", len(failed)


def _preface(parts: Mapping[str, Any], lines: Sequence[Line], failed: Sequence[Line]) -> str:
    walls = ", ".join(f"{name} {part['wall'] / 60:.1f} min{' (quick)' if part['quick'] else ''}"
                      for name, part in parts.items())  # fmt: skip
    machines = {value for part in parts.values() for key, value in part["machine"].items() if key == "processor"}
    on = f" on {', '.join(map(str, machines))}" if machines else ""
    return (
        "Only `make accuracy` writes this page: do not edit it. The page has every row of the verification catalogue "
        "(V: exact or code to code, E: experiments and published runs, H: hard cases) with the measured value, the "
        "expected value and its source, the error and the CPU time. Numbers of a shipped case are those of its "
        "references, for the case itself and, where possible, with elements twice as large. Numbers of a test are "
        "those that its assertions compared when they passed last. "
        f"{GREEN}: the row holds; {RED}: the row fails; {GREY}: the row was not run or is open.\n\n"
        f"Wall time of the parts: {walls}{on}. {len(lines)} rows: {sum(line.mark == GREEN for line in lines)} hold, "
        f"{len(failed)} fail, {sum(line.mark == GREY for line in lines)} open or not run"
        f"{': ' + ', '.join(line.row['id'] for line in failed) + ' fail' if failed else ''}."
    )


def _missing(line: Line) -> str:
    return "; ".join(filter(None, [line.row.get("open", ""), *dict.fromkeys(line.missing)]))


def _found(parts: Mapping[str, Any], name: str, nothing: Any) -> Any:
    return parts[name]["found"] if name in parts else nothing


def _line(row: Mapping[str, Any], parts: Mapping[str, Any]) -> Line:
    line = Line(row)
    for name in row.get("cases", ()):
        _add_case(line, name, _found(parts, "shipped", {"runs": {}})["runs"])
    for node in row.get("tests", ()):
        _add_tests(line, node, _found(parts, "tests", {}))
    for verdict in _found(parts, "hard", []):
        if row["id"] in verdict["hard"]["rows"]:
            _add_hard(line, verdict)
    return line


def _add_case(line: Line, name: str, runs: Mapping[str, Any]) -> None:
    """Adds the results of the reference values of a case to the row. Reference values of the coarser run are shown, but
    do not make a row of the catalogue fail.
    """
    for label in ("as it is", "coarser"):
        outcome = runs.get(f"{name}|{label}")
        if outcome is None:
            line.missing += [f"{name} not run here"] if label == "as it is" else []
            continue
        line.cpu += outcome.get("cpu", 0.0)
        if outcome["state"] != "succeeded":
            line.faults += [f"{name}: {outcome['state']}, {outcome['message']}"] if label == "as it is" else []
            line.checks.append([name, label, outcome["state"], None, None, None, None, None, outcome["message"][:60]])
            continue
        for check in outcome["reference"]:
            bad = not check["pass"] and label == "as it is"
            line.faults += [f"{name}: {check['name']}"] if bad else []
            line.held += label == "as it is" and check["pass"]
            line.checks.append(_check(name, label, outcome, check, bad))


def _check(name: str, label: str, outcome: Mapping[str, Any], check: Mapping[str, Any], bad: bool) -> list[Cell]:
    value, expected = check["value"], check["expected"]
    error = f"{100.0 * (value - expected) / expected:+.2g} %" if expected and value is not None else "-"
    measured = "no number" if value is None else f"{value:.5g}"
    return [
        f"{RED} {name}" if bad else name, label, f"{check['name']}, {check['unit']}".rstrip(", "), measured,
        f"{expected:.5g} +- {check['tolerance']:.2g}", error, outcome["elements"], round(outcome["cpu"], 1),
        check["source"].replace("|", "/"),
    ]  # fmt: skip


def _add_tests(line: Line, node: str, recorded: Mapping[str, Any]) -> None:
    wanted = f"tests/{node}"
    mine = {k: v for k, v in recorded.items() if k == wanted or k.startswith((f"{wanted}::", f"{wanted}["))}
    if not any(v["outcome"] in ("passed", "failed", "expected to fail") for v in mine.values()):
        line.missing.append(f"{node.rpartition('/')[2].rpartition('::')[2]} not run here")
    for name, found in mine.items():
        line.cpu += found["cpu"]
        line.held += found["outcome"] == "passed"
        title = name.rpartition("::")[2].removeprefix("test_").replace("_", " ").replace("|", "/")
        if found["outcome"] in ("failed", "expected to fail"):
            line.faults.append(f"{title}: {found['why']}")
            title = f"{RED} {title}"
        held = [text.replace("|", "\\|")[:_WIDE] for _, text in list(found["held"].values())[-_HELD:]]
        line.tests.append([title, "; ".join(f"`{text}`" for text in held) or "-", round(found["cpu"], 1)])


def _add_hard(line: Line, verdict: Mapping[str, Any]) -> None:
    outcome, name = verdict["outcome"], verdict["hard"]["name"]
    line.cpu += outcome["cpu"]
    line.held += not verdict["faults"]
    line.faults += [f"{name}: {fault}" for fault in verdict["faults"]]
    drifted = verdict["drifted"]
    line.hard.append([
        f"{RED} {name}" if verdict["faults"] else name, verdict["title"].replace("|", "/"), outcome["state"],
        f"{outcome['worst_residual']:.1e}", "-" if drifted is None else f"{drifted:.1e}", outcome["steps"],
        outcome["elements"], round(outcome["cpu"], 1),
    ])  # fmt: skip


def _detail(line: Line) -> str:
    parts = [f"## {line.mark} {line.row['id']}: {line.row['what']}", *_tables(line)]
    parts += ["\n".join(f"- {RED} {fault}" for fault in line.faults)] if line.faults else []
    return "\n\n".join(parts)


def _tables(line: Line) -> Iterator[str]:
    heads: Iterable[tuple[list[str], list[list[Cell]]]] = (
        (["case", "mesh", "quantity", "measured", "expected", "error", "tets", "CPU s", "source"], line.checks),
        (["test", "what it compared last", "CPU s"], line.tests),
        (["hard case", "what", "state", "worst residual", "momentum drift", "steps", "tets", "CPU s"], line.hard),
    )
    yield from (table(head, rows) for head, rows in heads if rows)
