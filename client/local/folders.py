"""The folder of a run, on this machine or on a server."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from conoid.cases.output import layout

from ..errors import ClientError, UnfinishedError

_NAMED = 8
"""Largest number of runs that are named for a folder of several runs (chosen value: as many as fit into one text
line)."""


class Folder(Protocol):
    """Interface of the folder of a run, on this machine or on a server."""

    @property
    def name(self) -> str:
        """Name of the run."""

    def names(self) -> list[str]:
        """Lists all files of the run; names are relative to the folder and have ``/``."""

    def path(self, name: str) -> Path:
        """Returns the local path of a file. Raises UnfinishedError if the file has not been written yet."""

    def named(self, name: str) -> str:
        """Returns the name of a file for messages."""


@dataclass(frozen=True)
class LocalFolder:
    """A run's folder on this machine."""

    root: Path

    @property
    def name(self) -> str:
        """Name of the folder; it is the id of the run if a server made the folder."""
        return self.root.resolve().name

    def names(self) -> list[str]:
        """Lists all files of the run; names are relative to the folder."""
        return sorted(path.relative_to(self.root).as_posix() for path in self.root.rglob("*") if path.is_file())

    def path(self, name: str) -> Path:
        """Returns the path of a file in this folder. Raises ClientError for a link to a place outside of the folder."""
        path = self.root / name
        if not path.is_file():
            raise UnfinishedError(self._lacks(name))
        if not path.resolve().is_relative_to(self.root.resolve()):
            raise ClientError(f"{path}: the link points to a place outside of the run's folder")
        return path

    def named(self, name: str) -> str:
        """Returns the path of a file in this folder."""
        return str(self.root / name)

    def _lacks(self, name: str) -> str:
        """Returns the reason why a file is missing. The folder may contain folders of runs and not be the folder of
        a run itself.
        """
        found = (path for depth in ("*", "*/*") for path in self.root.glob(f"{depth}/{layout.JOURNAL}"))
        runs = sorted(path.parent.relative_to(self.root).as_posix() for path in found)
        if not runs or (self.root / layout.JOURNAL).exists():
            return f"{self.root} has no {name}"
        more = f" and {len(runs) - _NAMED} more" if len(runs) > _NAMED else ""
        known = f"{', '.join(runs[:_NAMED])}{more}"
        return f"{self.root} is not the folder of a run; it contains the folders of the runs {known}"
