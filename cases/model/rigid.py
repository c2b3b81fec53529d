"""The model of a rigid part: mass, centre of mass, inertia, and the check of the inertia."""

from collections.abc import Iterator
from itertools import combinations
from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema

from ..units import Inertia, Mass
from .tables import Model, Point

Tensor = tuple[Inertia, Inertia, Inertia, Inertia, Inertia, Inertia]
"""The inertia tensor as six components: xx, yy, zz, yz, zx, xy."""
_ROUNDING = 1e-9
"""Tolerance of the check of the inertia tensor, divided by its trace. A plate has one moment of inertia that equals the
sum of the other two; the tolerance accepts it although numbers in text are rounded."""


class Rigid(Model):
    """Mass properties of a rigid part that differ from those of its mesh and density."""

    mass: Annotated[Mass, Field(gt=0)] | None = None
    """Mass of the modelled part of the body; with a sector, the mass of the sector. Default: the mass of the mesh.
    Without ``inertia``, this mass also scales the inertia of the mesh."""
    centre: Point | None = None
    """Centre of mass at the start, in the coordinates of the case; must be combined with ``inertia``. Default: the
    centre of mass of the mesh."""
    inertia: Tensor | None = None
    """Moments of inertia about the centre of mass, along the axes of the case, at the start: xx, yy, zz, yz, zx, xy,
    the integrals of density times y^2 + z^2, z^2 + x^2, x^2 + y^2, -yz, -zx, -xy. The inertia tensor must be positive
    definite, with no principal moment above the sum of the other two moments. Default: the sum over the nodes of the
    mesh, where each tet gives a quarter of its mass to each node. The inertia of the mesh exceeds the inertia of the
    smooth body by a fraction of about (tet size / body size)^2."""


class Flag:
    """Addition to the JSON schema of a key that also accepts ``true`` and ``false``."""

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Returns the JSON schema with the addition; pydantic calls this method."""
        schema = handler(core)
        return {**schema, "anyOf": [*schema["anyOf"], {"type": "boolean"}]}


def read_rigid(value: Any) -> Any:
    """Returns ``true`` as a table without keys, and ``false`` as None; returns other values unchanged."""
    if isinstance(value, bool):
        return {} if value else None
    return value


def tensor_problems(inertia: Tensor) -> Iterator[str]:
    """Yields the reasons for which no body can have the given moments of inertia."""
    xx, yy, zz, yz, zx, xy = inertia
    if not _minors_above((xx, yy, zz, yz, zx, xy), 0.0):
        yield "must be positive definite: every principal moment above 0"
        return
    half, slack = 0.5 * (xx + yy + zz), _ROUNDING * (xx + yy + zz)
    second = half - xx + slack, half - yy + slack, half - zz + slack, -yz, -zx, -xy
    if not _minors_above(second, 0.0):
        yield "no body has it: a principal moment is above the sum of the other two"


def _minors_above(tensor: tuple[float, ...], least: float) -> bool:
    """Whether all principal minors of a symmetric matrix are above ``least``; with ``least`` 0 the matrix is positive
    definite.
    """
    xx, yy, zz, yz, zx, xy = tensor
    diagonal, off = (xx, yy, zz), {(1, 2): yz, (0, 2): zx, (0, 1): xy}
    pairs = (diagonal[i] * diagonal[j] - off[i, j] ** 2 for i, j in combinations(range(3), 2))
    whole = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    return all(value > least for value in (*diagonal, *pairs, whole))
