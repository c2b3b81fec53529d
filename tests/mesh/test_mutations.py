"""Text files of all formats that are truncated, or whose lines are removed, repeated or swapped: each file is refused
in one line, or read with its present content.
"""

import math
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
import pytest

from conoid.cases.model.bodies import MeshFile
from conoid.worker.errors import MeshError
from conoid.worker.mesh.model import TetMesh, check
from conoid.worker.mesh.read import read

from .bars import bar
from .decks import DECKS, parts
from .mixtures import mixture
from .starters import starter

Lines = list[str]


def cut_off(lines: Lines, chance: Random) -> None:
    at = chance.randrange(len(lines))
    lines[at:] = [lines[at][: chance.randint(0, len(lines[at]))]]


def removed(lines: Lines, chance: Random) -> None:
    del lines[chance.randrange(len(lines))]


def repeated(lines: Lines, chance: Random) -> None:
    at = chance.randrange(len(lines))
    lines.insert(at, lines[at])


def swapped(lines: Lines, chance: Random) -> None:
    a, b = (chance.randrange(len(lines)) for _ in range(2))
    lines[a], lines[b] = lines[b], lines[a]


def scratched(lines: Lines, chance: Random) -> None:
    at = chance.randrange(len(lines))
    k = chance.randint(0, len(lines[at]))
    lines[at] = lines[at][:k] + chance.choice(("*", "-", "x", "9", " ", ",", "&", "/", "\t")) + lines[at][k + 1 :]


CHANGES: tuple[Callable[[Lines, Random], None], ...] = (cut_off, removed, repeated, swapped, scratched)


def outcome(path: Path) -> TetMesh | None:
    """Returns the mesh, or None if the file is refused in one line; any other result is an error."""
    try:
        return read(MeshFile(shape="file", path=path.name, unit=1.0), path, "mesh")
    except MeshError as error:
        message = str(error)
    assert message.startswith("mesh")
    assert "\n" not in message
    return None


@pytest.mark.parametrize("name", ["prepost.k", "hypermesh.k", "primer.k", "starter.rad", "bar.inp"])
def test_a_changed_file_is_refused_or_read_as_it_is(name: str, tmp_path: Path) -> None:
    refused = 0
    for seed in range(60):
        chance, truth, path = Random(f"{name}{seed}"), mixture(seed % 7), tmp_path / name
        style = next((each for each in DECKS if each.__name__ == path.stem), starter)
        volume = math.fsum(truth.volumes().values())
        if path.suffix == ".inp":
            bar(path, (3, 2, 1))
            lines, volume = path.read_text().splitlines(), 6.0
        else:
            lines = style(truth, parts(truth, chance), chance).splitlines()
        CHANGES[seed % len(CHANGES)](lines, chance)
        path.write_text("\n".join(lines) + "\n")
        mesh = outcome(path)
        refused += mesh is None
        if mesh is not None:
            check(mesh)
            reach = np.abs(truth.points).max() if path.suffix != ".inp" else 3.0
            moved = np.abs(mesh.points).max() > 1.001 * reach
            assert moved or mesh.volumes().sum() <= 1.35 * volume
    assert 10 <= refused <= 55
