"""All tets of a snapshot in few bytes: the test reads the tets with numpy only and compares them with the model."""

import gzip

import numpy as np
import pytest

from conoid.cases.output import snapshot
from conoid.worker.snapshots import blob, invariants, volume
from conoid.worker.snapshots.blob import Made

from .shattered import Shattered, shattered
from .unpacked import arrays, made


def tets_of(body: Shattered, ranks: int = 1) -> bytes:
    return gzip.decompress(made(body, ranks).tets)


def corners(data: bytes) -> np.ndarray:
    """Returns (n, 4) the nodes of the tets."""
    planes = arrays(data)["tet_steps"].astype(np.uint32)
    change = (planes[0] | planes[1] << 8 | planes[2] << 16 | planes[3] << 24).astype(np.int32).T.astype(np.int64)
    change[:, 0] = np.cumsum(change[:, 0])
    return np.cumsum(change, axis=1)


def test_tets_have_their_places_parts_fragments_and_fields() -> None:
    body = shattered(4, 6)
    data, whole = tets_of(body), made(body).data
    got, header = arrays(data), snapshot.header_of(data)
    assert header.box == snapshot.header_of(whole).box
    low, high = np.array(header.box)
    centres = (low + got["positions"] / 65535.0 * (high - low))[corners(data)].mean(axis=1)
    known = body.x[body.tets].mean(axis=1)
    which = np.abs(centres[:, None] - known[None]).max(axis=2).argmin(axis=1)
    assert np.array_equal(np.sort(which), np.arange(len(body.tets)))
    assert np.abs(centres - known[which]).max() <= 0.51 * (high - low).max() / 65535.0
    assert np.array_equal(got["tet_part"], body.part[which])
    field = header.fields["plastic_strain"]
    found = field.low + got["field:plastic_strain"] / 255.0 * (field.high - field.low)
    expected = np.where(body.part[which] == 1, body.strain[which], 0.0)
    assert np.abs(found - expected).max() <= 0.51 * (field.high - field.low) / 255.0
    rows = arrays(whole)["fragment_tets"]
    assert np.array_equal(np.bincount(got["tet_row"], minlength=len(rows)), rows)


def test_any_number_of_ranks_makes_the_same_tets() -> None:
    body = shattered(5, 20)
    one = arrays(tets_of(body))
    for ranks in (2, 5):
        other = arrays(tets_of(body, ranks))
        assert all(np.array_equal(one[name], other[name]) for name in one)


def test_a_model_that_is_too_large_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(volume, "MOST_TETS", 100)
    assert made(shattered(3, 4)).tets == b""


def test_invariants_of_stresses_are_those_of_their_matrices() -> None:
    rows = np.random.default_rng(4).normal(size=(6, 200)) * 1e9
    rows[:3] -= rows[:3].mean(axis=0)
    rows[:, 0] = 0.0
    rows[:, 1] = [2e9, -1e9, -1e9, 0.0, 0.0, 0.0]
    pressure = np.linspace(-1e9, 1e9, 200)
    found = invariants.of(np.vstack([rows, pressure]))
    xx, yy, zz, yz, zx, xy = rows
    matrices = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]).transpose(2, 0, 1)
    assert found["principal_stress"] == pytest.approx(np.linalg.eigvalsh(matrices)[:, 2] - pressure, abs=1.0)
    assert found["mises"] == pytest.approx(np.sqrt(1.5 * (matrices**2).sum(axis=(1, 2))))


def test_arrows_are_few_and_spread_over_the_body() -> None:
    body = shattered(8, 12)
    whole: Made = made(body)
    got = arrays(whole.data)
    rows = got["arrow_triangle"]
    assert 300 <= len(rows) <= 1000
    assert len(np.unique(rows)) == len(rows)
    corner = got["positions"][got["triangles"]].mean(axis=1)
    assert (np.ptp(corner[rows], axis=0) > 0.9 * np.ptp(corner, axis=0)).all()
    speeds = np.sqrt((got["arrow_velocity"].astype(float) ** 2).sum(axis=1))
    field = snapshot.header_of(whole.data).fields["speed"]
    known = field.low + got["field:speed"][rows] / 255.0 * (field.high - field.low)
    assert np.abs(speeds - known).max() <= 0.51 * (field.high - field.low) / 255.0 + 1e-4


def test_ranges_of_fields_are_announced_with_their_percentiles() -> None:
    whole = made(shattered(4, 6))
    header = snapshot.header_of(whole.data)
    for name, (least, low, high, most) in whole.fields.items():
        assert (least, most) == (header.fields[name].low, header.fields[name].high)
        assert least <= low <= high <= most
    assert set(whole.fields) == set(header.fields)
    assert blob.UNITS.keys() >= set(whole.fields)
