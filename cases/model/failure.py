"""How a part fails: tets that leave it, facets that break."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Ratio
from .tables import Model, Positive


class Erosion(Model):
    """Tets that are worn out leave the body: what lay behind them is laid bare, and meets other bodies from then on.

    A tet leaves when any of these is passed, one that has only strained enough within ten steps. Its elastic energy is
    booked as eroded. A part that erodes cannot fracture.
    """

    plastic_strain: Annotated[Ratio, Positive] | None = None
    """Largest effective plastic strain; none by default."""
    damage: Annotated[Ratio, Field(gt=0, le=1)] | None = None
    """Damage, of a law that counts it, at which a tet leaves: 1 for Johnson and Cook's; none by default."""
    volume: tuple[Annotated[Ratio, Field(gt=0, lt=1)], Annotated[Ratio, Field(gt=1)]] = (0.1, 10.0)
    """Smallest and largest volume, of the initial one."""
    time_step: Annotated[Ratio, Field(gt=0, lt=1)] = 0.02
    """Smallest stable step of a tet, of the first step of the run."""
    nodes: Literal["strike", "particles", "remove"] = "strike"
    """What becomes of a node without tets, a particle with its mass and no volume. ``strike``: it flies on and leaves
    after contact with a face has pushed it. ``particles``: it flies on for ever; many of them gather on a line and dig
    a hole there that matter with a volume would not dig. ``remove``: it leaves at once. Mass, momentum and energy of
    what leaves are booked."""


class Fracture(Model):
    """Facets between tets break, nodes separate, and the pieces meet each other. The material must be ``brittle``; a
    part that fractures cannot erode.
    """

    model: Literal["instant", "cohesive"] = "instant"
    """``instant``: a facet that breaks carries nothing from then on (the paper). ``cohesive``: its traction falls
    linearly with the opening and takes the fracture energy with it (Camacho and Ortiz 1996)."""
    shear_weight: Annotated[Ratio, Field(ge=0)] | None = None
    """beta_tau of sqrt(<t_n>^2 + beta_tau t_s^2): 0 for ``instant`` (the paper: largest normal traction), 1 for
    ``cohesive`` by default, where it must be above 0. At 1 a facet breaks by shear alone at its strength: what is
    compressed across the crack, as a disc between platens, breaks early unless ``friction`` holds it."""
    friction: Annotated[Ratio, Field(ge=0)] = 0.0
    """Internal friction: under a pressure |t_n| a facet breaks by t_s - friction * |t_n|."""
    traction: Literal["tets", "nodes"] = "tets"
    """On a facet, from the stress of its two tets; or besides from that of its three nodes, each the mean of the tets
    round it by volume, and the facet must pass by both: smoother."""
    delay: Annotated[Ratio, Field(ge=0)] = 1.0
    """t_c = delay * density * c * energy / strength^2 of the delayed criterion. The paper prints 0.5, its own equations
    give 1; 0 breaks a facet in the step in which it passes the strength."""
    order: Literal["simultaneous", "local_maximum"] = "simultaneous"
    """Which of the facets that pass break in a step: all, or of those that share a node only the one that is furthest
    beyond its strength."""
    resolve: Literal["none", "strength"] = "none"
    """``strength`` lowers the strength until ``resolution`` elements fit in the cohesive zone, with the same energy."""
    resolution: Annotated[Ratio, Positive] = 3.0
    """Elements that shall fit in the cohesive zone, with ``resolve = "strength"``."""
