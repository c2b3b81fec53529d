"""The command ``python -m tests.drill`` tries all faults in sequence, and writes a table into build/drill.

A later call of the command continues an interrupted drill: faults that build/drill/faults.jsonl lists as true are tried
again only with ``--fresh``. The table names the groups of faults that have not been tried. The option ``--shard 2/4``
tries every fourth group, from the second group on. The option ``--only WORDS`` tries the groups whose name contains
WORDS or whose kind of stand is WORDS, for example ``slurm``; the option can be repeated. The option ``--list`` prints
the names of the groups. The exit code is 0 if every state became true in time.
"""

import argparse
import json
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path

from . import bodies, clients, cluster, crowds, damage, odd, operator, strike, strikes, workers
from .grounds import Grounds, grounds
from .judge import TRUE, Row
from .table import write

PLACE = Path("build/drill")
Group = tuple[str, Callable[[Grounds], Iterator[Row]]]
"""Kind of stand of a group, and the function that tries the faults of the group on such a stand."""


def groups() -> dict[str, Group]:
    """Returns the groups of faults by name; the faults of a group share one stand."""
    found: dict[str, Group] = {}
    for one in [*strikes.everything(), *odd.everything(), *cluster.everything(), *operator.strikes()]:
        found[one.name] = (one.stand, partial(_struck, one))
    families = (damage.groups(), odd.groups(), crowds.groups(), clients.groups(), operator.groups(), bodies.groups())
    for name, (kind, deed) in [group for family in families for group in family.items()]:
        found[name] = (kind, partial(_on, kind, deed))
    for adopted in (False, True):
        name = f"workers struck, {'adopted' if adopted else 'own'}"
        found[name] = ("wide", partial(_on, "wide", partial(workers.rows, adopted=adopted)))
    return found


def _struck(one: strike.Strike, made: Grounds) -> Iterator[Row]:
    return strike.rows(made.stand(one.stand), one)


def _on(kind: str, deed: Callable[..., Iterator[Row]], made: Grounds) -> Iterator[Row]:
    return deed(made.stand(kind))


def main() -> int:
    options = _options()
    known = groups()
    wanted = options.only or [""]
    chosen = {name: group for name, group in known.items() if any(w in name or w == group[0] for w in wanted)}
    names = list(chosen)[options.shard[0] - 1 :: options.shard[1]]
    if options.list:
        print(*names, sep="\n")
        return 0
    PLACE.mkdir(parents=True, exist_ok=True)
    book = PLACE / "faults.jsonl"
    if options.fresh:
        book.unlink(missing_ok=True)
    done = _done(book)
    with tempfile.TemporaryDirectory(prefix="conoid-drill-") as place, grounds(Path(place)) as made:
        for name in names:
            if name not in done or any(row.verdict != TRUE for row in done[name]):
                _try(name, chosen[name], made, book)
    done = _done(book)
    rows = [row for name in known for row in done.get(name, [])]
    return write(PLACE / "faults.md", rows, [name for name in known if name not in done])


def _try(name: str, group: Group, made: Grounds, book: Path) -> None:
    """Tries the faults of one group. An error of the drill itself also becomes a row of the table."""
    began = time.monotonic()
    if why := made.lacks(group[0]):
        print(f"{name}: not tried: {why}", flush=True)
        return
    try:
        found = list(group[1](made))
    except Exception as error:
        found = [Row(name, "drill", "", 0.0, f"the drill failed: {type(error).__name__} {str(error)[:300]}")]
    if any(row.verdict != TRUE for row in found):
        made.renew(group[0], PLACE / f"{re.sub('[^a-zA-Z0-9]+', '-', name)}.log")
    with book.open("a") as file:
        file.write(json.dumps({"name": name, "rows": [asdict(row) for row in found]}) + "\n")
    wrong = [row for row in found if row.verdict != TRUE]
    print(f"{name}: {len(found) - len(wrong)} of {len(found)} true, {time.monotonic() - began:.0f} s", flush=True)
    for row in wrong:
        print(f"    {row.fault}: {row.happened}: {row.verdict}", flush=True)


def _done(book: Path) -> dict[str, list[Row]]:
    lines = book.read_text().splitlines() if book.exists() else []
    return {record["name"]: [Row(**row) for row in record["rows"]] for record in map(json.loads, lines)}


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.drill", description="Faults, and whether states stay true.")
    parser.add_argument("--shard", type=_shard, default=(1, 1), metavar="I/N", help="every N-th group, from I on")
    parser.add_argument(
        "--only", action="append", metavar="WORDS", help="groups whose names have the words; repeatable"
    )
    parser.add_argument("--fresh", action="store_true", help="forget what was tried before")
    parser.add_argument("--list", action="store_true", help="name the groups and try nothing")
    return parser.parse_args()


def _shard(text: str) -> tuple[int, int]:
    first, _, all_ = text.partition("/")
    return int(first), int(all_)


if __name__ == "__main__":
    sys.exit(main())
