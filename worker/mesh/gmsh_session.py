"""gmsh, opened and closed properly. Only the child process gets here: gmsh is GPL and can crash."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import MeshError
from .model import Ids, Names, TetMesh

_TET = 4
"""gmsh's element type of the 4-node tet."""


@dataclass(frozen=True)
class NamedMesh:
    """A mesh, not yet checked, and what its file calls the nodes and tets."""

    mesh: TetMesh
    names: Names
    places: Ids
    """(n,) a number of each node that no other node of the file has."""
    notes: tuple[str, ...] = ()
    """What of the file is not in the mesh, or is taken otherwise than one might think, a line each."""


@contextmanager
def session(options: Mapping[str, float]) -> Iterator[Any]:
    """The gmsh module, silent, without the user's own settings; an error that it logs or raises becomes MeshError."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, run=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        for name, value in options.items():
            gmsh.option.setNumber(name, value)
        gmsh.logger.start()
        yield gmsh
    except MeshError:
        raise
    except Exception as error:
        raise MeshError(f"gmsh: {first_error(gmsh) or str(error) or 'it gave up without a word'}") from error
    finally:
        gmsh.logger.stop()
        gmsh.finalize()


def tet_mesh(gmsh: Any, entities: list[int] | None = None) -> NamedMesh:
    """The tets of the current model, or of the given volume ``entities`` only, and the nodes that they use."""
    blocks = [gmsh.model.mesh.getElementsByType(_TET, entity) for entity in (entities or [-1])]
    tags = np.concatenate([np.asarray(block[0], np.int64) for block in blocks])
    corners = np.concatenate([np.asarray(block[1], np.int64) for block in blocks])
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    return gathered(np.asarray(node_tags, np.int64), coordinates.reshape(-1, 3), tags, corners.reshape(-1, 4))


def gathered(node_tags: Ids, points: Any, tet_tags: Ids, corners: Ids) -> NamedMesh:
    """Tets given by node tags, (m, 4), as indices into the nodes that they use, in the order of the tags."""
    order = np.argsort(node_tags, kind="stable")
    used, tets = np.unique(corners, return_inverse=True)
    place = np.searchsorted(node_tags, used, sorter=order)
    found = place < len(node_tags)
    found[found] = node_tags[order[place[found]]] == used[found]
    if not found.all():
        lost = used[~found][0]
        tet = tet_tags[(corners == lost).any(axis=1)][0]
        raise MeshError(f"tet {tet} uses node {lost}, which is not defined")
    mesh = TetMesh(np.asarray(points, np.float64)[order[place]], tets.reshape(-1, 4).astype(np.int32))
    return NamedMesh(mesh, Names(used, tet_tags), used)


def first_error(gmsh: Any) -> str | None:
    """The first error in gmsh's log: it reads on after many of them."""
    return next((line.removeprefix("Error: ") for line in gmsh.logger.get() if line.startswith("Error")), None)
