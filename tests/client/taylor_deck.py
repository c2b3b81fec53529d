"""Writes the deck of the shipped case ``imported_taylor``: a quarter of the copper Taylor bar, in mm, t, s.

The command ``python -m tests.client.taylor_deck cases/shipped/imported_taylor.inp`` writes the deck again; a name that
ends in ``.k`` gives the same deck for LS-DYNA.
"""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from conoid.cases.model.bodies import Cylinder
from conoid.worker.mesh.model import TetMesh
from conoid.worker.mesh.structured import structured

_NEAR = 1e-9


def mesh(size: float) -> TetMesh:
    """Returns the mesh of a quarter of the bar of taylor_copper, with radius 3.2 mm and length 32.4 mm; ``size``:
    element size in m.
    """
    return structured(Cylinder(
        shape="cylinder", radius=3.2e-3, length=32.4e-3, sector="quarter", generator="structured", element_size=size
    ))  # fmt: skip


def points(made: TetMesh) -> Iterator[tuple[int, float, float, float]]:
    """Yields number and coordinates of the nodes, in mm."""
    for number, (x, y, z) in enumerate(made.points.tolist(), 1):
        yield number, 1e3 * x, 1e3 * y, 1e3 * z


def plane(made: TetMesh, axis: int) -> list[int]:
    """Returns the numbers of the nodes on the plane of symmetry across an axis."""
    return [int(n) + 1 for n in np.flatnonzero(np.abs(made.points[:, axis]) < _NEAR)]


def rows(numbers: Iterable[int], width: int, between: str = "") -> str:
    """Returns lines of eight numbers each."""
    words = [f"{number:{width}}" for number in numbers]
    return "\n".join(between.join(words[i : i + 8]) for i in range(0, len(words), 8))


def lsdyna_text(size: float, end: str = "8.0E-5") -> str:
    """Returns the Taylor deck for LS-DYNA."""
    made = mesh(size)
    nodes = "\n".join(f"{n:8}{x:16.9f}{y:16.9f}{z:16.9f}" for n, x, y, z in points(made))
    solids = "\n".join(
        f"{n:8}{1:8}" + "".join(f"{c + 1:8}" for c in (*tet, *(tet[3],) * 4))
        for n, tet in enumerate(made.tets.tolist(), 1)
    )
    return _LSDYNA.format(
        end=end, nodes=nodes, solids=solids, x=rows(plane(made, 0), 10), y=rows(plane(made, 1), 10), name="copper rod"
    )


def abaqus_text(size: float, end: str = "8.0E-5") -> str:
    """Returns the Taylor deck for Abaqus/Explicit; the nodes at the end of the bar are fixed to the plane of the
    wall.
    """
    made = mesh(size)
    nodes = "\n".join(f"{n}, {x:.9f}, {y:.9f}, {z:.9f}" for n, x, y, z in points(made))
    tets = "\n".join(f"{n}, " + ", ".join(str(c + 1) for c in tet) for n, tet in enumerate(made.tets.tolist(), 1))
    x, y, z = (rows(plane(made, axis), 0, ", ") for axis in range(3))
    return _ABAQUS.format(end=end, nodes=nodes, tets=tets, x=x, y=y, z=z)


_LSDYNA = """*KEYWORD
*TITLE
Taylor bar of copper, a quarter, 227 m/s
$ mm, t, s
*CONTROL_TERMINATION
$   endtim
{end:>10}
*CONTROL_ENERGY
         2         2         2         2
*DATABASE_GLSTAT
    1.0E-6
*DATABASE_BINARY_D3PLOT
    4.0E-6
*PART
{name}
$      pid     secid       mid
         1         1         1
*SECTION_SOLID
$    secid    elform
         1        13
*MAT_PIECEWISE_LINEAR_PLASTICITY_TITLE
copper
$      mid        ro         e        pr      sigy      etan      fail      tdel
         1   8.93E-9  117000.0      0.35
$        c         p      lcss      lcsr        vp
                             1
*DEFINE_CURVE
$     lcid
         1
                 0.0               400.0
                 1.0               500.0
*INITIAL_VELOCITY_GENERATION
$nsid/pid      styp     omega        vx        vy        vz
         1         2       0.0       0.0       0.0 -227000.0
       0.0       0.0       0.0       0.0       0.0       0.0
*RIGIDWALL_PLANAR_ID
         1anvil
         0         0         0
       0.0       0.0       0.0       0.0       0.0       1.0       0.0
*BOUNDARY_SPC_SET
         1         0         1         0         0         0         1         1
*BOUNDARY_SPC_SET
         2         0         0         1         0         1         0         1
*SET_NODE_LIST_TITLE
plane x = 0
         1
{x}
*SET_NODE_LIST_TITLE
plane y = 0
         2
{y}
*NODE
{nodes}
*ELEMENT_SOLID
{solids}
*END
"""
_ABAQUS = """*HEADING
Taylor bar of copper, a quarter, 227 m/s
*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=C3D4, ELSET=ROD
{tets}
*NSET, NSET=XSYM
{x}
*NSET, NSET=YSYM
{y}
*NSET, NSET=ZSYM
{z}
*SOLID SECTION, ELSET=ROD, MATERIAL=COPPER
*MATERIAL, NAME=COPPER
*DENSITY
8.93E-9,
*ELASTIC
117000., 0.35
*PLASTIC
400., 0.
500., 1.
*BOUNDARY
XSYM, XSYMM
YSYM, YSYMM
ZSYM, ZSYMM
*INITIAL CONDITIONS, TYPE=VELOCITY
ALL, 1, 0.
ALL, 2, 0.
ALL, 3, -227000.
*STEP
*DYNAMIC, EXPLICIT
, {end}
*OUTPUT, FIELD, NUMBER INTERVAL=20
*END STEP
"""


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.write_text((lsdyna_text if target.suffix == ".k" else abaqus_text)(1.08e-3), encoding="utf-8")
