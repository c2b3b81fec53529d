"""Akantu on a mesh, in a separate process: ``python akantu_steps.py MESH.npz true|false``; the second argument selects
finite deformation.

After the start the process prints "ready". Each input line is a number of explicit steps; the process computes these
steps and prints their CPU time in s. This module imports no module of Conoid, because it may run under another
interpreter.
"""

import sys
import tempfile
import time
from pathlib import Path

import akantu
import numpy as np

_STEEL = """
material elastic [
  name = steel
  rho = 7850
  E = 200e9
  nu = 0.3
  finite_deformation = {finite}
]
"""


def main(mesh_path: str, finite: str) -> None:
    """Creates the model, and answers input lines until standard input ends."""
    with np.load(mesh_path) as stored:
        mesh = _mesh(stored["points"], stored["tets"])
        model = _model(mesh, stored["points"], finite)
    print("ready", flush=True)
    for line in sys.stdin:
        begin = time.process_time()
        for _ in range(int(line)):
            model.solveStep()
        print(time.process_time() - begin, flush=True)


def _mesh(points: "np.ndarray", tets: "np.ndarray") -> "akantu.Mesh":
    """This object must exist as long as the model, because the model has no reference to the object."""
    mesh = akantu.Mesh(3)
    access = akantu.MeshAccessor(mesh)
    access.resizeNodes(len(points))
    mesh.getNodes()[:] = points
    mesh.addConnectivityType(akantu._tetrahedron_4)
    access.resizeConnectivity(len(tets), akantu._tetrahedron_4)
    mesh.getConnectivity(akantu._tetrahedron_4)[:] = tets
    access.makeReady()
    return mesh


def _model(mesh: "akantu.Mesh", points: "np.ndarray", finite: str) -> "akantu.SolidMechanicsModel":
    with tempfile.TemporaryDirectory() as folder:
        material = Path(folder) / "material.dat"
        material.write_text(_STEEL.format(finite=finite), encoding="utf-8")
        akantu.parseInput(str(material))
    model = akantu.SolidMechanicsModel(mesh)
    model.initFull(_analysis_method=akantu._explicit_lumped_mass)
    model.setTimeStep(0.8 * model.getStableTimeStep())
    model.getVelocity()[:] = 1.0 * (points - points.mean(axis=0)) / np.ptp(points)
    return model


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
