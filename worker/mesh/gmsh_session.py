"""Sessions of gmsh. Sessions run in the child process only, because gmsh has the licence GPL and can crash."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..errors import MeshError
from .model import TetMesh
from .named import NamedMesh, gathered

_TET = 4
"""Number by which gmsh identifies the 4-node tet."""


OPTIONS = {
    "Geometry.OCCUnionUnify": 0,
    "General.NumThreads": 1,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 10,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.Optimize": 1,
    "Mesh.OptimizeThreshold": 0.45,
    "Mesh.RandomSeed": 1,
}
"""gmsh options of every mesh that is made. The reasons for the values are in ``mesh/unstructured.py``."""


@contextmanager
def session(options: Mapping[str, float]) -> Iterator[Any]:
    """Yield the gmsh module, without its printed output and without the settings of the user. An error that gmsh logs
    or raises becomes MeshError.
    """
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
        raise MeshError(f"gmsh: {first_error(gmsh) or str(error) or 'it failed without a message'}") from error
    finally:
        gmsh.logger.stop()
        gmsh.finalize()


def tet_mesh(gmsh: Any) -> TetMesh:
    """Return the tets of the current gmsh model, and the nodes of the tets."""
    return named_mesh(gmsh).mesh


def named_mesh(gmsh: Any) -> NamedMesh:
    """Return the tets and nodes of the current gmsh model, with the numbers that gmsh gives them; the nodes are ordered
    by number.
    """
    tags, corners = gmsh.model.mesh.getElementsByType(_TET)
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    nodes, points = np.asarray(node_tags, np.int64), coordinates.reshape(-1, 3)
    return gathered(nodes, points, np.asarray(tags, np.int64), np.asarray(corners, np.int64).reshape(-1, 4))


def first_error(gmsh: Any) -> str | None:
    """Return the first error in the log of gmsh. gmsh continues after many errors."""
    return next((line.removeprefix("Error: ") for line in gmsh.logger.get() if line.startswith("Error")), None)
