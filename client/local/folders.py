"""The folder of a run: where its files are, on this machine or behind a server."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from conoid.cases.output import layout

from ..errors import ClientError, UnfinishedError

_NAMED = 8
"""Runs that are named when a folder holds some and is none. Chosen: as many as a line has room for."""


class Folder(Protocol):
    """A run's folder, on this machine or behind a server."""

    @property
    def name(self) -> str:
        """What to call the run."""

    def names(self) -> list[str]:
        """Every file, relative to the folder, with ``/``."""

    def path(self, name: str) -> Path:
        """A local path of a file. Raises UnfinishedError when the run has not written it."""

    def told(self, name: str) -> str:
        """What to call a file where people are told of it."""


@dataclass(frozen=True)
class LocalFolder:
    """A run's folder on this machine."""

    root: Path

    @property
    def name(self) -> str:
        """The name of the folder, which is the run's id where a server made it."""
        return self.root.resolve().name

    def names(self) -> list[str]:
        """Every file, relative to the folder."""
        return sorted(path.relative_to(self.root).as_posix() for path in self.root.rglob("*") if path.is_file())

    def path(self, name: str) -> Path:
        """The file itself. Raises ClientError for a link that leads elsewhere: what it names is not the run's."""
        path = self.root / name
        if not path.is_file():
            raise UnfinishedError(self._lacks(name))
        if not path.resolve().is_relative_to(self.root.resolve()):
            raise ClientError(f"{path}: this link leads out of the run's folder")
        return path

    def told(self, name: str) -> str:
        """Its path."""
        return str(self.root / name)

    def _lacks(self, name: str) -> str:
        """Why a file is not there: the folder may be one that holds those of runs."""
        found = (path for depth in ("*", "*/*") for path in self.root.glob(f"{depth}/{layout.JOURNAL}"))
        runs = sorted(path.parent.relative_to(self.root).as_posix() for path in found)
        if not runs or (self.root / layout.JOURNAL).exists():
            return f"{self.root} has no {name}"
        more = f" and {len(runs) - _NAMED} more" if len(runs) > _NAMED else ""
        return f"{self.root} is not the folder of a run, it holds those of {', '.join(runs[:_NAMED])}{more}"
