"""Snapshots contain the model: the test reads snapshots with numpy only, by the layout in cases/output/snapshot.py."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from conoid.cases.output import snapshot
from conoid.worker.snapshots import blob, table
from conoid.worker.snapshots.blob import Budget
from conoid.worker.snapshots.share import joined

from .shattered import PARTS, Shattered, shattered
from .unpacked import STAMP, arrays, made


def places(data: bytes) -> np.ndarray:
    """Returns the positions of the vertices, m."""
    low, high = np.array(snapshot.header_of(data).box)
    return np.asarray(low + arrays(data)["positions"] / 65535.0 * (high - low))


def pieces(body: Shattered) -> np.ndarray:
    """Returns (tets,) the number of the fragment of each tet, computed by scipy, in the order of the smallest tets of
    the fragments."""
    tet, face = np.nonzero((body.across >= 0) & (body.bond == 0))
    graph = coo_array((np.ones(len(tet)), (tet, body.across[tet, face] // 4)), shape=(len(body.tets),) * 2)
    _, of = connected_components(graph)
    return np.unique(np.unique(of, return_index=True)[1][of], return_inverse=True)[1]


def test_positions_are_those_of_the_nodes_to_half_a_step_of_the_box() -> None:
    body = shattered(4, 5)
    data = made(body).data
    low, high = np.array(snapshot.header_of(data).box)
    nearest = np.abs(places(data)[:, None] - body.x[None]).max(axis=2).min(axis=1)
    assert (nearest <= 0.5001 * (high - low).max() / 65535.0).all()


def test_the_table_is_what_numpy_sums() -> None:
    body = shattered(4, 5)
    data, label = made(body).data, pieces(body)
    got, header = arrays(data), snapshot.header_of(data)
    assert header.fragments_total == header.fragments_listed == len(np.unique(label)) == len(got["fragment_id"])
    assert (np.diff(got["fragment_mass"]) <= 0.0).all()
    for row, name in enumerate(got["fragment_id"]):
        mine = label == name
        x, v = body.x[body.tets[mine]].mean(axis=1), body.v[body.tets[mine]].mean(axis=1)
        mass = body.mass[mine]
        assert got["fragment_tets"][row] == mine.sum()
        assert got["fragment_mass"][row] == pytest.approx(mass.sum(), rel=1e-14)
        assert got["fragment_centre"][row] == pytest.approx(np.average(x, axis=0, weights=mass), rel=1e-6)
        assert got["fragment_velocity"][row] == pytest.approx(np.average(v, axis=0, weights=mass), rel=1e-5)
        assert got["fragment_size"][row] == pytest.approx(np.ptp(body.x[body.tets[mine]].reshape(-1, 3), axis=0).max())
        assert got["fragment_birth"][row] == pytest.approx(1e-6 * name)


def test_the_outline_of_every_fragment_is_closed_and_its_own() -> None:
    """Each edge of the surface has a second edge with the opposite direction; the volume inside of the surface is that
    of the tets.
    """
    body = shattered(5, 8)
    data, label = made(body).data, pieces(body)
    got, at = arrays(data), places(data)
    owner = got["vertex_fragment"][got["triangles"]]
    assert (owner == owner[:, :1]).all()
    edges = got["triangles"][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    words = np.sort(edges[:, 0] << 32 | edges[:, 1])
    assert np.array_equal(words, np.sort(edges[:, 1] << 32 | edges[:, 0]))
    a, b, c = (at[got["triangles"][:, k]] for k in range(3))
    volume = np.bincount(owner[:, 0], np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0)
    e = body.x[body.tets[:, 1:]] - body.x[body.tets[:, :1]]
    of = np.searchsorted(np.unique(label), label)
    inside = np.bincount(of, np.linalg.det(e) / 6.0)
    row = np.searchsorted(np.unique(label), got["fragment_id"])
    assert volume == pytest.approx(inside[row], rel=1e-2)


def test_fields_are_right_to_half_a_level() -> None:
    body = shattered(3, 4)
    data = made(body).data
    header, got = snapshot.header_of(data), arrays(data)
    assert set(header.fields) == {"speed", "plastic_strain", "broken_faces"}
    field = header.fields["plastic_strain"]
    levels = field.low + got["field:plastic_strain"] / 255.0 * (field.high - field.low)
    second = got["triangle_part"] == 1
    assert (levels[~second] <= 0.5001 * (field.high - field.low) / 255.0).all()
    half = 0.5001 * (field.high - field.low) / 255.0
    known = np.sort(body.strain[body.part == 1])
    near = np.clip(np.searchsorted(known, levels[second]), 1, len(known) - 1)
    off = np.minimum(np.abs(known[near] - levels[second]), np.abs(known[near - 1] - levels[second]))
    assert (off <= half).all()


@pytest.mark.parametrize("budget", [Budget(), Budget(triangles=600), Budget(bytes=60_000)], ids=str)
def test_any_number_of_ranks_makes_the_same_bytes_but_for_their_numbers(budget: Budget) -> None:
    body = shattered(6, 30)
    one = made(body, 1, budget)
    for ranks in (2, 3, 7):
        other = made(body, ranks, budget)
        mine, theirs = arrays(one.data), arrays(other.data)
        assert mine.keys() == theirs.keys()
        for name in mine.keys() - {"triangle_rank"}:
            assert np.array_equal(mine[name], theirs[name]), name
        assert set(np.unique(theirs["triangle_rank"])) <= set(range(ranks))
        heads = [snapshot.header_of(blob.data) for blob in (one, other)]
        fields = [{**vars_of(head), "ranks": 0, "arrays": 0} for head in heads]
        assert fields[0] == fields[1]
        assert (one.sizes, one.smallest, one.fragments) == (other.sizes, other.smallest, other.fragments)


def vars_of(head: snapshot.Header) -> dict[str, object]:
    return {name: getattr(head, name) for name in head.__struct_fields__}


@pytest.mark.parametrize(
    "budget", [Budget(triangles=2000), Budget(triangles=700), Budget(triangles=60), Budget(bytes=40_000)], ids=str
)
def test_a_budget_is_kept_and_nothing_is_wasted(budget: Budget) -> None:
    body = shattered(7, 25)
    full, got = made(body), made(body, 1, budget)
    assert got.triangles <= budget.triangles
    assert len(got.data) <= budget.bytes
    assert got.triangles < full.triangles
    header = snapshot.header_of(got.data)
    assert header.surface_triangles == full.triangles
    assert header.fragments_total == full.fragments
    assert np.array_equal(arrays(got.data)["fragment_mass"], arrays(full.data)["fragment_mass"])
    if budget.triangles >= 700:
        assert got.triangles >= 0.5 * budget.triangles or len(got.data) >= 0.5 * budget.bytes


def test_merged_points_keep_their_place_and_every_fragment_stays_visible() -> None:
    body = shattered(8, 20)
    full, got = made(body), made(body, 1, Budget(triangles=1500))
    drawn = np.unique(arrays(got.data)["vertex_fragment"])
    assert len(drawn) == snapshot.header_of(full.data).fragments_total
    at, of = places(got.data), arrays(got.data)["vertex_fragment"]
    before, was = places(full.data), arrays(full.data)["vertex_fragment"]
    for row in drawn:
        low, high = before[was == row].min(axis=0), before[was == row].max(axis=0)
        slack = 0.5 * (high - low).max()
        assert (at[of == row] >= low - 1e-6).all()
        assert (at[of == row] <= high + 1e-6).all()
        assert (at[of == row].min(axis=0) <= low + slack).all()


def test_fragments_beyond_the_rows_are_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    body = shattered(5, 30)
    full = arrays(made(body).data)
    monkeypatch.setattr(table, "MOST_ROWS", 10)
    data = made(body).data
    got, header = arrays(data), snapshot.header_of(data)
    assert header.fragments_listed == 10
    assert len(got["fragment_id"]) == 11
    assert got["fragment_id"][-1] == snapshot.REST
    assert got["fragment_mass"].sum() == pytest.approx(full["fragment_mass"].sum(), rel=1e-14)
    assert got["fragment_tets"].sum() == len(body.tets)
    momentum = (full["fragment_mass"][:, None] * full["fragment_velocity"]).sum(axis=0)
    assert (got["fragment_mass"][:, None] * got["fragment_velocity"]).sum(axis=0) == pytest.approx(momentum, rel=1e-4)
    assert got["vertex_fragment"].max() == 10


def test_sizes_count_every_fragment_by_its_longest_side() -> None:
    body = shattered(5, 12)
    one = made(body)
    size = arrays(one.data)["fragment_size"].astype(float)
    edges = 2.0 ** ((one.smallest + np.arange(len(one.sizes) + 1)) / 2.0)
    assert one.sizes == np.histogram(size, edges)[0].tolist()
    assert sum(one.sizes) == one.fragments


def test_closed_cracks_within_a_fragment_are_not_drawn_and_open_ones_are() -> None:
    body = shattered(3, 1)
    tet, face = next(zip(*np.nonzero(body.across >= 0), strict=True))
    other, behind = divmod(int(body.across[tet, face]), 4)
    bond = body.bond.copy()
    bond[tet, face] = bond[other, behind] = 1
    closed = made(replace(body, bond=bond))
    bond[tet, face] = bond[other, behind] = 2
    opened = made(replace(body, bond=bond))
    assert closed.triangles == made(body).triangles == opened.triangles - 2


def test_no_tets_are_a_snapshot_too() -> None:
    body = shattered(2, 2)
    share = body.shares(1)[0]
    for name, values in share.items():
        share[name] = values[:0] if not name.endswith(".part") and name != "numbers" else values
    data = blob.made(joined([share], PARTS), {**STAMP, "ranks": 1}, lambda labels: np.zeros(len(labels)), Budget()).data
    assert snapshot.header_of(data).fragments_total == 0
    assert len(arrays(data)["triangles"]) == 0


@pytest.mark.parametrize(
    "harm", [lambda d: d[:-8], lambda d: b"X" + d[1:], lambda d: d[:8] + b"\2" + d[9:], lambda d: d[:40]]
)
def test_a_damaged_snapshot_is_refused(harm) -> None:  # type: ignore[no-untyped-def]
    data = made(shattered(2, 2)).data
    with pytest.raises(ValueError, match="snapshot"):
        snapshot.header_of(harm(data))


def test_views_need_no_numpy() -> None:
    data = made(shattered(2, 2)).data
    header, got = snapshot.header_of(data), arrays(data)
    for name, array in header.arrays.items():
        assert array.offset % 8 == 0
        assert list(snapshot.view(data, array)) == got[name].reshape(-1).tolist()


def test_where_erosion_alone_parts_bodies_the_largest_piece_is_the_part() -> None:
    """The largest piece keeps the number of the part when other pieces separate or vanish; each other piece has the
    number of its first tet."""
    body = shattered(5, 9)
    label, whole = pieces(body), replace(body.whole(1), initial=0)
    data = blob.made(whole, {**STAMP, "ranks": 1}, lambda numbers: np.zeros(len(numbers)), Budget()).data
    got = arrays(data)
    expected = set()
    for part in (0, 1):
        names, tets = np.unique(label[body.part == part], return_counts=True)
        first = {name: int(np.flatnonzero(label == name)[0]) for name in names}
        largest = min(names, key=lambda name: (-tets[list(names).index(name)], first[name]))
        expected |= {(part, int(tets.max()))}
        expected |= {(len(PARTS) + first[name], int(n)) for name, n in zip(names, tets, strict=True) if name != largest}
    assert set(zip(got["fragment_id"].tolist(), got["fragment_tets"].tolist(), strict=True)) == expected
