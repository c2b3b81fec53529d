"""Contribution of rigid bodies, and of walls with a mass, to the sums of the energy balance."""

import numpy as np

from ..boundaries.wall_shapes import Walls
from ..model.state import Floats
from .stage import Rigid


def energy_of(rigid: Rigid | None, walls: Walls) -> float:
    """Returns the kinetic energy of rigid bodies and of walls with a mass, J."""
    return walls.kinetic() + (float(rigid.account.kinetic().sum()) if rigid is not None else 0.0)


def of_bonds(rigid: Rigid | None) -> list[float]:
    """Returns the energy that tied bonds took from each rigid body, J."""
    return rigid.account.bond_loss.tolist() if rigid is not None else []


def add_undeformed(sums: Floats, of_parts: Floats, rigid: Rigid | None, walls: Walls) -> None:
    """Adds the values of rigid bodies and walls to ``sums`` (10,) over the nodes (accounts/nodal.py): kinetic energy,
    loss by contact and external work, J, momentum, kg m/s, the work of unequal steps (zero here), and angular momentum,
    kg m^2/s. Also adds the kinetic energy to the energy of each part, ``of_parts`` (parts, .).
    """
    if rigid is None and not walls.lightness.any():
        return
    momenta = np.zeros(6) if rigid is None else rigid.account.momenta()
    if walls.lightness.any():
        sums[0] += walls.kinetic()
        momenta = momenta + walls.momenta()
    if rigid is not None:
        kinetic = rigid.account.kinetic()
        of_parts[rigid.bodies.part, 0] += kinetic
        sums[0] += kinetic.sum()
        sums[1] += rigid.account.contact_loss.sum()
        sums[2] += rigid.account.external_work.sum()
    sums[[3, 4, 5, 7, 8, 9]] += momenta
