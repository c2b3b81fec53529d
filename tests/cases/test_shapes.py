"""Cones, ogives, caps and ring sectors by formula."""

import itertools
import math
import random
from typing import Any

import numpy as np
import pytest
from scipy import integrate

from conoid.cases.load import CaseError, parse_case
from conoid.cases.model.bodies import RingSector
from conoid.cases.shapes.geometry import AXES, bounds, height, holds, index, lowest_along, surface, volume
from conoid.cases.shapes.profile import profile
from conoid.cases.shapes.sheets import sheets

from .forms import SHAPES, revolved, shape

SECTORS = ("full", "half", "quarter")


def scene(**mesh: Any) -> dict[str, Any]:
    """Returns a case of one body with the given shape."""
    return {
        "name": "one",
        "parts": [{"name": "body", "material": "steel", "mesh": {key: v for key, v in mesh.items() if v is not None}}],
        "run": {"end_time": 1e-6},
    }


@pytest.mark.parametrize("crh", [0.5, 1.5, 3.0, 8.0])
def test_a_tangent_ogive_is_that_of_the_textbook(crh: float) -> None:
    """The nose has the length D sqrt(crh - 1/4) and the radius sqrt(rho^2 - z^2) - (rho - R), rho = D crh (Carlucci and
    Jacobson, Ballistics, chapter 8); a nose of this length has this crh.
    """
    radius, rho = 0.5, crh
    body = revolved("tangent", radius=radius, crh=crh, shank=0.0)
    outline, length = profile(body), math.sqrt(crh - 0.25)
    assert height(body) == pytest.approx(length, rel=1e-14)
    for z in np.linspace(0.0, 0.999 * length, 7):
        assert outline.at(z) == pytest.approx(math.sqrt(rho**2 - z**2) - (rho - radius), abs=1e-14)
    by_nose = shape("tangent", radius=radius, crh=None, nose=length, shank=0.0)
    assert volume(by_nose) == pytest.approx(volume(body), rel=1e-12)


def test_a_secant_ogive_passes_through_base_and_tip_with_its_radius() -> None:
    """Three points of the outline lie on a circle of the radius D crh; at its base the nose has an edge inwards."""
    body = revolved("secant", pointing="high")
    outline, points = profile(body), [0.0, 0.4, 0.9]
    (x1, y1), (x2, y2), (x3, y3) = [(z, outline.at(z)) for z in points]
    sides = math.hypot(x2 - x1, y2 - y1), math.hypot(x3 - x2, y3 - y2), math.hypot(x1 - x3, y1 - y3)
    area = 0.5 * abs((x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1))
    assert math.prod(sides) / (4.0 * area) == pytest.approx(3.0, rel=1e-9)
    assert outline.at(0.0) == pytest.approx(0.5, rel=1e-12)
    assert outline.at(1.2) == pytest.approx(0.0, abs=1e-7)
    assert outline.at(1e-6) < 0.5
    least = (1.2**2 + 0.5**2) / 1.0
    tangent = shape("secant", crh=least)
    assert volume(tangent) == pytest.approx(volume(shape("secant", crh=None)), rel=1e-12)


def test_a_round_tip_goes_on_from_the_arc_without_an_edge() -> None:
    outline = profile(revolved("rounded"))
    arc, ball = outline.segments[-2:]
    for off in (1e-7, 1e-9):
        slopes = [(each.at(ball.z0 + side * off) - ball.r0) / (side * off) for each, side in ((arc, -1), (ball, 1))]
        assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)
    assert outline.ends[1] == 0.0
    assert outline.height < height(shape("rounded", tip_radius=0.0))


@pytest.mark.parametrize("name", [name for name in SHAPES if name not in ("ring", "wedge")])
def test_volume_and_area_of_a_revolved_body_are_its_integrals(name: str) -> None:
    body = revolved(name)
    outline = profile(body)
    steps = sorted({each.z0 for each in outline.segments} | {outline.height})
    pieces = list(itertools.pairwise(steps))
    for value, integrand in (
        (outline.volume(), lambda z: math.pi * outline.at(z) ** 2),
        (outline.section(), outline.at),
    ):
        found = sum(integrate.quad(integrand, *piece, epsabs=1e-12)[0] for piece in pieces)
        assert value == pytest.approx(found, rel=1e-7)
    assert volume(body) == pytest.approx(outline.volume())


@pytest.mark.parametrize("sector", SECTORS)
@pytest.mark.parametrize("name", SHAPES)
def test_formulas_of_a_shape_agree_with_its_mesh(name: str, sector: str) -> None:
    """The reference of the volume is the fraction of random points inside of the body; the references of area and
    extent are the patches of its surfaces.
    """
    body, chance = shape(name, sector=sector), random.Random(1)
    low, high = bounds(body) or ((), ())
    box, many = math.prod(b - a for a, b in zip(low, high, strict=True)), 4_000
    points = [tuple(chance.uniform(a, b) for a, b in zip(low, high, strict=True)) for _ in range(many)]
    share = sum(holds(body, (x, y, z)) for x, y, z in points) / many
    assert volume(body) == pytest.approx(box * share, abs=5.0 * box * math.sqrt(share * (1.0 - share) / many))
    assert surface(body) == pytest.approx(_area(body), rel=4e-3)
    nodes = np.array(
        [at(u, v) for at, _, _ in sheets(body) for u in np.linspace(0, 1, 41) for v in np.linspace(0, 1, 41)]
    )
    assert nodes.min(axis=0) == pytest.approx(np.array(low), abs=2e-3)
    assert nodes.max(axis=0) == pytest.approx(np.array(high), abs=2e-3)
    if sector == "full" and not isinstance(body, RingSector):
        normal = np.array([0.48, -0.6, 0.64])
        assert lowest_along(body, tuple(normal)) == pytest.approx((nodes @ normal).min(), abs=2e-3)


def _area(body: Any, n: int = 40) -> float:
    """Returns the sum of the areas of all patches of the surfaces; a patch consists of two triangles."""
    total = 0.0
    for at, _, _ in sheets(body):
        x = np.array([[at(i / n, j / n) for j in range(n + 1)] for i in range(n + 1)])
        diagonals = x[1:, 1:] - x[:-1, :-1], x[1:, :-1] - x[:-1, 1:]
        total += 0.5 * float(np.linalg.norm(np.cross(*diagonals), axis=2).sum())
    return total


@pytest.mark.parametrize("name", SHAPES)
def test_half_and_quarter_are_shares_of_the_whole(name: str) -> None:
    if name in ("ring", "wedge"):
        start = {"ring": "-100 deg", "wedge": "-30 deg"}[name]
        whole, half = shape(name, start=start), shape(name, start=start, sector="half")
        assert volume(half) == pytest.approx(volume(whole) * (math.pi / 3.5 if name == "ring" else 1.0))
        return
    assert [volume(shape(name, sector=each)) for each in SECTORS] == pytest.approx(
        [volume(shape(name)) * share for share in (1.0, 0.5, 0.25)]
    )


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("tangent", {"crh": None}, "crh: needs at least one of crh and nose"),
        ("tangent", {"crh": None, "nose": 0.4}, "nose = 0.4: must not be below the radius, 0.5 m"),
        (
            "tangent",
            {"crh": 1.0, "nose": 2.0},
            "crh = 1.0: must not be below 4.25, that of the tangent ogive of this nose",
        ),
        ("tangent", {"crh": 0.4}, "crh = 0.4: "),
        ("tangent", {"shank": 1e-12}, "shank = 1e-12: is below a millionth of the radius, 0.5 m; use 0"),
        ("tangent", {"tip_radius": 0.5}, "tip_radius = 0.5: must be below the radius, 0.5 m"),
        ("tangent", {"tip_radius": 0.1, "meplat": 0.1}, "meplat = 0.1: allowed is either tip_radius or meplat"),
        ("meplat", {"meplat": 1.0}, "meplat = 1.0: must be below the diameter, 1 m"),
        ("cone", {"radius": 0.0}, "top_radius = 0.0: must be above 0 where radius is 0"),
        ("cone", {"element_size": 1.1}, "element_size = 1.1: must not be above the smallest extent"),
        ("cone", {"generator": "structured"}, "generator = 'structured': allowed: 'gmsh'"),
        ("hemisphere", {"height": 0.7}, "height: unknown key"),
        ("cap", {"height": None}, "height: this key is missing"),
        ("cap", {"height": 1.4}, "height = 1.4: must be below the diameter, 1.4 m"),
        ("ring", {"inner_radius": 0.7}, "inner_radius = 0.7: must be below the radius, 0.7 m"),
        ("ring", {"angle": "360 deg"}, "angle = '360 deg': "),
        ("ring", {"angle": "1e-6 deg"}, "element_size = 0.1: must not be above the smallest extent"),
    ],
)
def test_sizes_that_do_not_fit_are_refused_in_one_line(name: str, change: dict[str, Any], message: str) -> None:
    with pytest.raises(CaseError) as refused:
        parse_case(scene(**{"element_size": 0.1, **SHAPES[name], **change}))
    assert str(refused.value).startswith(f"parts[0].mesh.{message}")
    assert "\n" not in str(refused.value)


def test_a_cut_of_each_shape_needs_its_plane() -> None:
    for name in SHAPES:
        body = shape(name, sector="half")
        data = scene(element_size=0.1, sector="half", **SHAPES[name])
        first = AXES[(index(body.axis) + 1) % 3]
        if isinstance(body, RingSector) and name == "wedge":
            continue
        with pytest.raises(CaseError, match=f"needs a boundary with kind = 'symmetry', axis = '{first}'"):
            parse_case(data)
