"""Table of the results of the drill."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from .judge import TRUE, Row

WORDS = ("stranded", "lie", "orphan", "double", "acknowledged and lost", "late")
"""First words of wrong verdicts, in the order of the summary. Other wrong verdicts are counted after the verdicts of
this list."""

NAMED = 12
"""Number of untried groups of faults that the table names."""


def write(path: Path, rows: Sequence[Row], untried: Sequence[str] = ()) -> int:
    """Writes and prints the table; returns 0 if all verdicts are true. The argument ``untried`` has the names of groups
    without a result."""
    head = [*summary(rows), *missing(untried)]
    lines = [*head, "", "| fault | what happened | s to the truth | verdict |", "|---|---|---|---|"]
    lines += [f"| {row.fault} | {row.happened} | {row.seconds:.1f} | {row.verdict} |" for row in rows]
    path.write_text("\n".join(lines) + "\n")
    print(*head, f"table: {path}", sep="\n")
    return int(any(row.verdict != TRUE for row in rows))


def missing(untried: Sequence[str]) -> list[str]:
    """Returns a line about groups without a result."""
    more = f"; and {len(untried) - NAMED} more" if len(untried) > NAMED else ""
    return [f"groups not tried, {len(untried)}: {'; '.join(untried[:NAMED])}{more}"] if untried else []


def summary(rows: Sequence[Row]) -> list[str]:
    """Returns the number of faults by family and by verdict."""
    families = Counter(row.family for row in rows)
    true = sum(row.verdict == TRUE for row in rows)
    kinds = Counter(row.verdict.partition(":")[0] for row in rows if row.verdict != TRUE)
    slowest = max((row.seconds for row in rows), default=0.0)
    return [
        f"{len(rows)} faults ({', '.join(f'{family} {n}' for family, n in sorted(families.items()))}): {true} true,",
        f"{len(rows) - families['kill']} of them no kills; the slowest was true {slowest:.1f} s after its end;",
        ", ".join(f"{kinds.pop(word, 0)} {word}" for word in WORDS) + "".join(f", {n} {k}" for k, n in kinds.items()),
    ]
