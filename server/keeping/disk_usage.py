"""Disk usage of runs and uploaded files.

If several cases of a user name the same file, it is one file on disk and counts once.
"""

import os
from collections import Counter
from collections.abc import Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases.output import layout

Copies = dict[tuple[int, int], int]
"""Sizes of files in bytes, by device and inode."""


def size(folder: Path) -> int:
    """Returns the size of all files in the folder of a run, bytes, without the copies of files that its case names. A
    file that disappears during the call counts as 0 bytes.
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
    """Returns the sizes of the copies of files that the case of a run names, by device and inode, because several runs
    may share a file.
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
    """Sizes of the folders of runs and of uploaded files, as they were last measured. The methods of this class must be
    called by one thread at a time.
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
        """Stores the size of a run's folder, and the files that its case names."""
        self.sizes[run], self.files[run], self.owners[run] = its, copies, owner

    def keep(self, there: Set[str], sent: dict[str, Copies]) -> None:
        """Forgets the runs whose folder is not in ``there``, and stores the uploaded files."""
        for run in self.sizes.keys() - there:
            self.drop(run)
        self.sent = sent

    def drop(self, run: str) -> None:
        """Forgets a run whose folder was removed."""
        self.sizes.pop(run, None)
        self.files.pop(run, None)
        self.owners.pop(run, None)

    def by_owner(self) -> Counter[str]:
        """Returns the number of bytes of each user: folders of runs, copies of files, and uploaded files; each file
        counts once.
        """
        found, files = Counter[str](), {owner: dict(copies) for owner, copies in self.sent.items()}
        for run, owner in self.owners.items():
            found[owner] += self.sizes[run]
            files.setdefault(owner, {}).update(self.files[run])
        return found + Counter({owner: sum(copies.values()) for owner, copies in files.items()})


class Left:
    """Number of bytes that remain on disk while runs are removed one after the other."""

    def __init__(self, weights: DiskUsage) -> None:
        """Starts with the sum over all runs in ``total``."""
        self._sizes, self._files = dict(weights.sizes), dict(weights.files)
        held = [*self._files.values(), *weights.sent.values()]
        self._names = Counter(inode for copies in held for inode in copies)
        files = {inode: size for copies in held for inode, size in copies.items()}
        self.total = sum(self._sizes.values()) + sum(files.values())

    def drop(self, run: str) -> None:
        """Subtracts a run, with those files that no other run and no user has."""
        self.total -= self._sizes.pop(run, 0)
        for inode, size in self._files.pop(run, {}).items():
            self._names[inode] -= 1
            self.total -= 0 if self._names[inode] else size
