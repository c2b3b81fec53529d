"""Bodies of two materials for the tests: one block of tets as two parts that share nodes, or as one part."""

from typing import Any

import numpy as np

from conoid.cases.load import parse_case
from conoid.cases.model.schema import Case
from conoid.worker.mesh.model import Origin, TetMesh

from .meshes import block

FILE = {"shape": "file", "path": "joint.inp", "unit": "1 mm"}
"""Stands in a case for a mesh that the test hands over itself."""


def halves(whole: TetMesh, second: "np.ndarray") -> list[TetMesh]:
    """Two parts of one mesh, as a reader of files gives them: the tets that are not ``second`` (m,), and those that
    are.
    """
    made = []
    for chosen in (~second, second):
        nodes, tets = np.unique(whole.tets[chosen], return_inverse=True)
        made.append(TetMesh(whole.points[nodes], tets.reshape(-1, 4).astype(np.int32), Origin("sha", nodes)))
    return made


def bar(cells: tuple[int, int, int], size: float, at: float, shake: float = 0.1) -> tuple[TetMesh, list[TetMesh]]:
    """A bar along z as one mesh, whose tets are in the order of its halves, and as its halves below and above ``at``.

    ``at`` is a plane of nodes.
    """
    mesh = block(cells, size, shake)
    points = mesh.points.copy()
    near = np.abs(points[:, 2] - at) < 0.5 * size
    points[near, 2] = at
    second = points[mesh.tets, 2].mean(axis=1) > at
    order = np.argsort(second, kind="stable")
    first = np.unique(mesh.tets[~second])
    place = np.concatenate([first, np.setdiff1d(np.arange(len(points)), first)])
    number = np.argsort(place)
    whole = TetMesh(points[place], number[mesh.tets[order]].astype(np.int32))
    return whole, halves(whole, np.sort(second))


def joint(materials: tuple[str, str], bond: dict[str, Any] | None = None, **keys: Any) -> Case:
    """Two parts ``lower`` and ``upper`` with a bond, of files; ``keys`` of the case, ``own`` materials, and ``lower``,
    ``upper``: of the parts.
    """
    own = keys.pop("own", {})
    parts = [
        {"name": name, "material": material, "mesh": FILE, **keys.pop(name, {})}
        for name, material in zip(("lower", "upper"), materials, strict=True)
    ]
    bonds = [{"parts": ["lower", "upper"], "kind": "shared", **(bond or {})}]
    run = {"end_time": "1 us", "frames": 0, **keys.pop("run", {})}
    return parse_case({"name": "joint", "materials": own, "parts": parts, "bond": bonds, "run": run, **keys})


def one_part(material: str, **keys: Any) -> Case:
    """The same as one part."""
    run = {"end_time": "1 us", "frames": 0, **keys.pop("run", {})}
    part = {"name": "bar", "material": material, "mesh": FILE, **keys.pop("bar", {})}
    return parse_case({"name": "joint", "parts": [part], "run": run, **keys})
