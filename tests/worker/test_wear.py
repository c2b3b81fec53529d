"""Marks of tets to be removed, unchanged state of all other tets, and sums of a whole run."""

from fractions import Fraction
from functools import partial

import numpy as np
import pytest

from conoid.cases.model import schema
from conoid.worker import step
from conoid.worker.elements import scratch, wear
from conoid.worker.model import rows
from conoid.worker.model.state import CHUNK, Block
from conoid.worker.parallel.comm import Comm, SerialComm
from conoid.worker.parallel.fixed_point import Tally

from ..contact.bodies import meeting_of, moved
from ..contact.ranks import on_ranks
from .kernels import build
from .meshes import Floats, block

MM = 1e-3
# Marked tets


LIFE = np.array([0.5, 0.2, 3.0, 2e6, 1.0])
VOLUME, FREQUENCY = 1e-9, 1e6


def differ(one: Floats, two: Floats) -> "np.ndarray":
    """Returns the places at which the bit patterns differ."""
    return np.asarray(one.view(np.int64) != two.view(np.int64))


class Chunk:
    """Seven intact tets after the pass over the elements; the tet in the middle is damaged."""

    def __init__(self, count: int = rows.TEMPERATURE + 1) -> None:
        self.n, self.rows = 7, count
        random = np.random.default_rng(7)
        self.w, self.s = random.normal(size=scratch.SCRATCH), random.normal(size=(count, CHUNK))
        self.w[scratch.VOLUME : scratch.VOLUME + CHUNK] = VOLUME
        self.w[scratch.LIMIT : scratch.LIMIT + CHUNK] = FREQUENCY
        self.params = np.array([8000.0])
        self.s[rows.MASS] = 8000.0 * VOLUME
        if count > rows.PLASTIC_STRAIN:
            self.s[rows.PLASTIC_STRAIN] = 0.1
        self.worn = np.zeros(self.n, bool)

    def mark(self) -> int:
        self.w_then, self.s_then = self.w.copy(), self.s.copy()
        s = self.s.reshape(-1)
        return int(wear.mark_worn(self.worn, self.w, s, self.params, LIFE, self.rows, self.n))

    def changed(self) -> tuple[list[int], list[tuple[int, int]]]:
        """Returns the places of the scratch, and (row, tet) of the state, that the call has changed."""
        w = np.flatnonzero(differ(self.w, self.w_then))
        places, tets = np.nonzero(differ(self.s, self.s_then))
        return w.tolist(), list(zip(places.tolist(), tets.tolist(), strict=True))


def test_a_sound_chunk_is_left_alone() -> None:
    chunk = Chunk()
    chunk.s[rows.PLASTIC_STRAIN] = LIFE[wear.STRAIN]
    chunk.w[scratch.LIMIT : scratch.LIMIT + CHUNK] = LIFE[wear.FREQUENCY]
    assert chunk.mark() == wear.SOUND
    assert not chunk.worn.any()
    assert chunk.changed() == ([], [])


def test_a_tet_that_has_strained_enough_is_tired_and_keeps_what_it_has() -> None:
    chunk = Chunk()
    chunk.s[rows.PLASTIC_STRAIN, 3] = 0.5001
    assert chunk.mark() == wear.TIRED
    assert np.flatnonzero(chunk.worn).tolist() == [3]
    assert chunk.changed() == ([], [])


@pytest.mark.parametrize(("row", "value"), [
    (scratch.VOLUME, 0.199 * VOLUME), (scratch.VOLUME, 3.001 * VOLUME), (scratch.LIMIT, 2.001e6),
])  # fmt: skip
def test_a_flat_or_swollen_or_stiff_tet_is_broken_and_limits_the_step_no_more(row: int, value: float) -> None:
    chunk = Chunk()
    chunk.w[row + 3] = value
    chunk.s[rows.PLASTIC_STRAIN, 5] = 0.6
    assert chunk.mark() == wear.BROKEN
    assert np.flatnonzero(chunk.worn).tolist() == [3, 5]
    assert chunk.changed() == ([scratch.LIMIT + 3], [])
    assert chunk.w[scratch.LIMIT + 3] == 0.0


@pytest.mark.parametrize("count", [rows.VOLUME_FLUX, rows.TEMPERATURE + 1])
@pytest.mark.parametrize("value", [-0.5, 0.0])
def test_an_inverted_tet_is_broken_and_carries_no_stress(value: float, count: int) -> None:
    chunk = Chunk(count)
    chunk.w[scratch.VOLUME + 3] = value * VOLUME
    chunk.w[scratch.LIMIT + 3] = np.nan
    assert chunk.mark() == wear.BROKEN
    assert np.flatnonzero(chunk.worn).tolist() == [3]
    assert (chunk.s[: rows.VISCOUS + 1, 3] == 0.0).all()
    w, s = chunk.changed()
    assert w == [scratch.LIMIT + 3]
    assert chunk.w[scratch.LIMIT + 3] == 0.0
    assert {tet for _, tet in s} == {3}
    assert {row for row, _ in s} <= {*range(rows.VISCOUS + 1)}


@pytest.mark.parametrize("volume", [1.0, -0.5])
@pytest.mark.parametrize(
    ("row", "value"), [*((row, np.nan) for row in range(8)), (6, -np.inf), (rows.WORK, np.nan), (-1, np.nan)]
)
def test_a_nan_is_kept_and_ends_the_run(row: int, value: float, volume: float) -> None:
    """The limit of the step becomes NaN: step.py stops the run and names the tet. No NaN is replaced by zero."""
    chunk = Chunk()
    chunk.w[scratch.VOLUME + 3] = volume * VOLUME if row >= 0 else np.nan
    if row >= 0:
        chunk.s[row, 3] = value
    assert chunk.mark() == wear.SOUND
    assert not chunk.worn.any()
    assert np.isnan(chunk.w[scratch.LIMIT + 3])
    assert row < 0 or not np.isfinite(chunk.s[row, 3])
    assert {place for place, _ in chunk.changed()[1]} <= {row}


def test_a_block_without_plastic_strain_wears_by_its_shape_only() -> None:
    chunk = Chunk(rows.VOLUME_FLUX)
    assert chunk.mark() == wear.SOUND
    chunk.w[scratch.VOLUME + 6] = 4.0 * VOLUME
    assert chunk.mark() == wear.BROKEN
    assert np.flatnonzero(chunk.worn).tolist() == [6]


def test_a_part_exists_as_its_case_defines() -> None:
    spec = schema.Erosion(plastic_strain=1.5, volume=(0.3, 4.0), time_step=0.1)
    small = moved(block((2, 2, 2), 0.1 * MM), (9.0, 0.0, 0.0))
    sim = build(meeting_of([{"erosion": spec}, {}]), [block((2, 2, 2), MM), small])
    step.prepare(sim)
    assert not len(sim.model.blocks[1].worn)
    assert sim.model.blocks[0].life.tolist() == [1.5, 0.3, 4.0, sim.reduction.limit / 0.1, np.inf]
    assert wear.life(schema.Erosion())[wear.STRAIN] == np.inf


# Removal of tets from blocks


def random_block(n: int, random: np.random.Generator, contact: bool = True) -> Block:
    values = random.normal(size=(-(-n // CHUNK), 12, CHUNK))
    return Block(
        part=0, n=n, tets=random.integers(0, 99, (n, 4)).astype(np.uint32), id=random.permutation(5 * n)[:n],
        state=values, kind=0, eos=0, params=np.zeros(1), border_chunks=2, worn=random.random(n) < 0.5,
        across=random.integers(-1, 99, (n if contact else 0, 4)).astype(np.int32),
    )  # fmt: skip


@pytest.mark.parametrize("contact", [True, False])
@pytest.mark.parametrize("seed", range(20))
def test_a_block_keeps_exactly_the_tets_that_stay(seed: int, contact: bool) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 4 * CHUNK))
    body = random_block(n, random, contact)
    while body.n:
        then = {int(i): k for k, i in enumerate(body.id)}
        before = (body.tets.copy(), body.across.copy(), body.worn.copy(), [body.row(row) for row in range(12)])
        border = set(body.id[: body.border_chunks * CHUNK].tolist())
        gone = np.flatnonzero(random.random(body.n) < random.choice([0.0, 0.01, 0.5, 0.9, 1.0]))
        lost = set(body.id[gone].tolist())
        body.drop(gone)
        assert set(body.id.tolist()) == set(then) - lost
        assert body.n == len(body.id) == len(body.tets) == len(body.worn) == len(then) - len(lost)
        at = np.array([then[int(i)] for i in body.id], np.int64)
        assert (body.tets == before[0][at]).all()
        assert (body.across == before[1][at]).all() if contact else body.across.shape == (0, 4)
        assert (body.worn == before[2][at]).all()
        assert all((body.row(row) == before[3][row][at]).all() for row in range(12))
        assert border - lost <= set(body.id[: body.border_chunks * CHUNK].tolist())
        assert body.border_chunks <= body.chunks
        assert body.tets.flags.c_contiguous


# Sums of a whole run


def tallied(largest: Floats, rows: Floats, comm: Comm) -> Floats:
    """Returns the sums over all ranks; each row is added separately on one rank."""
    tally = Tally(largest)
    for row in rows[comm.rank :: comm.size]:
        tally.add(row[None, :])
    return tally.total(comm)


def test_a_tally_depends_neither_on_order_nor_on_ranks() -> None:
    random = np.random.default_rng(3)
    largest = np.array([3.7, 2e-9, 5e12])
    values = random.uniform(-1.0, 1.0, (400, 3)) * largest * 10.0 ** random.uniform(-12.0, 0.0, (400, 3))
    whole = Tally(largest)
    whole.add(values)
    total = whole.total(SerialComm())
    for ranks in (1, 2, 5):
        rows = values[random.permutation(len(values))]
        found = on_ranks(ranks, partial(tallied, largest, rows))
        assert {sums.tobytes() for sums in found} == {total.tobytes()}
    for k in range(3):
        exact = sum(map(Fraction, values[:, k].tolist()), Fraction(0))
        off = abs(Fraction(float(total[k])) - exact)
        assert off <= Fraction(1e-15) * Fraction(float(largest[k])) + Fraction(abs(float(total[k])) * 2.0**-53)


def test_a_tally_of_nothing_is_zero() -> None:
    tally = Tally(np.array([1.0, 2.0]))
    tally.add(np.zeros((0, 2)))
    assert tally.total(SerialComm()).tolist() == [0.0, 0.0]
