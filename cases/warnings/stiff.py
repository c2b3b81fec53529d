"""Notes on parts that could be rigid, because their deformation takes only a small part of the energy of an impact."""

import math
from collections.abc import Iterator

from ..estimates.estimate import Estimate
from ..estimates.impact import wave_speed
from ..model.schema import Case
from ..reading.library import material
from ..reading.problems import Problem, problem
from .compression import impact_stresses

STIFF = 20.0
"""Ratio of the impedance (density times wave speed) of a part to that of every other part, above which the part gives a
note (chosen value). Two bodies in an impact absorb energy in inverse proportion to their impedances. At this ratio the
stiffer body absorbs 5 %."""


def stiff(case: Case, expected: Estimate) -> Iterator[Problem]:
    """Yields a note for each part that could be rigid, with the saving. Parts that can yield, break or erode give no
    note.
    """
    if case.contact is None or len(case.parts) < 2:
        return
    made = [material(case, part.material) for part in case.parts]
    impedances = [each.density * wave_speed(each) for each in made]
    for i, (part, stress) in enumerate(zip(case.parts, impact_stresses(case), strict=True)):
        others = max(z for j, z in enumerate(impedances) if j != i)
        law = made[i].strength
        yields = law is not None and stress > 0.5 * law.flow_stress()
        whole = part.rigid is None and part.fracture is None and part.erosion is None and part.stretch is None
        if whole and not yields and impedances[i] > STIFF * others:
            message = f"the impedance of {part.name!r} is {impedances[i] / others:.0f} times that of every other part"
            yield problem(("parts", i, "rigid"), ..., f"{message}; rigid = true {_saves(i, expected)}")


def _saves(i: int, expected: Estimate) -> str:
    """Returns the words for the tets and the time steps that are saved if part ``i`` is rigid."""
    mine, others = expected.parts[i], [part.dt for j, part in enumerate(expected.parts) if j != i]
    tets = f"{100.0 * mine.elements / expected.elements:.0f} %" if mine.elements and expected.elements else "a share"
    gain = f"would save {tets} of the tets"
    if mine.dt is not None and None not in others:
        longer = min((dt for dt in others if dt is not None), default=math.inf) / mine.dt
        gain += f" and make steps {longer:.2g} times as long" if 1.05 < longer < math.inf else ""
    return gain
