"""Flat tets in the averaged pressure forms. The pressure of a flat tet depends on its own volume strain, and flat tets
do not contribute to the nodal means.

The volume of a flat tet is small compared with the volume of its neighbours, so it has little influence on a nodal
mean. A motion along the altitude of a flat tet hardly strains the neighbours but may reduce its volume to zero; after
yield no stress resists this motion. With its own pressure the flat tet resists the motion as in the ``standard`` form.
The number of flat tets is small, so flat tets cause no locking.
"""

import numpy as np

from ..kernels.jit import njit
from ..materials.law import BULK, DENSITY, DILATES
from ..materials.models import press
from ..mesh.faces import FACES, normals
from ..model.rows import DILATION, HEAT, MASS, NODAL_WORK
from ..model.state import CHUNK, Block, Flags, Floats
from .heat_and_bulking import stretch_corner
from .mean import book_averaged
from .pressure import STABILISE
from .scratch import CHANGE, MODULUS, SEEN, VOLUME, VOLUME_MID

THINNEST = 0.1
"""Smallest ratio of altitude to longest edge of a tet whose volume strain is averaged. A tet with a smaller ratio is
flat. The ratio of a regular tet is 0.82. Chosen value: at this ratio a motion that strains the neighbours by a tenth
reduces the volume of the tet to zero (docs/theory/elements.md)."""

_HEAT, _NODAL_WORK, _MASS, _GROWN = HEAT * CHUNK, NODAL_WORK * CHUNK, MASS * CHUNK, DILATION * CHUNK


def flat_tets(block: Block, x0: Floats) -> Flags:
    """(n,) True for each tet of a block that is flat at the start; (0,) if no tet is flat."""
    tets = block.tets.astype(np.int64)
    x = x0[tets]
    edges = x[:, 1:] - x[:, :1]
    volume = np.abs((edges[:, 0] * np.cross(edges[:, 1], edges[:, 2])).sum(axis=1))
    faces = np.max([(normals(x0, tets[:, face]) ** 2).sum(axis=1) for face in FACES], axis=0)
    longest = np.max([((x[:, a] - x[:, b]) ** 2).sum(axis=1) for a in range(4) for b in range(a)], axis=0)
    flat: Flags = volume < THINNEST * np.sqrt(faces * longest)
    return flat if flat.any() else flat[:0]


@njit("void(float64[::1], boolean[::1], int64)", cache=True)
def exclude_flat(w, flat, n):  # type: ignore[no-untyped-def]
    """Excludes flat tets from the nodal sums: sets their volume and their stabilising fluxes to zero."""
    for i in range(n):
        if flat[i]:
            w[VOLUME_MID + i] = 0.0
            for k in range(4):
                w[STABILISE + k * CHUNK + i] = 0.0


@njit("void(float64[::1], float64[::1], float64[::1], boolean[::1], int64, int64)", cache=True, error_model="numpy")
def own_strain(w, s, params, flat, rows, n):  # type: ignore[no-untyped-def]
    """Sets the row SEEN of flat tets to their own volume strain. Sets the row HEAT, if there is one, to their own heat.

    The volume strain is the change of volume divided by the volume at mid-step. The volume at mid-step is the volume at
    the end less half of the change, up to terms of third order.
    """
    unit = params[DENSITY] / params[BULK]
    for i in range(n):
        if flat[i]:
            w[SEEN + i] = w[CHANGE + i] / (w[VOLUME + i] - 0.5 * w[CHANGE + i])
            if params[DILATES] > 0.0:
                w[SEEN + i] += s[_GROWN + i]  # the dilation that ``subtract_dilation`` has subtracted
            if rows > NODAL_WORK + 1:
                for k in range(4):
                    stretch_corner(w, s, i, k, w[SEEN + i])
            elif rows > NODAL_WORK:
                s[_HEAT + i] = unit * s[_NODAL_WORK + i] / s[_MASS + i]


@njit(
    "void(int64, float64[::1], float64[::1], float64[::1], float64[::1], boolean[::1], int64, int64)",
    cache=True,
    error_model="numpy",
)
def own_pressure(eos, w, s, alone, params, flat, rows, n):  # type: ignore[no-untyped-def]
    """Computes pressure, work of the pressure, and the row MODULUS of flat tets, if the pressures of other tets are
    means over their nodes. ``alone`` contains the state before the pressure is computed, and is overwritten.
    """
    modulus = w[MODULUS : MODULUS + CHUNK].copy()
    press(eos, w, alone, params, n)
    book_averaged(w, alone, params, n)
    for i in range(n):
        if flat[i]:
            for row in range(rows):
                s[row * CHUNK + i] = alone[row * CHUNK + i]
        else:
            w[MODULUS + i] = modulus[i]


@njit("void(int64[::1], boolean[::1], int64)", cache=True)
def exclude_flux(wi, flat, n):  # type: ignore[no-untyped-def]
    """Excludes flat tets from the nodal sums of the pressure gradient."""
    for i in range(n):
        if flat[i]:
            wi[i] = wi[CHUNK + i] = wi[2 * CHUNK + i] = 0
