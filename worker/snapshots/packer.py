"""Process that makes snapshots from shares, which are the copied states of the ranks: ``python -m
conoid.worker.snapshots.packer FOLDER``.

A separate process is used, because a thread of the solver's process would hold the interpreter lock. The process uses
idle cores. The run waits only for the last snapshot. Each line on standard input is a task, and each line on standard
output is an answer. The process ends when its standard input ends. A snapshot is written under a temporary name,
flushed to disk and renamed.
"""

import hashlib
import json
import os
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from conoid.cases.output import layout
from conoid.cases.reading import whole as whole_file

from . import blob, share
from .births import Births

_NICE, _LOWEST = 10, 19
"""Decrease of the priority of this process, and the lowest priority. With a decrease of 10, a rank on the core of this
process gets nine times as much CPU time as this process. Chosen value: the remaining CPU time is sufficient."""
_TETS = 256_000_000
"""Approximate limit of the bytes of all tets in all snapshots of a run. Early snapshots use only a part of the limit,
so that later snapshots are also possible. Chosen value: a hundred snapshots of 150,000 tets in 2,900 fragments."""
_PATIENCE = 60.0
"""Longest wait for the share (copied state) of a rank, s. Chosen value: many times the time that a slow disk needs to
write it."""
_LOOK = 0.005
"""Interval between two checks for the share (copied state) of a rank, s. Chosen value."""


def main(folder: Path) -> None:
    """Make snapshots until standard input ends."""
    births: Births | None = None
    with ThreadPoolExecutor(1, initializer=_step_back) as behind:
        for line in sys.stdin:
            task, began = json.loads(line), time.process_time()
            births = births or Births(folder, task["end"], task["frames"])
            try:
                if task["cause"] == "end":
                    answer = _made(folder, task, births)
                else:
                    answer = behind.submit(_made, folder, task, births).result()
            except Exception as error:  # the error concerns one snapshot; the next snapshot may be made
                answer = {"error": f"{type(error).__name__}: {error}"}
            print(json.dumps({"n": task["n"], "cpu": time.process_time() - began, **answer}), flush=True)


def _step_back() -> None:
    """Lower the priority of this thread. Only the superuser could raise the priority again."""
    thread = threading.get_native_id()
    os.setpriority(os.PRIO_PROCESS, thread, min(os.getpriority(os.PRIO_PROCESS, thread) + _NICE, _LOWEST))


def _made(folder: Path, task: dict[str, Any], births: Births) -> dict[str, Any]:
    """Make a snapshot and return the fields of its line in the journal. Raises OSError, ValueError."""
    paths = [layout.share(folder, task["n"], rank) for rank in range(task["ranks"])]
    try:
        whole = share.joined([_awaited(path) for path in paths], task["parts"])
    finally:
        for path in paths:
            path.unlink(missing_ok=True)
    initial = whole.initial or len(task["parts"])
    header = {name: task[name] for name in ("n", "step", "t", "ranks", "walls")}
    made = blob.made(
        whole, header, lambda numbers: births.at(task["t"], numbers, initial, kept=whole.initial > 0), blob.Budget()
    )
    place = layout.snapshot(folder, task["n"])
    whole_file.write(place, made.data)
    return {
        "path": str(place.relative_to(folder)), "bytes": len(made.data), "triangles": made.triangles,
        "fragments": made.fragments, "sha256": hashlib.sha256(made.data).hexdigest(), "smallest": made.smallest,
        "sizes": made.sizes, "tets": _with_tets(folder, task, made.tets),
        "fields": made.fields,
    }  # fmt: skip


def _with_tets(folder: Path, task: dict[str, Any], tets: bytes) -> int:
    """Write the tets of a snapshot if the limit of bytes allows it; return the number of bytes.

    A snapshot without tets has no sections.
    """
    if not tets or not _may_keep(folder, task, len(tets)):
        return 0
    try:
        whole_file.write(layout.snapshot_tets(folder, task["n"]), tets)
    except OSError:
        return 0
    return len(tets)


def _may_keep(folder: Path, task: dict[str, Any], size: int) -> bool:
    """Return whether the limit of bytes still allows the tets of later snapshots after ``size`` bytes; True for the
    last snapshot.
    """
    if task["cause"] == "end":
        return True
    kept = sum(path.stat().st_size for path in (folder / layout.SNAPSHOTS).glob(f"*{layout.TETS_SUFFIX}"))
    passed = min(1.0, task["t"] / task["end"]) if task["end"] > 0.0 else 1.0
    return kept + size <= max(size, _TETS * passed)


def _awaited(path: Path) -> share.Share:
    limit = time.monotonic() + _PATIENCE
    while not path.exists():
        if not path.parent.exists():
            raise FileNotFoundError(f"{path.parent.name} was removed")
        if time.monotonic() > limit:
            raise TimeoutError(f"{path.name} has not come within {_PATIENCE:g} s")
        time.sleep(_LOOK)
    return share.read(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
