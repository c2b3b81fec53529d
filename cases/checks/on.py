"""Sets of mesh files that boundaries, probes (key ``on``) and frames (key ``run.sets``) use: the number of each set,
and the parts that have it.
"""

from collections.abc import Iterator
from typing import NamedTuple

from ..model.bodies import MeshFile
from ..model.boundaries import Prescribed, Rotation, Symmetry, Traction
from ..model.measures import WHOLE, Probe, kind
from ..model.schema import Case, Part
from ..reading.problems import Location, Problem, problem

MOST = 62
"""Largest number of sets of a case: a 64-bit integer per node has one bit for each set."""


class Framed(NamedTuple):
    """A set of a mesh file that frames contain (``run.sets``)."""

    on: str
    parts: tuple[str, ...] = ()


Held = Prescribed | Rotation | Symmetry | Traction
"""Kinds of boundaries that may select a set."""
Selecting = Held | Probe | Framed
"""Every object of a case that may select a set."""


def ons(case: Case) -> list[tuple[Location, Selecting]]:
    """Returns every boundary, probe and frame setting that selects a set, with the location of the key that names the
    set.
    """
    boundaries: list[tuple[Location, Selecting]] = [
        (("boundaries", i, "on"), each)
        for i, each in enumerate(case.boundaries)
        if isinstance(each, Held) and each.on is not None
    ]
    probes = [(("probes", i, "on"), each) for i, each in enumerate(case.probes) if each.on is not None]
    return [*boundaries, *probes, *((("run", "sets", i), Framed(name)) for i, name in enumerate(case.run.sets))]


def bits(case: Case) -> dict[str, int]:
    """Returns a number for each set of the case, beginning with 0."""
    return {name: bit for bit, name in enumerate(dict.fromkeys(each.on or "" for _, each in ons(case)))}


def named(spec: Selecting) -> tuple[str, ...]:
    """Returns the names of the parts that the boundary or probe names."""
    return ((spec.part,) if spec.part else ()) if isinstance(spec, Probe) else spec.parts


def parts(case: Case, spec: Selecting) -> list[Part]:
    """Returns the parts whose sets the boundary or probe selects: the named parts; if it names no part, all parts with
    a mesh file.
    """
    names = named(spec)
    return [part for part in case.parts if (part.name in names if names else isinstance(part.mesh, MeshFile))]


def check_ons(case: Case) -> Iterator[Problem]:
    """Yields a problem for each boundary, probe or frame setting that selects a set of a part without sets. Only mesh
    files have sets.
    """
    for location, spec in ons(case):
        generated = [part.name for part in parts(case, spec) if not isinstance(part.mesh, MeshFile)]
        if generated:
            message = f"only meshes from files have sets; the mesh of {generated[0]!r} is generated"
            yield problem(location, spec.on, message)
        elif not parts(case, spec):
            yield problem(location, spec.on, "only meshes from files have sets; no part of the case has one")
        if isinstance(spec, Probe) and kind(spec.field) in WHOLE:
            message = "is allowed with means, peaks and sums only; remove on, or use another field than"
            yield problem(location, spec.on, f"{message} {spec.field!r}")
    if len(bits(case)) > MOST:
        message = f"boundaries, probes and frames use {len(bits(case))} sets; allowed: up to {MOST}"
        yield problem(("boundaries",), ..., message)
