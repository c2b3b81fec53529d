"""Check for output files that are removed during a run. Removed files give a warning, and the run continues."""

from pathlib import Path

from conoid.cases.output import fragments, layout

_KINDS = {layout.FRAMES: ".vtkhdf", fragments.FOLDER: ".csv", layout.SNAPSHOTS: ".snap"}
"""Folders of output, with the suffix of finished files in each folder."""


class Losses:
    """Compares the files in the folders of a run with the files at the last call."""

    def __init__(self, folder: Path) -> None:
        """Record the files that exist now."""
        self._folder = folder
        self._seen = {kind: _names(folder / kind, ending) for kind, ending in _KINDS.items()}

    def found(self) -> list[str]:
        """Return a warning for each folder from which files were removed since the last call."""
        warnings = []
        for kind, ending in _KINDS.items():
            now = _names(self._folder / kind, ending)
            gone = sorted(self._seen[kind] - now)
            self._seen[kind] = now
            if gone:
                which = gone[0] if len(gone) == 1 else f"{len(gone)} files from {gone[0]} to {gone[-1]}"
                warnings.append(f"{kind}: {which} removed during the run; later files are written")
        return warnings


def _names(folder: Path, ending: str) -> set[str]:
    try:
        return {path.name for path in folder.iterdir() if path.suffix == ending}
    except OSError:
        return set()
