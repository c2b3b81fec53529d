"""Disk usage of runs and uploaded files.

A file that several cases name is one file on disk; the file counts once for each user.
"""

import os
from collections import Counter
from collections.abc import Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases.output import layout

Copies = dict[tuple[int, int], int]
"""Size of files in bytes, by device and inode."""


def size(folder: Path) -> int:
    """Returns the size of all files of a run in bytes, without the copies of files that the case names. A file that
    disappears during the call counts as 0 bytes.
    """
    total = 0
    for place, folders, names in os.walk(folder):
        if place == os.fspath(folder) and layout.FILES in folders:
            folders.remove(layout.FILES)
        for name in names:
            with suppress(OSError):
                total += os.lstat(os.path.join(place, name)).st_size
    return total


def copies(folder: Path) -> Copies:
    """Returns the size in bytes of each file that the case names, by device and inode, because several runs may share a
    file.
    """
    found: Copies = {}
    with suppress(FileNotFoundError, NotADirectoryError), os.scandir(folder / layout.FILES) as entries:
        for entry in entries:
            with suppress(FileNotFoundError):
                status = entry.stat(follow_symlinks=False)
                found[status.st_dev, status.st_ino] = status.st_size
    return found


@dataclass
class DiskUsage:
    """Sizes of folders and files, measured at the last pass. The methods of this class must be called by one thread at
    a time.
    """

    sizes: dict[str, int] = field(default_factory=dict)
    """Size in bytes of the folder of each run, without the files that its case names."""
    files: dict[str, Copies] = field(default_factory=dict)
    """Files that the case of each run names."""
    owners: dict[str, str] = field(default_factory=dict)
    """Owner of each run."""
    sent: dict[str, Copies] = field(default_factory=dict)
    """Uploaded files of each user, by device and inode."""

    def note(self, run: str, owner: str, its: int, copies: Copies) -> None:
        """Records the size of a run's folder and the files that its case names."""
        self.sizes[run], self.files[run], self.owners[run] = its, copies, owner

    def keep(self, there: Set[str], sent: dict[str, Copies]) -> None:
        """Drops runs whose folder is missing, and records the uploaded files."""
        for run in self.sizes.keys() - there:
            self.drop(run)
        self.sent = sent

    def drop(self, run: str) -> None:
        """Drops a run whose folder has been removed."""
        self.sizes.pop(run, None)
        self.files.pop(run, None)
        self.owners.pop(run, None)

    def by_owner(self) -> Counter[str]:
        """Returns the bytes of each user: folders of runs and uploaded files; each file counts once."""
        found, files = Counter[str](), {owner: dict(copies) for owner, copies in self.sent.items()}
        for run, owner in self.owners.items():
            found[owner] += self.sizes[run]
            files.setdefault(owner, {}).update(self.files[run])
        return found + Counter({owner: sum(copies.values()) for owner, copies in files.items()})


class Left:
    """Number of bytes that remain while runs are removed one after the other."""

    def __init__(self, weights: DiskUsage) -> None:
        """Begins with ``total``, the bytes of all runs."""
        self._sizes, self._files = dict(weights.sizes), dict(weights.files)
        held = [*self._files.values(), *weights.sent.values()]
        self._names = Counter(inode for copies in held for inode in copies)
        files = {inode: size for copies in held for inode, size in copies.items()}
        self.total = sum(self._sizes.values()) + sum(files.values())

    def drop(self, run: str) -> None:
        """Subtracts a run, and the files of the run that no other run and no user has."""
        self.total -= self._sizes.pop(run, 0)
        for inode, size in self._files.pop(run, {}).items():
            self._names[inode] -= 1
            self.total -= 0 if self._names[inode] else size
