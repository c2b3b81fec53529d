"""Bodies of two materials for the tests: one block of tets as two parts with common nodes, or as one part."""

from typing import Any

import numpy as np

from conoid.cases.load import parse_case
from conoid.cases.model.schema import Case
from conoid.worker.mesh.model import Origin, TetMesh

from .meshes import block

FILE = {"shape": "file", "path": "joint.inp", "unit": "1 mm"}
"""Mesh key of a case whose mesh is given directly by the test."""


def halves(whole: TetMesh, second: "np.ndarray") -> list[TetMesh]:
    """Returns two parts of one mesh in the form of a mesh reader: first the tets that are not in ``second`` (m,), then
    the tets in ``second``.
    """
    made = []
    for chosen in (~second, second):
        nodes, tets = np.unique(whole.tets[chosen], return_inverse=True)
        made.append(TetMesh(whole.points[nodes], tets.reshape(-1, 4).astype(np.int32), Origin("sha", nodes)))
    return made


def bar(cells: tuple[int, int, int], size: float, at: float, shake: float = 0.1) -> tuple[TetMesh, list[TetMesh]]:
    """Returns a bar along z twice: as one mesh, whose tets are in the order of its two halves, and as the halves below
    and above ``at``. The coordinate ``at`` is that of a plane of nodes.
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
    """Returns a case of two parts ``lower`` and ``upper`` from files, joined by a bond. The arguments are ``keys`` of
    the case, ``own`` materials, and keys of the parts ``lower`` and ``upper``.
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
    """Returns the case of ``joint`` with one part instead of two."""
    run = {"end_time": "1 us", "frames": 0, **keys.pop("run", {})}
    part = {"name": "bar", "material": material, "mesh": FILE, **keys.pop("bar", {})}
    return parse_case({"name": "joint", "parts": [part], "run": run, **keys})
