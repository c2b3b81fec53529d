"""How much runs and files have on disk. A file that a case names is one file on disk, however many runs have it: each
user counts it once.
"""

import os
from collections.abc import Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases import layout

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
class Weights:
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

    def copy(self) -> "Weights":
        """Another one, to try what would be left."""
        return Weights(dict(self.sizes), dict(self.files), dict(self.owners), dict(self.sent))

    def of(self, owner: str) -> int:
        """Bytes of a user: of the folders of his runs, and of his files, each once."""
        runs = [run for run, its in self.owners.items() if its == owner]
        return sum(self.sizes[run] for run in runs) + _once(
            *(self.files[run] for run in runs), self.sent.get(owner, {})
        )

    def total(self) -> int:
        """Bytes of all users."""
        return sum(self.sizes.values()) + _once(*self.files.values(), *self.sent.values())


def _once(*some: Copies) -> int:
    return sum({inode: size for copies in some for inode, size in copies.items()}.values())
