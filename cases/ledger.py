"""The energy ledger of a run: the terms of the energy balance, as they are written in messages, outcome and history."""

import msgspec


class Energy(msgspec.Struct, kw_only=True, frozen=True):
    """The energy ledger, J. The sum of the existing and the dissipated energy equals the initial plus the external
    energy; the difference is the residual. Terms of existing energy: kinetic, elastic, cohesive. Terms of dissipated
    energy: plastic, viscous, contact, friction, eroded, fracture, stepping. The term averaging contains both existing
    and dissipated energy.
    """

    kinetic: float
    elastic: float
    plastic: float
    viscous: float
    contact: float
    """Energy dissipated by contact impulses between bodies and with walls, without friction."""
    friction: float = 0.0
    eroded: float = 0.0
    """Elastic energy of deleted tets, and kinetic energy of the nodes that were deleted with these tets."""
    fracture: float = 0.0
    """Energy dissipated by cohesive facets and tied bonds."""
    cohesive: float = 0.0
    """Energy stored in cohesive facets, which is released when the facets close."""
    stepping: float = 0.0
    """Energy dissipated by changes of the length of the time step, which is an error of the method; negative if these
    changes have added energy."""
    averaging: float = 0.0
    """Work of the averaged nodal pressures, only with the pressure forms ``nodal`` and ``split``. This work is stored
    in the pressure differences between tets and nodes. Work that averaged pressures have stored is dissipated if
    neighbouring tets yield or fail at different times."""
    external: float
    initial: float
    residual: float
    """Absolute value of the sum of all terms minus initial and external energy, divided by the largest energy that the
    model has received; dimensionless."""


class PartEnergy(msgspec.Struct, kw_only=True, frozen=True):
    """Energies of one part, J. The sums over all parts equal the energies of the ledger, except for the energies of
    deleted tets.
    """

    kinetic: float
    internal: float
    """Work of the stress and the bulk viscosity in the tets that still exist: elastic, plastic, viscous and averaging.
    """
