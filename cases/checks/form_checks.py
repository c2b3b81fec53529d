"""Checks of the sizes of a shape against each other."""

from collections.abc import Iterator

from ..model.forms import BoxForm, ConeForm, OgiveForm, RingSectorForm, SphericalCapForm, TubeForm
from ..model.tables import Model
from ..reading.problems import Location, Problem, problem
from ..shapes.profile import tangent

_LEAST = 1e-6
"""Smallest allowed size of a detail, divided by the radius of its body (chosen value). A smaller size, except 0, is an
error. No mesh resolves a smaller detail."""
_ROUNDED = "shank", "tip_radius", "meplat", "top_radius", "inner_radius", "radius"


def check_form(form: Model, location: Location) -> Iterator[Problem]:
    """Yields every problem of the sizes of a shape at ``location``."""
    yield from _slips(form, location)
    if isinstance(form, BoxForm):
        for d in (d for d in range(3) if form.low[d] >= form.high[d]):
            yield problem((*location, "high", d), form.high[d], f"must be above low[{d}], {form.low[d]} m")
    elif isinstance(form, TubeForm | RingSectorForm):
        if form.inner_radius >= form.radius:
            yield problem((*location, "inner_radius"), form.inner_radius, f"must be below the radius, {form.radius} m")
    elif isinstance(form, ConeForm):
        if not form.radius + form.top_radius > 0.0:
            yield problem((*location, "top_radius"), form.top_radius, "must be above 0 where radius is 0")
    elif isinstance(form, OgiveForm):
        yield from _ogive(form, location)
    elif isinstance(form, SphericalCapForm) and form.height >= 2.0 * form.radius:
        yield problem((*location, "height"), form.height, f"must be below the diameter, {2.0 * form.radius:g} m")


def _slips(form: Model, location: Location) -> Iterator[Problem]:
    """Yields a problem for each length that may be 0, is not 0, and is too small for any mesh."""
    if not isinstance(form, ConeForm | OgiveForm | RingSectorForm):
        return
    most = max(form.radius, form.top_radius) if isinstance(form, ConeForm) else form.radius
    for key in _ROUNDED:
        if 0.0 < getattr(form, key, 0.0) < _LEAST * most:
            message = f"is below a millionth of the radius, {most:g} m; use 0, or a length that elements can resolve"
            yield problem((*location, key), getattr(form, key), message)


def _ogive(form: OgiveForm, location: Location) -> Iterator[Problem]:
    """Yields at most one problem: the first wrong key of an ogive."""
    for key, value, message in (*_nose(form), *_tip(form)):
        yield problem((*location, key), value, message)
        return


def _nose(form: OgiveForm) -> Iterator[tuple[str, object, str]]:
    if form.crh is None and form.nose is None:
        yield "crh", ..., "needs at least one of crh and nose"
    elif form.nose is not None and form.nose < form.radius:
        yield "nose", form.nose, f"must not be below the radius, {form.radius:g} m, which makes a hemisphere"
    elif form.nose is not None and form.crh is not None:
        least = tangent(form.nose, form.radius)
        if form.crh < least * (1.0 - 1e-12):
            wide = "that of the tangent ogive of this nose: the nose would be wider than the shank"
            message = f"must not be below {least:.12g}, {wide}"
            yield "crh", form.crh, message


def _tip(form: OgiveForm) -> Iterator[tuple[str, object, str]]:
    if form.tip_radius and form.meplat:
        yield "meplat", form.meplat, "allowed is either tip_radius or meplat; remove one of them"
    elif form.meplat >= 2.0 * form.radius:
        yield "meplat", form.meplat, f"must be below the diameter, {2.0 * form.radius:g} m"
    elif form.tip_radius >= form.radius:
        yield "tip_radius", form.tip_radius, f"must be below the radius, {form.radius:g} m"
