"""The energy ledger of a run, in the form of messages, outcome and history."""

import msgspec


class Energy(msgspec.Struct, kw_only=True, frozen=True):
    """The energy ledger, J. The sum of existing and dissipated energy equals initial + external energy, except for the
    residual. Terms of existing energy: kinetic, elastic, cohesive. Terms of dissipated energy: plastic, viscous,
    contact, friction, eroded, fracture, stepping. The term averaging contains both existing and dissipated energy.
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
    """Energy dissipated by time steps of unequal length, an error of the method; negative if the time steps have added
    energy."""
    averaging: float = 0.0
    """Work of averaged nodal pressures, with ``nodal`` and ``split`` only. This work is stored in pressure differences
    between tets and nodes, and is dissipated if neighbouring tets yield or fail at different times."""
    external: float
    initial: float
    residual: float
    """|sum of all terms - initial - external| divided by the largest energy that has entered; dimensionless."""


class PartEnergy(msgspec.Struct, kw_only=True, frozen=True):
    """Energies of one part, J. The sums over all parts are the energies of the ledger, without deleted tets."""

    kinetic: float
    internal: float
    """Work of stress and bulk viscosity in the present tets: elastic, plastic, viscous and averaging."""
