"""Servers under test (stands) of the drill, by kind of stand. A stand is made at its first use; all stands are closed
at the end of the drill."""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from ..server import real_slurm
from . import bodies, cluster
from .stand import UNPRIVILEGED, Stand, can_drop

DISK = "size=1100m,nr_inodes=4000"
"""Options of the file system in memory of one stand: the size is little more than the space that a server keeps
free."""
FAKETIME = ("/usr/lib/*/faketime/libfaketimeMT.so.1", "/usr/local/lib/faketime/libfaketimeMT.so.1")


class Grounds:
    """The stands of a drill, by their kind, below a folder."""

    def __init__(self, place: Path) -> None:
        self._place = place
        self._stands: dict[str, Stand] = {}
        self._mounts: list[Path] = []
        self._cluster: real_slurm.Cluster | None = None
        self._ends = ExitStack()
        self._make: dict[str, Callable[[Path], Stand]] = {
            "plain": Stand, "wide": lambda root: Stand(root, slots=40, before=UNPRIVILEGED),
            "odd": lambda root: Stand(_odd(root)),
            "narrow": lambda root: Stand(root, slots=3, before=UNPRIVILEGED),
            "unprivileged": lambda root: Stand(root, before=UNPRIVILEGED), "disk": self._on_a_disk, "clock": _clock,
            "solver": bodies.stand, "slurm": lambda root: cluster.stand(root, self._slurm()),
        }  # fmt: skip

    def lacks(self, kind: str) -> str:
        """Returns the reason why this machine cannot have a stand of this kind; an empty string if the stand is
        possible.
        """
        if kind in {"unprivileged", "wide", "narrow"} and not can_drop():
            return "root without setpriv: permissions do not hold"
        if kind == "disk" and os.geteuid() != 0:
            return "only root can mount a small disk"
        if kind == "clock" and not _libfaketime():
            return "no libfaketime (apt-get install faketime; make drill does it)"
        return real_slurm.missing() if kind == "slurm" else ""

    def stand(self, kind: str) -> Stand:
        """Returns the stand of the given kind, with a running server."""
        if kind not in self._stands:
            root = self._place / kind
            root.mkdir(parents=True)
            self._stands[kind] = self._make[kind](root)
        found = self._stands[kind]
        if found.child is None or found.child.poll() is not None:
            assert found.start(), f"the server of the stand {kind!r} does not start: {found.last_line()}"
        return found

    def renew(self, kind: str, log: Path | None = None) -> None:
        """Closes the stand of a kind, so that the next stand of this kind is new; ``log`` receives a copy of the log of
        its server.
        """
        if kind in self._stands:
            found = self._stands.pop(kind)
            if log is not None:
                shutil.copy(found.root / "server.log", log)
            self._close(found)

    def close(self) -> None:
        """Ends all servers of the stands and their workers."""
        for kind in tuple(self._stands):
            self.renew(kind)
        self._ends.close()

    def _close(self, stand: Stand) -> None:
        stand.close()
        if stand.runs in self._mounts:
            self._mounts.remove(stand.runs)
            subprocess.run(["umount", "--lazy", str(stand.runs)], check=False)
        for path in (stand.root, stand.runs, *stand.runs.glob("*")):
            with suppress(OSError):
                path.chmod(0o700)
        shutil.rmtree(stand.root, ignore_errors=True)

    def _slurm(self) -> real_slurm.Cluster:
        """Returns the cluster that all stands share, because the start of a cluster takes long."""
        if self._cluster is None:
            self._cluster = self._ends.enter_context(real_slurm.running(self._place / "cluster"))
        return self._cluster

    def _on_a_disk(self, root: Path) -> Stand:
        made = Stand(root)
        made.runs.mkdir(mode=0o700)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"{DISK},mode=0700", "conoid-drill", str(made.runs)], check=True)
        self._mounts.append(made.runs)
        return made


def _odd(root: Path) -> Path:
    """Creates a folder whose name contains characters that are special in patterns, addresses and shells."""
    made = root / "100%s a\\b #1?x=%20;[y] '\u00e4'"
    made.mkdir()
    return made


def _clock(root: Path) -> Stand:
    (root / "clock").write_text("+0")
    return Stand(root, environment={
        "LD_PRELOAD": _libfaketime(), "FAKETIME_TIMESTAMP_FILE": str(root / "clock"), "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    })  # fmt: skip


def _libfaketime() -> str:
    found = [path for pattern in FAKETIME for path in sorted(Path("/").glob(pattern[1:]))]
    return str(found[0]) if found else ""


@contextmanager
def grounds(place: Path) -> Iterator[Grounds]:
    """Yields the stands, and closes the stands at the end, also after an error."""
    made = Grounds(place)
    try:
        yield made
    finally:
        made.close()
