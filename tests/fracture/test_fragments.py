"""Fragments: connectivity compared with scipy, mass and motion of the nodes, independence of the number of ranks."""

import itertools
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import stats
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from conoid.cases.output import fragments as tables
from conoid.worker.fracture import connectivity, fragments, numbers
from conoid.worker.mesh.faces import FACES, across
from conoid.worker.model.rows import MASS
from conoid.worker.model.state import Block, Model, Nodes, chunked
from conoid.worker.parallel.comm import Comm, SerialComm

from ..contact.ranks import on_ranks
from ..worker.meshes import block

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
RANKS = (1, 2, 3, 5)


@dataclass
class Body:
    """A whole mesh with its bonds; the last part may have no table of faces."""

    x0: Floats
    x: Floats
    v: Floats
    tets: Ints
    part: Ints
    mass: Floats
    across: Ints
    bond: Ints
    held: Ints
    bare: int = -1
    """Part of a rank whose block has neither faces nor bonds."""
    gone: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """Tets that have eroded, but that the face tables of other tets still name."""

    def rank(self, owner: Ints, rank: int) -> tuple[Model, Ints]:
        """Returns the part of the mesh on each of several ranks; ``owner`` (n,): rank of each tet. Every pair of tets
        is given on one of its ranks.
        """
        mine = np.setdiff1d(np.flatnonzero(owner == rank), self.gone)
        ids = np.unique(self.tets[owner == rank])
        home = np.full(len(self.x), -1, np.int32)
        home[self.tets[::-1].reshape(-1)] = np.repeat(owner[::-1], 4)
        local = np.zeros(len(self.x), np.int64)
        local[ids] = np.arange(len(ids))
        zeros = np.zeros(len(ids))
        nodes = Nodes(
            ids, zeros.astype(np.int32), home[ids], home[ids] == rank, self.x0[ids], self.x[ids], self.v[ids], zeros,
            np.zeros((len(ids), 3), np.int64), zeros,
        )  # fmt: skip
        random = np.random.default_rng(rank)
        chosen = [random.permutation(mine[self.part[mine] == part]) for part in range(self.part.max() + 1)]
        blocks = [self._block(tets, local, part) for part, tets in enumerate(chosen) if len(tets)]
        side = np.arange(len(self.held)) % 2
        return Model(nodes, blocks), self.held[owner[self.held[np.arange(len(side)), side]] == rank]

    def _block(self, tets: Ints, local: Ints, part: int) -> Block:
        state = np.zeros((-(-len(tets) // chunked(np.zeros(1)).shape[1]), MASS + 1, chunked(np.zeros(1)).shape[1]))
        state[:, MASS, :] = chunked(self.mass[tets])
        made = Block(part, len(tets), local[self.tets[tets]].astype(np.uint32), tets, state, 0, 0, np.zeros(0))
        if part != self.bare:
            made.across, made.bond = self.across[tets].astype(np.int32), self.bond[tets].astype(np.uint8)
        return made

    def labels(self) -> Ints:
        """Returns (n,) fragment labels computed by scipy."""
        whole = (self.across >= 0) & ((self.bond == 0) | (self.part == self.bare)[:, None])
        tet, face = np.nonzero(whole)
        pairs = np.vstack([np.column_stack([tet, self.across[tet, face] // 4]), self.held])
        pairs = pairs[~np.isin(pairs, self.gone).any(axis=1)]
        n = len(self.tets)
        _, component = connected_components(coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(n, n)))
        smallest = np.full(component.max() + 1, n)
        np.minimum.at(smallest, component, np.arange(n))
        return np.asarray(smallest[component])


def body(seed: int, cells: tuple[int, int, int] = (5, 4, 3), broken: float = 0.6, parts: int = 1) -> Body:
    """Returns adjacent blocks of 1 mm cells, 1 m from the origin, with randomly broken faces; a tenth of the broken
    faces have a cohesive facet.
    """
    random = np.random.default_rng(seed)
    x0, tets, part = np.zeros((0, 3)), np.zeros((0, 4), np.int64), np.zeros(0, np.int64)
    for index in range(parts):
        mesh = block(cells, 1e-3, seed=seed + index)
        tets = np.vstack([tets, mesh.tets + len(x0)])
        x0 = np.vstack([x0, mesh.points + np.array([0.3, 1.0 + 0.1 * index, -0.7])])
        part = np.append(part, np.full(len(mesh.tets), index))
    behind = across(tets.astype(np.int32)).astype(np.int64)
    bond = np.zeros(behind.shape, np.int64)
    tet, face = np.nonzero(behind >= 0)
    other, its = np.divmod(behind[tet, face], 4)
    state = random.choice([0, 1, 2], size=len(tet), p=[1.0 - broken, 0.2 * broken, 0.8 * broken])
    one = tet < other
    bond[tet[one], face[one]] = bond[other[one], its[one]] = state[one]
    cracks = np.column_stack([tet, other])[one & (state > 0)]
    held = cracks[random.uniform(size=len(cracks)) < 0.1]
    volume = np.linalg.det(x0[tets[:, 1:]] - x0[tets[:, :1]]) / 6.0
    v = np.array([100.0, -20.0, 3.0]) + random.normal(size=x0.shape) * 30.0
    return Body(x0, x0 + random.normal(size=x0.shape) * 5e-5, v, tets, part, volume * 2500.0, behind, bond, held)


def owners(b: Body, ranks: int, seed: int) -> Ints:
    """Returns a random distribution of the tets among ranks; with five ranks one rank has no tets."""
    return np.random.default_rng(seed).integers(0, ranks - (ranks == 5), len(b.tets))


def labels_of(b: Body, owner: Ints, comm: Comm) -> tuple[Model, list[Ints]]:
    model, held = b.rank(owner, comm.rank)
    return model, connectivity.labels(model, held, comm)


def table_of(b: Body, ranks: int = 1, seed: int = 0) -> "np.ndarray":
    def work(comm: Comm) -> "np.ndarray | None":
        return fragments.table(*labels_of(b, owners(b, ranks, seed), comm), comm)

    rows = on_ranks(ranks, work)[0] if ranks > 1 else work(SerialComm())
    assert rows is not None
    return rows


@pytest.mark.parametrize("broken", [0.0, 0.5, 0.7, 0.8, 1.0])
def test_labels_are_those_of_scipy_on_any_number_of_ranks(broken: float) -> None:
    b = body(11, broken=broken, parts=2)
    expected = b.labels()
    for ranks in RANKS:
        owner = owners(b, ranks, ranks)
        found = np.full(len(expected), -1)
        for model, labels in on_ranks(ranks, lambda comm, owner=owner: labels_of(b, owner, comm)):  # type: ignore[misc]
            for piece, label in zip(model.blocks, labels, strict=True):
                found[piece.id] = label
        assert (found == expected).all()
    assert 2 <= len(np.unique(expected)) <= len(expected) - len(b.held) / 2


def test_fragments_are_counted_on_any_number_of_ranks() -> None:
    b = body(12, broken=0.7, parts=3)
    b.bare = 1
    b.held = b.held[b.part[b.held[:, 0]] != 1]
    for ranks in RANKS:
        owner = owners(b, ranks, ranks)

        def work(comm: Comm, owner: Ints = owner) -> int:
            model, labels = labels_of(b, owner, comm)
            return connectivity.count(model, labels, comm)

        assert on_ranks(ranks, work) == [len(np.unique(b.labels()))] * ranks


def test_a_part_without_faces_is_one_fragment() -> None:
    b = body(3, broken=0.8, parts=3)
    b.bare = 1
    b.held = b.held[b.part[b.held[:, 0]] != 1]
    expected = b.labels()
    for ranks in RANKS:
        owner = owners(b, ranks, ranks)
        for model, labels in on_ranks(ranks, lambda comm, owner=owner: labels_of(b, owner, comm)):  # type: ignore[misc]
            for piece, label in zip(model.blocks, labels, strict=True):
                assert (label == expected[piece.id]).all()
    assert len(np.unique(expected[b.part == 1])) == 1


def test_eroded_tets_join_no_fragments() -> None:
    """Faces and pairs that name deleted tets connect no fragments."""
    b = body(29, broken=0.3)
    b.gone = np.random.default_rng(2).choice(len(b.tets), len(b.tets) // 3, replace=False)
    b.held = b.held[~np.isin(b.held, b.gone).all(axis=1)]
    expected = np.delete(b.labels(), b.gone)
    first = table_of(b)
    labels, tets = np.unique(expected, return_counts=True)
    assert first["label"].tolist() == labels.tolist()
    assert first["tets"].tolist() == tets.tolist()
    for ranks in RANKS[1:]:
        assert table_of(b, ranks, 1).tobytes() == first.tobytes()


def test_chains_are_found_in_any_order_of_their_numbers() -> None:
    """The ids of the tets along the chains are shuffled, ascending or descending, or branch from the largest id, which
    are slow cases for union-find.
    """
    n = 3000
    random = np.random.default_rng(0)
    comb = np.concatenate([np.arange(n // 2), np.arange(n // 2, n)[::-1]]).reshape(2, -1).T.reshape(-1)
    for names in (random.permutation(n), np.arange(n), comb, comb[::-1]):
        path = np.column_stack([names[:-1], names[1:]])
        assert (connectivity.components(n, path) == 0).all()
        assert len(np.unique(connectivity.components(n, np.delete(path, [100, 2000], axis=0)))) == 3
    star = np.column_stack([np.full(n - 1, n - 1), np.arange(n - 1)])
    assert (connectivity.components(n, star) == 0).all()


def test_the_table_is_that_of_plain_sums() -> None:
    """The reference is computed for each fragment and each corner, with the same lumped masses."""
    b = body(5)
    labels, rows = b.labels(), table_of(b)
    assert (rows["label"] == np.unique(labels)).all()
    for row in rows:
        tets = np.flatnonzero(labels == row["label"])
        corners = b.tets[tets].reshape(-1)
        m, x, v = np.repeat(b.mass[tets] / 4.0, 4), b.x[corners], b.v[corners]
        centre, velocity = m @ x / m.sum(), m @ v / m.sum()
        r, w = x - centre, v - velocity
        tensor = (m * (r * r).sum(axis=1)).sum() * np.eye(3) - (m * r.T) @ r
        spin = m @ np.cross(r, w)
        size, speed = np.abs(r).max(), np.abs(w).max()
        assert (row["tets"], row["nodes"]) == (len(tets), len(np.unique(corners)))
        assert row["mass"] == pytest.approx(m.sum(), rel=1e-13)
        assert row["centre"] == pytest.approx(centre, rel=1e-13)
        assert row["velocity"] == pytest.approx(velocity, rel=1e-12)
        assert row["angular_momentum"] == pytest.approx(spin, abs=1e-11 * m.sum() * size * speed)
        full = tensor[[0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]]
        assert row["inertia"] == pytest.approx(full, abs=1e-11 * m.sum() * size**2)
        assert row["translation"] == pytest.approx(0.5 * m.sum() * velocity @ velocity, rel=1e-12)
        assert row["rotation"] == pytest.approx(0.5 * spin @ np.linalg.solve(tensor, spin), rel=1e-9)
        assert row["rotation"] + row["deformation"] == pytest.approx(0.5 * m @ (w * w).sum(axis=1), rel=1e-11)
        assert row["low"].tolist() == x.min(axis=0).tolist()
        assert row["high"].tolist() == x.max(axis=0).tolist()
        assert row["extent"] == np.ptp(x, axis=0).max()
        tet, face = np.nonzero(b.bond[tets])
        a, c, d = (b.x0[b.tets[tets[tet], FACES[face, k]]] for k in range(3))
        cracks = 0.5 * np.linalg.norm(np.cross(c - a, d - a), axis=1).sum()
        assert row["new_surface"] == pytest.approx(cracks, rel=1e-12)


def test_fragments_have_the_mass_and_motion_of_the_nodes() -> None:
    """The totals of a body 1 m from the origin agree to 1e-12 of the sum of magnitudes."""
    b = body(7, cells=(8, 6, 5))
    rows = table_of(b, 3)
    mass = np.bincount(b.tets.reshape(-1), np.repeat(b.mass / 4.0, 4), len(b.x))
    angular = np.cross(rows["centre"], rows["mass"][:, None] * rows["velocity"]) + rows["angular_momentum"]
    kinetic = rows["translation"] + rows["rotation"] + rows["deformation"]
    momentum = mass[:, None] * b.v
    for found, of_nodes in (
        (rows["mass"], mass),
        (rows["mass"][:, None] * rows["centre"], mass[:, None] * b.x),
        (rows["mass"][:, None] * rows["velocity"], momentum),
        (angular, np.cross(b.x, momentum)),
        (kinetic, 0.5 * (momentum * b.v).sum(axis=1)),
    ):
        error = np.abs(found.sum(axis=0) - of_nodes.sum(axis=0)).max()
        assert error < 1e-12 * np.abs(of_nodes).sum()


def test_the_table_has_the_same_bits_on_any_number_of_ranks(tmp_path: Path) -> None:
    b = body(13, cells=(7, 5, 4), broken=0.62, parts=2)
    first = table_of(b)
    assert first["tets"].max() > 50
    assert len(first) > 30
    written = (tmp_path / fragments.write(tmp_path, 3, 1.5e-6, ["rod", "plate"], first)).read_bytes()
    for ranks, seed in itertools.product(RANKS[1:], range(3)):
        rows = table_of(b, ranks, seed)
        assert rows.tobytes() == first.tobytes()
        assert (tmp_path / fragments.write(tmp_path, 3, 1.5e-6, ["rod", "plate"], rows)).read_bytes() == written


def test_plain_sums_would_not_have_the_same_bits() -> None:
    """Control: the momentum of the largest fragment, summed in floating point rank by rank, depends on the ranks."""
    b = body(13, cells=(7, 5, 4), broken=0.62)
    labels = b.labels()
    largest = np.flatnonzero(labels == np.bincount(labels).argmax())
    term = b.mass[largest] * b.v[b.tets[largest]].mean(axis=1)[:, 0]
    found = set()
    for ranks in RANKS:
        owner = owners(b, ranks, 0)[largest]
        found.add(sum(float(term[owner == rank].cumsum()[-1]) for rank in range(ranks) if (owner == rank).any()))
    assert len(found) > 1


def test_a_small_fragment_keeps_its_digits_beside_a_large_one() -> None:
    """A fragment of 1e-5 of the size, with 1e-25 of the inertia of the other fragment, has the same digits as without
    the large fragment.
    """
    large, small = body(1, cells=(3, 3, 3), broken=0.0), body(2, cells=(1, 1, 1), broken=0.0)
    place = np.array([0.3, 1.0, -0.7])
    for points in (small.x0, small.x):
        points[:] = (points - place) * 1e-5
    small.mass = small.mass * 1e-15
    behind = np.where(small.across >= 0, small.across + 4 * len(large.tets), -1)
    both = Body(
        np.vstack([large.x0, small.x0]), np.vstack([large.x, small.x]), np.vstack([large.v, small.v]),
        np.vstack([large.tets, small.tets + len(large.x)]), np.append(large.part, small.part),
        np.append(large.mass, small.mass), np.vstack([large.across, behind]), np.vstack([large.bond, small.bond]),
        np.zeros((0, 2), np.int64),
    )  # fmt: skip
    alone, beside = table_of(small)[0], table_of(both, 2)[1]
    for name in ("mass", "centre", "velocity", "angular_momentum", "inertia", "rotation"):
        assert beside[name].tolist() == alone[name].tolist()


def test_a_spinning_block_has_the_momentum_and_energy_of_its_lumped_masses() -> None:
    """The block has cubes of edge h with six tets each. The four nodes on a side of a cube have half of its mass, so
    that m h^2 / 12 of a solid cube becomes m h^2 / 4. Four thirds of the mass of a corner lie along the diagonal, so
    that the product of inertia is m h^2 / 12.
    """
    n, h, rho = (6, 4, 2), 2e-3, 2500.0
    mesh = block(n, h, shake=0.0)
    a, b, c = (h * k for k in n)
    mass = rho * a * b * c
    spin, drift, centre = np.array([3e3, -1e3, 2e3]), np.array([50.0, 0.0, -7.0]), np.array([a, b, c]) / 2.0
    place = np.array([10.0, -3.0, 1.0])
    tets = mesh.tets.astype(np.int64)
    whole = Body(
        mesh.points, mesh.points + place, drift + np.cross(spin, mesh.points - centre), tets,
        np.zeros(len(tets), np.int64), np.full(len(tets), mass / len(tets)), across(mesh.tets).astype(np.int64),
        np.zeros((len(tets), 4), np.int64), np.zeros((0, 2), np.int64),
    )  # fmt: skip
    (row,) = table_of(whole, 3)
    diagonal = [(b * b + c * c) / 12, (c * c + a * a) / 12, (a * a + b * b) / 12]
    tensor = mass * (np.diag(diagonal) + h * h / 3 * np.eye(3) - h * h / 12 * (1.0 - np.eye(3)))
    assert row["mass"] == pytest.approx(mass, rel=1e-13)
    assert row["centre"] == pytest.approx(centre + place, rel=1e-14)
    assert row["velocity"] == pytest.approx(drift, abs=1e-12 * 50.0)
    assert row["inertia"] == pytest.approx(tensor[[0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]], rel=1e-11)
    assert row["angular_momentum"] == pytest.approx(tensor @ spin, rel=1e-11)
    assert row["rotation"] == pytest.approx(0.5 * spin @ tensor @ spin, rel=1e-11)
    assert row["translation"] == pytest.approx(0.5 * mass * drift @ drift, rel=1e-12)
    assert abs(row["deformation"]) < 1e-11 * row["rotation"]
    assert row["extent"] == pytest.approx(a, rel=1e-12)
    assert row["new_surface"] == 0.0


def test_the_largest_piece_of_a_fragment_keeps_its_number() -> None:
    """Faces break and tets erode, four times. The fragments are those of a plain search, for any number of ranks."""
    b, random, gone = body(17, broken=0.3), np.random.default_rng(1), np.zeros(0, np.int64)
    known, following = np.full(len(b.tets), numbers.UNKNOWN), 0
    for _ in range(4):
        stays = np.setdiff1d(np.arange(len(b.tets)), gone)
        labels = b.labels()
        expected, rows = plainly_numbered(known[stays], labels[stays], following)
        for ranks in RANKS:
            owner = owners(b, ranks, 4)

            def work(
                comm: Comm, of: Ints = owner[stays], stays: Ints = stays, first: int = following
            ) -> tuple[Any, ...]:
                mine = stays[of == comm.rank][::-1]
                found, family = numbers.numbered(known[mine], b.labels()[mine], first, comm)
                return mine, found, family.tolist()

            got = np.full(len(b.tets), numbers.UNKNOWN)
            for mine, found, family in on_ranks(ranks, work):
                got[mine] = found
                assert family == rows
            assert (got[stays] == expected).all()
        known[stays], following = expected, max(following, int(expected.max()) + 1)
        tet, face = np.nonzero((b.across >= 0) & (b.bond == 0))
        chosen = random.uniform(size=len(tet)) < 0.2
        for t, f in zip(tet[chosen], face[chosen], strict=True):
            other, its = divmod(int(b.across[t, f]), 4)
            b.bond[t, f] = b.bond[other, its] = 2
        gone = np.union1d(gone, random.choice(stays, 5, replace=False))
    assert following > len(np.unique(known[stays])) > 20


def plainly_numbered(before: Ints, labels: Ints, following: int) -> tuple[Ints, list[list[int]]]:
    """Reference of ``numbers.numbered``, computed with dictionaries."""
    common: dict[tuple[int, int], int] = {}
    for key in zip(before.tolist(), labels.tolist(), strict=True):
        common[key] = common.get(key, 0) + 1
    named: dict[int, int] = {}
    for old in {old for old, _ in common if old >= 0}:
        named[min(((-tets, label) for (was, label), tets in common.items() if was == old))[1]] = old
    for label in sorted({label for _, label in common} - set(named)):
        named[label] = following
        following += 1
    rows = sorted([old, named[label], tets] for (old, label), tets in common.items())
    return np.array([named[label] for label in labels.tolist()]), rows


@pytest.mark.parametrize("ranks", [1, 3])
def test_the_part_of_a_fragment_does_not_follow_from_its_number(ranks: int) -> None:
    """The number of a fragment does not determine the order of the parts: here the numbers decrease while the ids of
    the tets increase.
    """
    b = body(5, parts=3)
    of_tet, last = b.labels(), len(b.tets) + 1000

    def work(comm: Comm) -> "np.ndarray | None":
        model, labels = labels_of(b, owners(b, ranks, 4), comm)
        return fragments.table(model, [last - each for each in labels], comm)

    rows = on_ranks(ranks, work)[0] if ranks > 1 else work(SerialComm())
    assert rows is not None
    smallest = last - rows["label"]
    assert set(smallest.tolist()) == set(of_tet.tolist())
    assert rows["part"].tolist() == b.part[smallest].tolist()
    assert len(set(rows["part"].tolist())) == 3


def test_a_table_reads_back_to_the_same_bits(tmp_path: Path) -> None:
    rows = table_of(body(19))
    path = tmp_path / fragments.write(tmp_path, 12, 1.25e-6, ["plate"], rows)
    assert path == tables.path(tmp_path, 12)
    assert path.name == "fragments_0012.csv"
    assert [p.name for p in path.parent.iterdir()] == [path.name]
    lines = tables.read(path)
    assert len(lines) == len(rows)
    for line, row in zip(lines, rows, strict=True):
        assert line["t"] == 1.25e-6
        assert line["part"] == "plate"
        assert (line["label"], line["nodes"], line["mass"]) == (row["label"], row["nodes"], row["mass"])
        assert [line[f"velocity_{i}"] for i in "xyz"] == row["velocity"].tolist()
        assert [line[f"inertia_{ij}"] for ij in ("xx", "yy", "zz", "yz", "zx", "xy")] == row["inertia"].tolist()
        assert line["new_surface"] == row["new_surface"]
    with pytest.raises(ValueError, match="not a table of fragments"):
        tables.read(_other(tmp_path))


def _other(folder: Path) -> Path:
    (folder / "history.csv").write_text("step,t\n")
    return folder / "history.csv"


def test_likelihoods_of_laws_equal_those_of_scipy() -> None:
    values = np.random.default_rng(3).exponential(2e-3, 500) + 1e-5
    rayleigh, exponential, power = tables.fits(values.tolist())
    for fit, law in (
        (rayleigh, stats.rayleigh(scale=rayleigh.parameter)),
        (exponential, stats.expon(scale=exponential.parameter)),
        (power, stats.pareto(power.parameter - 1.0, scale=values.min())),
    ):
        assert fit.log_likelihood == pytest.approx(float(law.logpdf(values).sum()), rel=1e-10)
    _, scale = stats.rayleigh.fit(values, floc=0.0)
    assert rayleigh.parameter == pytest.approx(scale, rel=1e-6)
    shape, _, _ = stats.pareto.fit(values, floc=0.0, fscale=values.min())
    assert power.parameter == pytest.approx(shape + 1.0, rel=1e-6)


@pytest.mark.parametrize("law", ["rayleigh", "exponential", "power"])
def test_the_likeliest_law_is_the_one_that_made_the_values(law: str) -> None:
    random = np.random.default_rng(4)
    parameter, values = {
        "rayleigh": (3e-3, random.rayleigh(3e-3, 2000)),
        "exponential": (3e-3, random.exponential(3e-3, 2000)),
        "power": (2.5, 1e-4 * (1.0 + random.pareto(1.5, 2000))),
    }[law]
    best = max(tables.fits(values.tolist()), key=lambda fit: fit.log_likelihood)
    assert best.law == law
    assert best.parameter == pytest.approx(parameter, rel=4.0 / math.sqrt(2000))


def test_a_summary_keeps_dust_apart() -> None:
    tets, masses, extents = [100, 9, 10, 1, 50], [5.0, 0.5, 1.0, 0.25, 3.25], [5.0, 0.1, 1.0, 0.05, 3.0]
    found = tables.summary(tets, masses, extents)
    assert (found.fragments, found.dust) == (3, 2)
    assert (found.dust_share, found.largest_share) == (0.075, 0.5)
    assert found.sizes == tables.fits([5.0, 1.0, 3.0])
    assert found.masses == tables.fits([5.0, 1.0, 3.25])
    empty = tables.summary([], [], [])
    assert (empty.fragments, empty.dust, empty.largest_share, empty.sizes) == (0, 0, 0.0, [])
