"""What a run has written and somebody has removed while it goes on: that is told, and no reason to stop."""

from pathlib import Path

from conoid.cases.output import fragments, layout

_KINDS = {layout.FRAMES: ".vtkhdf", fragments.FOLDER: ".csv", layout.SNAPSHOTS: ".snap"}
"""Folders of a run, and how finished files in them end."""


class Losses:
    """Compares what there is with what there was, time after time."""

    def __init__(self, folder: Path) -> None:
        """Begins with what there is."""
        self._folder = folder
        self._seen = {kind: _names(folder / kind, ending) for kind, ending in _KINDS.items()}

    def found(self) -> list[str]:
        """A line for each folder from which files have gone since the last call."""
        told = []
        for kind, ending in _KINDS.items():
            now = _names(self._folder / kind, ending)
            gone = sorted(self._seen[kind] - now)
            self._seen[kind] = now
            if gone:
                which = gone[0] if len(gone) == 1 else f"{len(gone)} files from {gone[0]} to {gone[-1]}"
                told.append(f"{kind}: {which} removed while the run goes on; what follows is written")
        return told


def _names(folder: Path, ending: str) -> set[str]:
    try:
        return {path.name for path in folder.iterdir() if path.suffix == ending}
    except OSError:
        return set()
