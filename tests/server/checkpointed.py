"""Folder of a run with the files that a worker with checkpoints leaves."""

import hashlib
from pathlib import Path

from conoid.cases.output import layout
from conoid.cases.output.checkpoints import FORMAT, MANIFEST, SEAL, File, Manifest, sealed

from .running import Running


def with_checkpoint(server: Running, run: str, step: int) -> Path:
    """Adds to the folder of a run the files that a worker with checkpoints leaves."""
    return with_checkpoint_in(made(server.ann.runs / run, step))


def with_checkpoint_in(path: Path) -> Path:
    """Writes checkpoints, frames, fragments and a history."""
    for place, name in (
        (path / layout.FRAMES, "000000.vtkhdf"),
        (path / layout.FRAMES, layout.FRAME_SERIES), (path / "fragments", "000000.csv"),
    ):  # fmt: skip
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(name)
    (path / layout.HISTORY).write_text("step\n1\n")
    return path


def made(folder: Path, *steps: int) -> Path:
    """Makes a run's folder with checkpoints."""
    for step in steps:
        place = layout.checkpoint(folder, step)
        place.mkdir(parents=True)
        (place / "rank-0.h5").write_bytes(b"state")
        file = File("rank-0.h5", 5, hashlib.sha256(b"state").hexdigest())
        for name, content in zip((MANIFEST, SEAL), sealed(Manifest(FORMAT, step, 0.0, {}, [file], {})), strict=True):
            (place / name).write_bytes(content)
    return folder
