"""Lists of the strength laws and equations of state, and the kernels that call the law or equation of a block.

The number of a law is its place in ``LAWS``; the number of an equation of state is its place in ``EQUATIONS``. A block
stores the two numbers and one vector of constants. A new law needs a line in LAWS and a branch in ``strengthen``. The
test tests/worker/test_laws.py checks that every law has a branch.
"""

import math

import numpy as np

from conoid.cases.model.materials import Material
from conoid.cases.model.schema import Viscosity

from ..kernels.jit import njit
from ..model import rows
from ..model.state import Floats
from . import cowper_symonds, equation_of_state, hyperelastic, johnson_cook, johnson_holmquist, mohr_coulomb, plastic
from .law import (
    BREAKS,
    BULK,
    DENSITY,
    DILATES,
    EQUATION,
    FIRST,
    ORDER,
    Q_LINEAR,
    Q_QUADRATIC,
    Q_SHOCK,
    SHEAR,
    SIZE,
    SPALL,
    Equation,
    Law,
    placed,
)

LAWS = (
    hyperelastic.LAW, plastic.LAW, johnson_cook.LAW, mohr_coulomb.LAW, johnson_holmquist.LAW, cowper_symonds.LAW,
)  # fmt: skip
EQUATIONS = (equation_of_state.ELASTIC, equation_of_state.GRUNEISEN, johnson_holmquist.PRESSURE_LAW)


@njit("void(int64, float64[::1], float64[::1], float64[::1], int64, float64)", cache=True, error_model="numpy")
def strengthen(law, w, s, params, n, dt):  # type: ignore[no-untyped-def]
    """Calls the kernel of number ``law`` in LAWS. The kernel computes the deviatoric stress of a chunk, and the state
    of the law.
    """
    if law == 0:
        hyperelastic.hyperelastic(w, s, params, n, dt)
    elif law == 1:
        plastic.linear_hardening(w, s, params, n, dt)
    elif law == 2:
        johnson_cook.johnson_cook(w, s, params, n, dt)
    elif law == 3:
        mohr_coulomb.mohr_coulomb(w, s, params, n, dt)
    elif law == 4:
        johnson_holmquist.johnson_holmquist(w, s, params, n, dt)
    elif law == 5:
        cowper_symonds.cowper_symonds(w, s, params, n, dt)


@njit("void(int64, float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def press(equation, w, s, params, n):  # type: ignore[no-untyped-def]
    """Calls the kernel of number ``equation`` in EQUATIONS. The kernel computes the pressure of a chunk, the work of
    the pressure, and MODULUS.
    """
    if equation == 0:
        equation_of_state.linear(w, s, params, n)
    elif equation == 1:
        equation_of_state.mie_gruneisen(w, s, params, n)
    elif equation == 2:
        johnson_holmquist.crumbling(w, s, params, n)


@njit("void(int64, float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def swell(equation, w, s, params, n):  # type: ignore[no-untyped-def]
    """Sets the row VOLUME_SEEN of a chunk before the step. The kernel is number ``equation`` in EQUATIONS."""
    if equation == 0:
        equation_of_state.volumes_by_pressure(w, s, params, n)
    else:
        equation_of_state.volumes_by_ratio(w, s, params, n)


def strength_of(material: Material) -> int:
    """Returns the number of the material's strength law."""
    return [law.model for law in LAWS].index("" if material.strength is None else material.strength.model)


def eos_of(material: Material) -> int:
    """Returns the number of the material's equation of state."""
    name = law_of(material).equation or ("" if material.eos is None else material.eos.model)
    return [equation.model for equation in EQUATIONS].index(name)


def law_of(material: Material) -> Law:
    """Returns the material's strength law."""
    return LAWS[strength_of(material)]


def equation_of(material: Material) -> Equation:
    """Returns the material's equation of state."""
    return EQUATIONS[eos_of(material)]


def moduli(material: Material) -> tuple[float, float]:
    """Returns the bulk modulus at rest and the shear modulus, Pa."""
    return material.bulk, material.elastic.shear


def parameters(material: Material, viscosity: Viscosity | None, *, breaks: bool = False) -> Floats:
    """(SIZE,) constants of a material, SI units. ``viscosity``: None for no bulk viscosity; ``breaks``: True if the
    part fractures.
    """
    law, params = law_of(material), np.zeros(SIZE)
    params[DENSITY], params[ORDER] = material.density, law.order
    params[SPALL] = math.inf if material.spall is None else material.spall
    params[BULK], params[SHEAR] = moduli(material)
    params[DILATES], params[BREAKS] = law.dilates(material.strength), float(breaks)
    if viscosity is not None:
        params[Q_LINEAR], params[Q_QUADRATIC] = viscosity.linear, viscosity.quadratic
        params[Q_SHOCK] = viscosity.shock
    placed(params, EQUATION, equation_of(material).constants(material.eos), FIRST - EQUATION)
    placed(params, FIRST, law.constants(material.strength), SIZE - FIRST)
    return params


def rows_of(material: Material, pressure: str) -> int:
    """Returns the number of state rows of a tet of this material (worker/model/rows.py)."""
    equation = equation_of(material)
    averaged = 0 if pressure == "standard" else max(rows.WORK_AVERAGED + 1, equation.averaged)
    porous = 0 if material.spall is None else rows.PORES + 1
    return max(law_of(material).rows(material.strength), equation.rows, averaged, porous)


def beginning(material: Material, temperature: float) -> dict[int, float]:
    """Returns the initial values of the state rows that a block has. Rows whose initial value is zero are omitted."""
    own = law_of(material).begin(material.strength, temperature)
    return {rows.VOLUME_RATIO: 1.0, rows.TEMPERATURE: temperature, **own}
