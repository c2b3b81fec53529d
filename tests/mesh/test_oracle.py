"""Random mesh files: each group has the content that its writer and meshio give, or the file is refused in one line.
``CONOID_SEED`` sets another seed; the seed is printed and is part of every message.
"""

import contextlib
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from random import Random

import meshio
import numpy as np
import pytest

from conoid.cases.model.bodies import MeshFile
from conoid.worker.errors import MeshError
from conoid.worker.mesh.cells import HEX8, PYRAMID5, WEDGE6
from conoid.worker.mesh.read import read

from .mixtures import FACES
from .styles import POISONS, STYLES, Floats, block, measured

SEED = int(os.environ.get("CONOID_SEED", "20260801"))
FEW, MANY = 10, 100
"""Numbers of files that each of the two writers writes."""


def held(path: Path, group: str | None, unit: float = 1.0) -> Floats:
    """Returns volume and first moments, (4,), of the mesh that a case reads from a file."""
    file = MeshFile(shape="file", path=path.name, unit=unit, group=group, second_order="corners")
    mesh = read(file, path, "mesh")
    return measured(mesh.points, mesh.tets)


def close(found: Floats, expected: Floats, where: str) -> None:
    size = max(1.0, float(np.abs(expected[1:]).max() / max(expected[0], 1e-300)))
    assert np.abs(found - expected).max() <= 1e-6 * size * expected[0], f"{where}: {found} != {expected}"


def of_meshio(path: Path) -> Floats | None:
    """Returns volume and first moments of the whole file by meshio, each tet once; None if meshio cannot read the
    file."""
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            found = meshio.read(path)
    except (Exception, SystemExit):
        return None
    kinds = {"hexahedron": HEX8, "wedge": WEDGE6, "pyramid": PYRAMID5}
    points, tets = found.points, [cells.data for cells in found.cells if cells.type == "tetra"]
    if any(cells.dim == 3 and cells.type not in (*kinds, "tetra") for cells in found.cells):
        return None
    for cells in (cells for cells in found.cells if cells.type in kinds):
        data = np.unique(cells.data, axis=0)
        middle = len(points) + np.arange(len(data))
        points = np.concatenate([points, points[data].mean(axis=1)])
        for a, b, c, *d in FACES[kinds[cells.type]]:
            tets += [np.column_stack([data[:, row], middle]) for row in ([a, b, c], [a, c, *d]) if len(row) == 3]
    return measured(points, np.unique(np.concatenate(tets), axis=0)) if tets else None


def refused(path: Path, group: str | None, where: str) -> None:
    with pytest.raises(MeshError) as raised:
        held(path, group)
    assert "\n" not in str(raised.value), where


def cut_off(path: Path, chance: Random, where: str) -> None:
    """Checks that a file is refused if it is truncated in its last third before its last word."""
    content = path.read_bytes()
    path.write_bytes(content[: chance.randint(len(content) * 2 // 3, len(content) - 30)])
    refused(path, None, where)


def check_gmsh(folder: Path, seed: int, count: int) -> int:
    """Checks files of gmsh; returns the number of files that meshio could also read."""
    command = [sys.executable, str(Path(__file__).with_name("gmsh_files.py")), str(folder), str(seed), str(count)]
    subprocess.run(command, check=True, timeout=600)
    both = 0
    for name, groups in json.loads((folder / "truth.json").read_text()).items():
        path, where, chance = folder / name, f"seed {seed}, {name}", Random(f"{seed}/{name}")
        if not groups:
            refused(path, None, where)
            continue
        for group, expected in groups.items():
            close(held(path, group or None), np.array(expected), f"{where}, {group!r}")
        by_meshio = of_meshio(path)
        if by_meshio is not None:
            both += 1
            close(held(path, None), by_meshio, f"{where}, meshio")
        refused(path, "no such group", where)
        content = path.read_bytes()
        if content.isascii() and chance.random() < 0.4:
            path.write_bytes(chance.choice((b"", b"\xef\xbb\xbf")) + content.replace(b"\n", b"\r\n"))
            close(held(path, None), np.array(groups[""]), f"{where}, CRLF")
        elif path.suffix == ".msh":
            cut_off(path, chance, where)
    return both


def check_abaqus(folder: Path, seed: int, count: int) -> int:
    """Checks small Abaqus files, and files that meshio writes."""
    both = 0
    for index in range(count):
        chance, path = Random(f"{seed}/{index}"), folder / f"a{index:03d}.inp"
        style = chance.choice((*STYLES, None))
        where = f"seed {seed}, {path.name}, {style.__name__ if style else 'meshio'}"
        if style is None:
            both += check_written_by_meshio(path, chance, where)
            continue
        content, groups = style(chance)
        path.write_bytes(content)
        for group, expected in groups.items():
            close(held(path, group), expected, f"{where}, {group!r}")
        refused(path, "no such group", where)
        lines = content.splitlines()
        chance.choice(POISONS)(chance, lines)
        path.write_bytes(b"\n".join(lines))
        refused(path, None, where)
    return both


def check_written_by_meshio(path: Path, chance: Random, where: str) -> int:
    body = block(chance)
    corners, some = np.searchsorted(body.nodes, body.corners), chance.sample(range(len(body.tets)), 3)
    mesh = meshio.Mesh(body.points, [("tetra", corners)], cell_sets={"some": [np.array(some)]})
    with contextlib.redirect_stdout(io.StringIO()):
        meshio.write(path, mesh, file_format="abaqus")
    again = of_meshio(path)
    assert again is not None, where
    close(held(path, None), again, where)
    close(held(path, "some"), body.measured(body.tets[some].tolist()), where)
    return 1


def test_a_few_files_made_at_random_are_read_right_or_refused(tmp_path: Path) -> None:
    both = check_gmsh(tmp_path, SEED, FEW) + check_abaqus(tmp_path, SEED, FEW)
    print(f"seed {SEED}: meshio has read {both} of {2 * FEW} files, too")
    assert both >= 4


@pytest.mark.slow
def test_two_hundred_files_made_at_random_are_read_right_or_refused(tmp_path: Path) -> None:
    both = check_gmsh(tmp_path, SEED + 1, MANY) + check_abaqus(tmp_path, SEED + 1, MANY)
    print(f"seed {SEED + 1}: meshio has read {both} of {2 * MANY} files, too")
    assert both >= 40
