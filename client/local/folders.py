"""The folder of a run, on this machine or on a server."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from conoid.cases.output import layout

from ..errors import ClientError, UnfinishedError

_NAMED = 8
"""Number of runs that are listed for a folder of several runs. Chosen value: as many as fit into a line."""


class Folder(Protocol):
    """A run's folder, on this machine or on a server."""

    @property
    def name(self) -> str:
        """Name of the run."""

    def names(self) -> list[str]:
        """Lists every file, relative to the folder, with ``/``."""

    def path(self, name: str) -> Path:
        """Returns a local path of a file. Raises UnfinishedError for a file that is not written yet."""

    def named(self, name: str) -> str:
        """Returns the name of a file in messages."""


@dataclass(frozen=True)
class LocalFolder:
    """A run's folder on this machine."""

    root: Path

    @property
    def name(self) -> str:
        """Name of the folder, which is the run's id if a server made it."""
        return self.root.resolve().name

    def names(self) -> list[str]:
        """Lists every file, relative to the folder."""
        return sorted(path.relative_to(self.root).as_posix() for path in self.root.rglob("*") if path.is_file())

    def path(self, name: str) -> Path:
        """Returns the path of the file in this folder. Raises ClientError for a link that leads out of the folder."""
        path = self.root / name
        if not path.is_file():
            raise UnfinishedError(self._lacks(name))
        if not path.resolve().is_relative_to(self.root.resolve()):
            raise ClientError(f"{path}: this link leads out of the run's folder")
        return path

    def named(self, name: str) -> str:
        """Returns the path of the folder."""
        return str(self.root / name)

    def _lacks(self, name: str) -> str:
        """Returns the reason for a missing file: the folder may contain runs and be no run itself."""
        found = (path for depth in ("*", "*/*") for path in self.root.glob(f"{depth}/{layout.JOURNAL}"))
        runs = sorted(path.parent.relative_to(self.root).as_posix() for path in found)
        if not runs or (self.root / layout.JOURNAL).exists():
            return f"{self.root} has no {name}"
        more = f" and {len(runs) - _NAMED} more" if len(runs) > _NAMED else ""
        return f"{self.root} is not the folder of a run, it holds those of {', '.join(runs[:_NAMED])}{more}"
