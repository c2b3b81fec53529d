"""Largest compression of brittle materials that have no law of compressive failure, divided by Griffith's criterion.
This compression is computed in every step, for a warning (cases/warnings/compression.py).

A material without a law of compressive failure breaks in tension only and bears any compression. Each stress is
compared with the criterion of Griffith (1924): the ratio (s1 - s3)^2 / (8 T (s1 + s3)), with the largest principal
pressure s1, the smallest principal pressure s3 and the tensile strength T. A material of this strength cracks at a
ratio of 1; the ratio is proportional to the stress. A tension s3 < 0 counts as zero, because the tensile criterion
covers tension. The stress is that of the tets at the end of a step, without its viscous part.
"""

from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np

from conoid.cases.model.schema import Case
from conoid.cases.outcome import Compressed
from conoid.cases.reading.library import material
from conoid.cases.warnings.compression import bears_all

from ..clock import Clock
from ..kernels.jit import njit, types
from ..model.rows import PRESSURE, S_XX, S_XY, S_YY, S_YZ, S_ZX, S_ZZ
from ..model.state import CHUNK, Block, Floats, Model
from ..parallel.arguments import reader
from ..parallel.comm import Comm
from ..parallel.passes import Pass
from ..parallel.team import TASK, Team

_SXX, _SYY, _SZZ = S_XX * CHUNK, S_YY * CHUNK, S_ZZ * CHUNK
_SYZ, _SZX, _SXY = S_YZ * CHUNK, S_ZX * CHUNK, S_XY * CHUNK
_P = PRESSURE * CHUNK
_MOST = 100
"""Largest number of Newton iterations. Chosen value: in general 6 iterations are enough. If two principal stresses are
nearly equal, each iteration only halves the error, and 30 iterations reduce the error to round-off."""
_ROUNDING = 1e-15
"""Residual of the Newton iteration, divided by the cube of the root, at which the iteration ends: a few last bits of a
float64. The relative error of a double root is then the square root of this value."""
CHUNKS_OF_A_TASK = 16
"""Number of chunks in a task. Chosen value: a task takes at least 10 us, compared with 2 us to start a parallel
region."""
_I, _F, _I1, _F1, _F3 = types.int64, types.float64, types.int64[::1], types.float64[::1], types.float64[:, :, ::1]
_LOOK = _I1, _F1, _F3, _I1, _I, _F, _F
_COUNT = _I1, _F3, _I, _F
_of_look, _of_count = reader(*_LOOK), reader(*_COUNT)


@njit("float64(float64, float64)", cache=True, error_model="numpy")
def _largest_root(j2, j3):  # type: ignore[no-untyped-def]
    """Returns the largest principal value of a deviator with these invariants: the largest root of x^3 - j2 x - j3 = 0,
    by Newton's method from above. The root is at least sqrt(j2 / 3), where the slope is zero, so an iterate below this
    value is replaced by it.
    """
    least = np.sqrt(j2 / 3.0)
    x = 2.0 * least
    for _ in range(_MOST):
        left, slope = (x * x - j2) * x - j3, 3.0 * x * x - j2
        if left <= _ROUNDING * x * x * x or slope <= 0.0:
            break
        x = max(x - left / slope, least)
    return x


@njit("UniTuple(float64, 2)(float64[::1], int64)", cache=True, error_model="numpy")
def principal(s, i):  # type: ignore[no-untyped-def]
    """Returns the largest and the smallest principal pressure of tet ``i`` of a chunk, Pa."""
    xx, yy, zz, yz, zx, xy = s[_SXX + i], s[_SYY + i], s[_SZZ + i], s[_SYZ + i], s[_SZX + i], s[_SXY + i]
    j2 = 0.5 * (xx * xx + yy * yy + zz * zz) + yz * yz + zx * zx + xy * xy
    j3 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    return s[_P + i] + _largest_root(j2, -j3), s[_P + i] - _largest_root(j2, j3)


@njit("float64(float64, float64, float64)", cache=True, error_model="numpy")
def _beyond(s1, s3, strength):  # type: ignore[no-untyped-def]
    """Returns the ratio of Griffith's criterion for the largest principal pressure s1 and the smallest principal
    pressure s3.
    """
    s3 = max(s3, 0.0)
    return (s1 - s3) ** 2 / (8.0 * strength * (s1 + s3)) if s1 > 0.0 else 0.0


@njit("boolean(float64[::1], int64, float64)", cache=True, error_model="numpy", forceinline=True)
def _below(s, i, least):  # type: ignore[no-untyped-def]
    """Returns True if one of two bounds shows that 8 T times the ratio of tet ``i`` of a chunk is below ``least``, Pa,
    with the tensile strength T. The bounds are computed from the invariants of the stress. First, the ratio is at most
    s1 / 8 T, and s1 <= p + 2 r with r = sqrt(J2 / 3). Second, s1 - s3 <= 2 sqrt(J2) and s1 + s3 >= 2 p - r.
    """
    xx, yy, zz, yz, zx, xy = s[_SXX + i], s[_SYY + i], s[_SZZ + i], s[_SYZ + i], s[_SZX + i], s[_SXY + i]
    j2 = 0.5 * (xx * xx + yy * yy + zz * zz) + yz * yz + zx * zx + xy * xy
    r, p = np.sqrt(j2 / 3.0), s[_P + i]
    return (p + 2.0 * r < least) | (4.0 * j2 < least * (2.0 * p - r))


@njit("boolean(float64[::1], int64, float64)", cache=True, error_model="numpy", forceinline=True)
def _above(s, i, least):  # type: ignore[no-untyped-def]
    """Returns True if one of two bounds shows that 8 T times the ratio of tet ``i`` of a chunk is above ``least``, Pa,
    with the tensile strength T. First, s1 - s3 >= sqrt(3 J2) and s1 + s3 <= 2 p + r. Second, s1 >= p + r, even if s3 is
    a tension and counts as zero.
    """
    xx, yy, zz, yz, zx, xy = s[_SXX + i], s[_SYY + i], s[_SZZ + i], s[_SYZ + i], s[_SZX + i], s[_SXY + i]
    j2 = 0.5 * (xx * xx + yy * yy + zz * zz) + yz * yz + zx * zx + xy * xy
    r, p = np.sqrt(j2 / 3.0), s[_P + i]
    return (3.0 * j2 > least * (2.0 * p + r)) & ((p >= 2.0 * r) | (p + r > least))


@njit("int64(float64[::1], int64, float64)", cache=True, error_model="numpy")
def _not_below(s, n, least):  # type: ignore[no-untyped-def]
    """Returns the number of the ``n`` tets of a chunk for which ``_below`` is False. The loop has no branch, so that it
    uses vector instructions.
    """
    some = 0
    for i in range(n):
        some += 0 if _below(s, i, least) else 1
    return some


@njit("Tuple((int64, float64))(float64[:, :, ::1], int64[::1], int64, float64, float64, int64, int64)", cache=True,
      error_model="numpy")  # fmt: skip
def hardest(state, ids, n, strength, known, first, stop):  # type: ignore[no-untyped-def]
    """Returns the place of the tet with the largest ratio, and the ratio. Returns -1 if no ratio is above ``known``. If
    several tets have the same ratio, the tet with the smallest id is returned. Only tets in the chunks from ``first``
    to ``stop`` are checked; ``n``: number of tets of the block.

    Bounds exclude most chunks, and most tets of the remaining chunks.
    """
    place, best = -1, known
    for c in range(first, stop):
        s, here = state[c].reshape(-1), min(CHUNK, n - c * CHUNK)
        if _not_below(s, here, 8.0 * strength * best) == 0:
            continue
        for i in range(here):
            if _below(s, i, 8.0 * strength * best):
                continue
            s1, s3 = principal(s, i)
            share, at = _beyond(s1, s3, strength), c * CHUNK + i
            if share > best or (share == best and place >= 0 and ids[at] < ids[place]):
                place, best = at, share
    return place, best


@njit("UniTuple(int64, 2)(float64[::1], int64, float64)", cache=True, error_model="numpy")
def _decided(s, n, least):  # type: ignore[no-untyped-def]
    """Returns two numbers for a chunk of ``n`` tets: the number of tets that are ``_above``, and the number of tets
    that are neither ``_above`` nor ``_below``.
    """
    above, open_ = 0, 0
    for i in range(n):
        yes, no = _above(s, i, least), _below(s, i, least)
        above += 1 if yes else 0
        open_ += 0 if yes | no else 1
    return above, open_


@njit("int64(float64[:, :, ::1], int64, float64, int64, int64)", cache=True, error_model="numpy")
def crushed(state, n, strength, first, stop):  # type: ignore[no-untyped-def]
    """Returns the number of tets above the criterion, in the chunks from ``first`` to ``stop``. Principal pressures are
    computed only for tets that the bounds do not decide.
    """
    found, least = 0, 8.0 * strength
    for c in range(first, stop):
        s, here = state[c].reshape(-1), min(CHUNK, n - c * CHUNK)
        above, open_ = _decided(s, here, least)
        found += above
        for i in range(here if open_ > 0 else 0):
            if not (_above(s, i, least) | _below(s, i, least)):
                s1, s3 = principal(s, i)
                found += _beyond(s1, s3, strength) > 1.0
    return found


@njit(TASK, cache=True)
def _look(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``hardest`` on the chunks of the task."""
    places, times, state, ids, n, strength, known = _of_look(table)
    k = first // CHUNKS_OF_A_TASK
    places[k], times[k] = hardest(state, ids, n, strength, known, first, stop)


@njit(TASK, cache=True)
def _count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``crushed`` on the chunks of the task."""
    counts, state, n, strength = _of_count(table)
    counts[first // CHUNKS_OF_A_TASK] = crushed(state, n, strength, first, stop)


@dataclass(frozen=True)
class Met:
    """The most compressed tet of a part: ratio to the criterion, principal pressures, Pa, id of the tet, centre of the
    tet, m, and simulated time, s.
    """

    times: float = 0.0
    most: float = 0.0
    least: float = 0.0
    tet: int = -1
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time: float = 0.0


class Crushing:
    """Largest compression so far in each part of a brittle material that has no law of compressive failure. The stored
    values are those of this rank. The methods ``keep`` and ``found`` compute the maximum over the ranks.
    """

    def __init__(self, model: Model, strengths: Floats, comm: Comm, clock: Clock, team: Team) -> None:
        """``strengths`` (parts,): tensile strength, Pa; 0 for other materials; ``team``: threads of the rank."""
        self._model, self._strengths, self._comm, self._clock = model, strengths, comm, clock
        self._looking = Pass(team, _look, *_LOOK, size=CHUNKS_OF_A_TASK)
        self._counting = Pass(team, _count, *_COUNT, size=CHUNKS_OF_A_TASK)
        self._met = [Met() for _ in model.parts]
        self._most = np.zeros(len(model.parts), np.int64)
        """(parts,) largest number of tets above the criterion at one time, so far."""

    @classmethod
    def of(cls, case: Case, model: Model, comm: Comm, clock: Clock, team: Team) -> "Crushing | None":
        """Returns None if no part has a brittle material without a law of compressive failure."""
        made = [material(case, part.material) for part in case.parts]
        strengths = [
            each.brittle.strength if each.brittle and bears_all(each) and part.rigid is None else 0.0
            for each, part in zip(made, case.parts, strict=True)
        ]
        return cls(model, np.array(strengths), comm, clock, team) if any(strengths) else None

    def update(self) -> None:
        """Updates the largest compressions with the present stresses."""
        for block in self._blocks():
            place, times = self._hardest(block, self._met[block.part].times)
            if place >= 0:
                self._met[block.part] = self._of(block, place, times)

    def _blocks(self) -> list[Block]:
        """Blocks of brittle materials that have no law of compressive failure."""
        return [block for block in self._model.blocks if self._strengths[block.part] > 0.0]

    def _hardest(self, block: Block, known: float) -> tuple[int, float]:
        """Returns the result of ``hardest`` for all chunks of a block."""
        chunks, strength = block.chunks, float(self._strengths[block.part])
        places, times = np.empty(self._looking.many(chunks), np.int64), np.empty(self._looking.many(chunks))
        self._looking.run(chunks, places, times, block.state, block.id, block.n, strength, known)
        if (places < 0).all():
            return -1, known
        most = np.flatnonzero((places >= 0) & (times == times.max()))
        best = most[block.id[places[most]].argmin()]
        return int(places[best]), float(times[best])

    def count(self) -> None:
        """Counts the tets that are above the criterion at present. Collective."""
        found = np.zeros(len(self._most), np.int64)
        for block in self._blocks():
            counts = np.zeros(self._counting.many(block.chunks), np.int64)
            self._counting.run(block.chunks, counts, block.state, block.n, float(self._strengths[block.part]))
            found[block.part] = counts.sum()
        self._most = np.maximum(self._most, self._comm.sum(found))

    def _of(self, block: Block, place: int, times: float) -> Met:
        chunk, i = divmod(place, CHUNK)
        corners = self._model.nodes.x[block.tets[place]]
        x, y, z = (0.25 * ((corners[0] + corners[1]) + (corners[2] + corners[3]))).tolist()
        most, least = principal(block.state[chunk].reshape(-1), i)
        return Met(times, most, least, int(block.id[place]), (x, y, z), self._clock.t)

    def _of_all(self) -> list[Met]:
        """Returns the largest compression of each part over all ranks. If two compressions are equal, the earlier one
        is returned. Collective.
        """
        shared = self._comm.share(self._met)
        return [min(found, key=lambda met: (-met.times, met.time, met.tet)) for found in zip(*shared, strict=True)]

    def keep(self) -> tuple[list[tuple[Any, ...]], list[int]]:
        """Returns the state for a checkpoint; it is equal on all ranks. Collective."""
        return [astuple(met) for met in self._of_all()], self._most.tolist()

    def resume(self, known: tuple[list[tuple[Any, ...]], list[int]]) -> None:
        """Restores the state from a checkpoint."""
        self._met = [replace(Met(*met), centre=tuple(met[4])) for met in known[0]]
        self._most = np.array(known[1], np.int64)

    def found(self) -> list[Compressed]:
        """Returns the results of each part of a brittle material that has no law of compressive failure, the largest
        ratio first. Collective.
        """
        met = [
            Compressed(
                part=name, times=each.times, most=each.most, least=each.least, tet=each.tet,
                tets=int(most), x=each.centre[0], y=each.centre[1], z=each.centre[2], time=each.time,
            )
            for name, each, most in zip(self._model.parts, self._of_all(), self._most, strict=True) if each.tet >= 0
        ]  # fmt: skip
        return sorted(met, key=lambda each: (-each.times, each.part))
