"""The model of the numerical method: pressure, bulk viscosity, time step."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from ..units import Ratio
from .tables import Model, Switch, off


class Viscosity(Model):
    """Bulk viscosity ``q = density * u * ((linear + shock * S) * c + quadratic * u)``, ``u = l * |rate|``, in
    compression only.

    The symbol c is the wave speed. The factor ``S = u / (u + c / 100)`` is close to 0 in elastic waves and close to 1
    in shocks. The length ``l = 1.2009 / sqrt(sum |grad N|^2)`` is V^(1/3) for a regular tet of volume V, and is
    proportional to the altitude of a flat tet. The volumetric strain rate in ``u`` is that of the pressure form: with
    ``nodal`` and ``split`` the mean over the nodes of the tet.
    """

    linear: Annotated[Ratio, Field(ge=0)] = 0.06
    """Coefficient of the linear term, which damps numerical oscillations behind a wave front, but also elastic waves.
    With the coefficient 0.06 a velocity jump of some m/s is followed by oscillations: the tension in the spall plane of
    a flyer plate experiment is then a third too high. With the coefficient 0.3 the tension in the spall plane is a
    sixth too high."""
    shock: Annotated[Ratio, Field(ge=0)] = 0.4
    """Increase of the linear coefficient in shocks: a shock front is spread over some tets and does not overshoot."""
    quadratic: Annotated[Ratio, Field(ge=0)] = 1.5
    """Coefficient of the quadratic term, which spreads strong shocks over some tets."""


class Numerics(Model):
    """Numerical method: pressure, bulk viscosity and time step."""

    pressure: Literal["standard", "nodal", "split"] = "nodal"
    """Pressure form of the tets. ``nodal``: average nodal pressure, for plastic flow and for general use. ``standard``:
    one pressure for each tet, which costs less than ``nodal``, but locks (is too stiff) in plastic flow. ``split``:
    operator split, stabilised by pressure-gradient projection; it damps elastic motion (a free ball of 6,400 tets that
    vibrates radially loses 15 % of its energy in ten periods; with the other pressure forms it loses none). With
    ``nodal`` and ``split``, a tet whose smallest altitude at the start is below a tenth of its longest edge has its own
    pressure, which is not averaged."""
    viscosity: Annotated[Viscosity | None, BeforeValidator(off), Switch()] = Viscosity()
    """Bulk viscosity; ``"none"`` switches the bulk viscosity off."""
    dt_safety: Annotated[Ratio, Field(gt=0, le=1)] = 0.9
    """Time step divided by the rigorous stability limit of the tets, ``1 / (c sqrt(sum |grad N|^2))``. Bodies that
    break into many fragments absorb about 15 % less fracture energy at ``dt_safety`` 0.9 than at 0.6 and below, and
    make fewer fragments. The effect is larger where the elements do not resolve the cohesive zone, which a warning
    reports."""
    dt_growth: Annotated[Ratio, Field(gt=1, le=2)] | None = None
    """Largest ratio of a time step to the previous time step. Default: 1.05. With ``contact.restitution`` the default
    is 1.002: time steps that change with the impacts add energy, and impacts without loss do not dissipate it."""
