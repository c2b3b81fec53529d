"""The cores that this process may use, by its CPU affinity and by the CPU quota of its control groups, and the number
of threads of a run whose case gives none.
"""

import os
from pathlib import Path

from ..model.run import MOST_THREADS

_TETS = 3_000
"""Smallest number of tets for each thread. The tets of a rank have eight colours (8 to 10 in meshes of gmsh), and a
thread works on chunks of 376 tets of one colour. With fewer tets per thread, most colours have fewer chunks than there
are threads."""
_GROUPS, _OWN = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")


def usable_cores() -> int:
    """Returns the number of cores that this process may use, at least one; the machine can have more."""
    quotas = _quotas(_GROUPS, _OWN)
    return max(1, min([len(core_numbers()), *(int(quota) for quota in quotas)]))


def threads_of(ranks: int, cores: int, tets: int | None = None) -> int:
    """Returns the number of threads of each of ``ranks`` ranks so that a run uses all ``cores``, but no more threads
    than its number of tets can occupy. ``tets``: None if the number is unknown.
    """
    most = MOST_THREADS if tets is None else -(-tets // (_TETS * ranks))
    return max(1, min(cores // ranks, most, MOST_THREADS))


def core_numbers() -> list[int]:
    """Numbers of the cores on which this process may run, as the operating system gives them."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def _quotas(groups: Path, own: Path) -> list[float]:
    """Returns the CPU quota, in cores, of each control group of a process that has a quota: from cpu.max in version 2
    of control groups, from cpu.cfs_quota_us in version 1. The root group is included, because inside of a container it
    is the group of the container.
    """
    found = []
    for line in _text(own).splitlines():
        _, kinds, place = line.split(":", 2)
        root = groups if not kinds else groups / kinds if "cpu" in kinds.split(",") else None
        if root is not None:
            inside = Path(place.lstrip("/"))
            found += [_quota(root / part) for part in (inside, *inside.parents)]
    return [quota for quota in found if quota is not None]


def _quota(group: Path) -> float | None:
    words = _text(group / "cpu.max").split()
    if not words:
        words = [_text(group / f"cpu.cfs_{name}_us").strip() for name in ("quota", "period")]
    if len(words) != 2 or not all(word.isdigit() for word in words) or int(words[1]) == 0:
        return None  # "max" and -1 mean that the group has no limit
    return int(words[0]) / int(words[1])


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""
