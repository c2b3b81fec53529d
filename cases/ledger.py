"""The energy ledger of a run, as messages, outcome and history have it."""

import msgspec


class Energy(msgspec.Struct, kw_only=True, frozen=True):
    """The energy ledger, J. Existing and dissipated energy = initial + external, up to the residual. Existing:
    kinetic, elastic, cohesive. Dissipated: plastic, viscous, contact, friction, eroded, fracture, stepping. Both:
    averaging.
    """

    kinetic: float
    elastic: float
    plastic: float
    viscous: float
    contact: float
    """Energy dissipated by contact impulses between bodies and with walls, without friction."""
    friction: float = 0.0
    eroded: float = 0.0
    """Elastic energy of deleted tets, and kinetic energy of nodes deleted with them."""
    fracture: float = 0.0
    """Energy dissipated by cohesive facets and tied bonds."""
    cohesive: float = 0.0
    """Energy stored in cohesive facets; it is released when the facets close."""
    stepping: float = 0.0
    """Energy dissipated by time steps of unequal length, an error of the method; negative if the steps have added
    energy."""
    averaging: float = 0.0
    """Work of averaged nodal pressures: stored in pressure differences between tets and nodes, and dissipated where
    neighbours yield or fail at different times; ``nodal`` and ``split`` only."""
    external: float
    initial: float
    residual: float
    """|sum of all lines - initial - external| over the largest energy that has entered; dimensionless."""


class PartEnergy(msgspec.Struct, kw_only=True, frozen=True):
    """Energies of one part, J. The sums over all parts are those of the ledger, without deleted tets."""

    kinetic: float
    internal: float
    """Work of stress and bulk viscosity in the present tets: elastic, plastic, viscous and averaging."""
