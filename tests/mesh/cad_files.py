"""Writes STEP, BREP and STL files, with gmsh or facet by facet."""

import re
import struct
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Facets = NDArray[np.float64]

_WRITE = """
import gmsh, sys
gmsh.initialize(readConfigFiles=False, run=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
occ.addBox(0, 0, 0, 10, 10, 10)
occ.addCylinder(20, 0, 0, 0, 0, 5, 3)
occ.addBox(10, 0, 0, 2, 10, 10)
occ.synchronize()
for name in sys.argv[1:]:
    gmsh.write(name)
gmsh.finalize()
"""
NAMES = ("Core", "Rod, 'x'", "Jacket")
"""Names of the three solids: a cube of 10, a cylinder of radius 3 and length 5, and a plate of 2 x 10 x 10 on the
cube."""
_INCH = """#9001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#9002);
#9002 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );
#9003 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
"""
_MILLIMETRE = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
_BASED = "( CONVERSION_BASED_UNIT('INCH',#9001) LENGTH_UNIT() NAMED_UNIT(#9003) )"


@cache
def written(folder: Path) -> tuple[str, bytes]:
    """Writes the three solids as STEP in millimetres, with names, and as BREP."""
    names = [str(folder / name) for name in ("solids.step", "solids.brep")]
    subprocess.run([sys.executable, "-c", _WRITE, *names], check=True, capture_output=True)
    text = Path(names[0]).read_text()
    for n, name in enumerate(NAMES, 1):
        quoted = name.replace("'", "''")
        text = re.sub(rf"'Open CASCADE STEP translator [\d.]+ 1\.{n}'", f"'{quoted}'", text)
    return re.sub(r"'Open CASCADE STEP translator [\d.]+ 1'", "'Bullet'", text), Path(names[1]).read_bytes()


def in_metres(step: str) -> str:
    """Returns the text of a STEP file with the same numbers in metres."""
    return step.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)")


def in_inches(step: str) -> str:
    """Returns the text of a STEP file with the same numbers in inches, which STEP defines by millimetres."""
    end = step.rindex("ENDSEC;")
    return (step[:end] + "@" + step[end:]).replace(_MILLIMETRE, _BASED).replace("@", _INCH)


def box(low: tuple[float, float, float] = (0.0, 0.0, 0.0), size: float = 10.0) -> Facets:
    """Returns (12, 3, 3) facets of a cube."""
    x = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], np.float64) * size + low
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([x[list(each)] for a, b, c, d in sides for each in ((a, b, c), (a, c, d))])


def ball(n: int = 24, radius: float = 5.0, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Facets:
    """Returns (k, 3, 3) facets of a ball with ``n`` facets around it and its poles along z, in single precision."""
    theta, phi = np.linspace(0.0, np.pi, n // 2 + 1), np.linspace(0.0, 2.0 * np.pi, n + 1)[:-1]
    rings = [[(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)) for p in phi] for t in theta]
    rings[0], rings[-1] = [(0.0, 0.0, 1.0)] * n, [(0.0, 0.0, -1.0)] * n
    facets = []
    for i in range(n // 2):
        for j in range(n):
            a, b, c, d = rings[i][j], rings[i + 1][j], rings[i + 1][(j + 1) % n], rings[i][(j + 1) % n]
            facets += ([(a, b, c)] if i < n // 2 - 1 else []) + ([(a, c, d)] if i > 0 else [])
    return (np.array(facets) * radius + centre).astype(np.float32).astype(np.float64)


def binary(facets: Facets) -> bytes:
    """Returns a binary STL file whose header begins like a text file."""
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *each.ravel(), 0) for each in facets)
    return b"solid of facets".ljust(80) + struct.pack("<I", len(facets)) + rows


def text(facets: Facets) -> str:
    """Returns an STL file as text."""
    corners = "\n".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in each)
        + "endloop\nendfacet" for each in facets
    )  # fmt: skip
    return f"solid x\n{corners}\nendsolid x\n"
