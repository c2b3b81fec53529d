"""Selection of the pressure form of a case."""

import numpy as np

from conoid.cases.model.schema import Case
from conoid.cases.reading.library import material as find_material

from ..accounts.timers import Timers
from ..boundaries.boundaries import Boundary
from ..materials.models import eos_of, equation_of, parameters
from ..model.state import Floats, Model
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..parallel.team import Team
from .averages import Averages, volumes
from .averaging import AveragedElements
from .forms import Elements
from .matter import pressure_place


def elements_of(
    case: Case, model: Model, neighbours: list[Neighbour], scene: list[Boundary], node_volume: Floats, comm: Comm,
    timers: Timers, threads: Team,
) -> Elements:  # fmt: skip
    """Returns the elements of a model in the pressure form that the case selects. ``node_volume`` (nodes,): volumes at
    the start, m^3.

    Collective.
    """
    form = case.numerics.pressure
    if form == "standard":
        return Elements(model, comm, neighbours, timers, threads)
    materials = [find_material(case, part.material) for part in case.parts]
    params = np.array([parameters(each, None) for each in materials])
    kinds = np.array([pressure_place(eos_of(each), own) for each, own in zip(materials, params, strict=True)])
    more = any(equation_of(each).averaged for each in materials)
    averages, density = Averages.of(case, model, neighbours), [each.density for each in materials]
    weight = 1.0 / volumes(averages, model.nodes, node_volume, density)
    return AveragedElements(
        model, comm, neighbours, timers, threads, averages, weight, params, kinds, scene, form == "split", more
    )  # fmt: skip
