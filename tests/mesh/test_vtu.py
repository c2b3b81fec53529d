"""The reader of .vtu files: every encoding that VTK writes, groups and sets, and damaged files."""

import itertools
import math
from pathlib import Path
from random import Random
from typing import Any

import meshio
import numpy as np
import pytest
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from conoid.cases.model.bodies import MeshFile
from conoid.worker.errors import MeshError
from conoid.worker.mesh.cells import HEX8, PYRAMID5, WEDGE6, Kind
from conoid.worker.mesh.lookup import meant
from conoid.worker.mesh.model import TetMesh
from conoid.worker.mesh.read import read

from .mixtures import FACES, Mixture, mixture

TYPES: dict[Kind, int] = {HEX8: 12, WEDGE6: 13, PYRAMID5: 14}
NAMES = {HEX8: "hexahedron", WEDGE6: "wedge", PYRAMID5: "pyramid"}


def ids(values: np.ndarray) -> Any:
    return numpy_to_vtkIdTypeArray(values, deep=True)  # type: ignore[no-untyped-call]


def array_of(values: np.ndarray) -> Any:
    return numpy_to_vtk(values, deep=True)  # type: ignore[no-untyped-call]


def grid(truth: Mixture, mirrored: bool) -> vtkUnstructuredGrid:
    """Returns the elements by number, with an array of parts, an array of nodes, and two faces as cells."""
    made, points, numbers = vtkUnstructuredGrid(), vtkPoints(), list(truth.elements)
    points.SetData(array_of(truth.points))
    made.SetPoints(points)
    turned = {WEDGE6: (0, 2, 1, 3, 5, 4)} if mirrored else {}
    rows, types = [], []
    for kind, nodes in truth.elements.values():
        rows.append([nodes[k] for k in turned.get(kind, range(kind.nodes))])
        types.append(TYPES[kind])
    kind, nodes = truth.elements[numbers[0]]
    rows += [[nodes[k] for k in FACES[kind][0]]]
    types += [9 if len(rows[-1]) == 4 else 5]
    cells = vtkCellArray()
    offsets = np.cumsum([0, *map(len, rows)])
    nodes_of_all = list(itertools.chain.from_iterable(rows))
    cells.SetData(*(ids(np.array(each, np.int64)) for each in (offsets, nodes_of_all)))
    made.SetCells(types, cells)
    for data, name, values in (
        (made.GetCellData(), "part", [k % 2 for k in range(len(numbers))] + [9]),
        (made.GetPointData(), "CLAMP", [k % 2 for k in range(len(truth.points))]),
    ):
        array = array_of(np.array(values, np.int32))
        array.SetName(name)
        data.AddArray(array)
    return made


def write(path: Path, truth: Mixture, options: tuple[str, bool, bool, bool], mirrored: bool = False) -> None:
    mode, compressed, big, coded = options
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid(truth, mirrored))
    writer.SetFileName(str(path))
    getattr(writer, f"SetDataModeTo{mode}")()
    getattr(writer, "SetCompressorTypeToZLib" if compressed else "SetCompressorTypeToNone")()
    getattr(writer, "SetByteOrderToBigEndian" if big else "SetByteOrderToLittleEndian")()
    getattr(writer, "SetHeaderTypeToUInt64" if big else "SetHeaderTypeToUInt32")()
    writer.SetEncodeAppendedData(coded)
    writer.SetBlockSize(256)
    assert writer.Write()


def taken(path: Path, group: str | None = None) -> TetMesh:
    return read(MeshFile(shape="file", path=path.name, unit=1.0, group=group), path, "mesh")


OPTIONS = list(itertools.product(("Ascii", "Binary", "Appended"), (False, True), (False, True), (False, True)))


def test_every_encoding_of_vtk_gives_the_same_mesh(tmp_path: Path) -> None:
    for seed, options in enumerate(OPTIONS):
        truth, path = mixture(seed), tmp_path / f"{seed}.vtu"
        write(path, truth, options, mirrored=bool(seed % 2))
        volumes, (first, *_) = truth.volumes(), truth.elements
        found = taken(path)
        assert found.volumes().sum() == pytest.approx(math.fsum(volumes.values()), rel=1e-6), options
        half = math.fsum(volume for k, volume in enumerate(volumes.values()) if k % 2 == 0)
        for group in ("part:0", "0"):
            assert taken(path, group).volumes().sum() == pytest.approx(half, rel=1e-6)
        clamp, face = meant(found.sets, "clamp"), meant(found.sets, "part:9")
        assert clamp is not None
        assert face is not None
        assert clamp.nodes.size == len(truth.points) // 2
        corners = {truth.elements[first][1][k] for k in FACES[truth.elements[first][0]][0]}
        assert {tuple(point) for point in found.points[face.nodes]} == {tuple(truth.points[k]) for k in corners}


def test_files_of_meshio_are_read(tmp_path: Path) -> None:
    for seed, binary, compression in ((0, False, None), (1, True, None), (2, True, "zlib")):
        truth = mixture(seed)
        blocks = [
            (NAMES[kind], np.array([nodes for each, nodes in truth.elements.values() if each is kind]))
            for kind in dict.fromkeys(kind for kind, _ in truth.elements.values())
        ]
        path = tmp_path / f"{seed}.vtu"
        meshio.vtu.write(path, meshio.Mesh(truth.points, blocks), binary=binary, compression=compression)
        expected = math.fsum(truth.volumes().values())
        assert taken(path).volumes().sum() == pytest.approx(expected, rel=1e-6)


def test_a_damaged_file_is_refused_or_has_the_right_mesh(tmp_path: Path) -> None:
    """The test file is truncated, has a changed byte, or has a part that is repeated or missing."""
    path, bad = tmp_path / "good.vtu", tmp_path / "bad.vtu"
    refusals = 0
    for seed in range(60):
        chance, truth = Random(seed), mixture(seed % 5)
        write(path, truth, OPTIONS[seed % len(OPTIONS)])
        content, a, b = path.read_bytes(), *sorted(chance.sample(range(path.stat().st_size), 2))
        changed = (
            content[:a],
            content[:a] + content[b:],
            content[:b] + content[a:],
            content[:a] + b"7" + content[a + 1 :],
        )
        bad.write_bytes(changed[seed % 4])
        refusals += not reads(bad)
    assert refusals > 40


def reads(path: Path) -> bool:
    """Returns whether a file is read; any result other than a refusal in one line is an error."""
    try:
        taken(path)
    except MeshError as error:
        assert "\n" not in str(error), path  # noqa: PT017
        return False
    return True


def test_entities_and_pieces_are_refused(tmp_path: Path) -> None:
    start = '<VTKFile type="UnstructuredGrid"><UnstructuredGrid>'
    for text, message in (
        (f'<!DOCTYPE x [<!ENTITY a "b">]>{start}', "the file defines XML entities"),
        (f"{start}</UnstructuredGrid></VTKFile>", "the file has 0 pieces"),
        ('<VTKFile type="PolyData"></VTKFile>', "this is no .vtu file"),
        ("hello", "the file is damaged or no .vtu file"),
    ):
        (tmp_path / "bad.vtu").write_text(text)
        with pytest.raises(MeshError, match=rf"^mesh\.path = 'bad.vtu': {message}"):
            taken(tmp_path / "bad.vtu")
