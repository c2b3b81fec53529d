"""How much runs and files have on disk. A file that a case names is one file on disk, however many runs have it: each
user counts it once.
"""

import os
from collections import Counter
from collections.abc import Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases.output import layout

Copies = dict[tuple[int, int], int]
"""Bytes of files, by device and inode."""


def size(folder: Path) -> int:
    """Bytes of all files but the copies of what the case names; one that goes away meanwhile has none."""
    total = 0
    for place, folders, names in os.walk(folder):
        if place == os.fspath(folder) and layout.FILES in folders:
            folders.remove(layout.FILES)
        for name in names:
            with suppress(OSError):
                total += os.lstat(os.path.join(place, name)).st_size
    return total


def copies(folder: Path) -> Copies:
    """Bytes of each file that the case names, by device and inode: several runs may have the same."""
    found: Copies = {}
    with suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder / layout.FILES) as entries:
        for entry in entries:
            with suppress(FileNotFoundError):
                status = entry.stat(follow_symlinks=False)
                found[status.st_dev, status.st_ino] = status.st_size
    return found


@dataclass
class DiskUsage:
    """What was found at the last look. Not safe between threads."""

    sizes: dict[str, int] = field(default_factory=dict)
    """Bytes of the folder of each run, without its copies of files."""
    files: dict[str, Copies] = field(default_factory=dict)
    """These copies."""
    owners: dict[str, str] = field(default_factory=dict)
    """Of the runs."""
    sent: dict[str, Copies] = field(default_factory=dict)
    """What each user has sent."""

    def note(self, run: str, owner: str, its: int, copies: Copies) -> None:
        """The size of a run's folder, and its copies."""
        self.sizes[run], self.files[run], self.owners[run] = its, copies, owner

    def keep(self, there: Set[str], sent: dict[str, Copies]) -> None:
        """Runs that are not there any more weigh nothing."""
        for run in self.sizes.keys() - there:
            self.drop(run)
        self.sent = sent

    def drop(self, run: str) -> None:
        """A run whose folder is removed."""
        self.sizes.pop(run, None)
        self.files.pop(run, None)
        self.owners.pop(run, None)

    def by_owner(self) -> Counter[str]:
        """Bytes of each user: of the folders of his runs, and of his files, each once."""
        found, files = Counter[str](), {owner: dict(copies) for owner, copies in self.sent.items()}
        for run, owner in self.owners.items():
            found[owner] += self.sizes[run]
            files.setdefault(owner, {}).update(self.files[run])
        return found + Counter({owner: sum(copies.values()) for owner, copies in files.items()})


class Left:
    """What would be left of all users' bytes if runs went, one after the other."""

    def __init__(self, weights: DiskUsage) -> None:
        """All of it: ``total`` in bytes."""
        self._sizes, self._files = dict(weights.sizes), dict(weights.files)
        held = [*self._files.values(), *weights.sent.values()]
        self._names = Counter(inode for copies in held for inode in copies)
        files = {inode: size for copies in held for inode, size in copies.items()}
        self.total = sum(self._sizes.values()) + sum(files.values())

    def drop(self, run: str) -> None:
        """A run goes, and with it the files that nothing else has."""
        self.total -= self._sizes.pop(run, 0)
        for inode, size in self._files.pop(run, {}).items():
            self._names[inode] -= 1
            self.total -= 0 if self._names[inode] else size
