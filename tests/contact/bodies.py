"""Bodies for the tests of contact: cases of several blocks, the pieces of the blocks on several ranks, tables of nodes
and faces.
"""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from conoid.cases.model import schema
from conoid.worker.contact.surface.records import CrackSides, SurfaceNodes
from conoid.worker.contact.surface.surface import Surface, SurfaceBuilder
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.state import Model
from conoid.worker.parallel.comm import Comm, SerialComm
from conoid.worker.parallel.team import team
from conoid.worker.scene import assembly, domain

from ..worker.kernels import DUMMY, scene

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int32]
Flags = npt.NDArray[np.bool_]


def moved(mesh: TetMesh, by: Sequence[float], turn: Floats | None = None) -> TetMesh:
    """Returns the mesh turned about its middle and then moved by ``by``, m."""
    middle = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
    turned = mesh.points if turn is None else middle + (mesh.points - middle) @ turn.T
    return TetMesh(turned + np.asarray(by), mesh.tets)


def rotation(axis: Sequence[float], angle: float) -> Floats:
    """Returns the (3, 3) rotation matrix about ``axis`` by ``angle``, rad (Rodrigues)."""
    n = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), -n)
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def meeting_of(motions: Sequence[dict[str, Any]], contact: dict[str, Any] | None = None, **keys: Any) -> schema.Case:
    """Returns a case with one part for each of the ``motions`` (velocity, spin), body0, body1 ..., all in contact with
    each other.
    """
    parts = tuple(
        schema.Part(name=f"body{i}", material="metal", mesh=DUMMY, **motion) for i, motion in enumerate(motions)
    )
    return scene(**keys).model_copy(update={"parts": parts, "contact": schema.Contact(**contact or {})})


def pieces_of(case: schema.Case, meshes: Sequence[TetMesh], ranks: int = 1) -> list[tuple[domain.Piece, Model]]:
    """Returns the piece of each rank of a scene whose parts have the given meshes."""
    ready = iter(meshes)
    with patch.object(assembly, "build_mesh", lambda *_, **__: next(ready)):
        whole = assembly.assemble(case, Path())
    return [(piece, domain._model(case, piece)) for piece in domain.cut(whole, ranks)]


def surface_of(
    piece: domain.Piece, model: Model, comm: Comm | None = None, planes: Flags | None = None, edges: bool = True
) -> Surface:
    """Returns the surface of a rank's piece; ``planes`` (nodes, planes): whether each node belongs to each symmetry
    plane.
    """
    on_planes = np.zeros((model.nodes.n, 0), bool) if planes is None else planes
    none = np.zeros((0, 3), np.int32)
    nothing = CrackSides(none, none), none
    return SurfaceBuilder(team(1)).build(model, on_planes, piece.neighbours, comm or SerialComm(), edges, *nothing)


def nodes_of(x: Floats, v: Floats | None = None, part: Indices | None = None) -> SurfaceNodes:
    """Returns free nodes of 1 kg with ids 0, 1, ... at the positions ``x``."""
    n = len(x)
    flown = np.zeros((n, 3)) if v is None else v
    return SurfaceNodes(
        np.arange(n), np.arange(n, dtype=np.int32), np.zeros(n, np.int32),
        np.zeros(n, np.int32) if part is None else part, np.ones((n, 3)), x, flown, flown,
    )  # fmt: skip


def sheet(cells: int, size: float) -> tuple[Floats, Indices]:
    """Returns nodes and triangles of a square sheet at z = 0, with normals upwards."""
    grid = np.array(list(product(range(cells + 1), range(cells + 1))), float) * size
    a = (np.array(list(product(range(cells), range(cells)))) @ [cells + 1, 1])[:, None]
    faces = np.concatenate([a + np.array([0, cells + 1, cells + 2]), a + np.array([0, cells + 2, 1])])
    return np.column_stack([grid, np.zeros(len(grid))]), faces.astype(np.int32)
