"""Draws frames as one file: ``python -m conoid.client.render`` reads a Picture as JSON and prints a Drawn.

The only module that imports pyvista. It runs in a child process of ``view``. ``sheet`` divides the picture, ``camera``
has where the camera stands, ``scales`` the colours.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyvista as pv
from PIL import Image

from conoid.cases.figures import exacts, number

from . import camera, hues, scales, sheet
from .camera import Camera
from .captions import INK, PAPER, Scale, add_side, add_title
from .errors import LookError, ViewError
from .frame import require_whole
from .pictures import FIELDS, Drawn, Field, Mirror, Picture, Wall, reason
from .sheet import Sheet

_FAR = 4.0
"""How far the camera stands, in reaches of the body, and half of it the bar of a length. Chosen: beyond walls."""
_BEND = 40.0
"""Degrees by which faces are bent where the outline of a body has a line. Chosen: more than a curved face has."""
_SHADE = 0.04
"""Of the reach of the body, that deep hollows are darker up to this distance. Chosen."""


@dataclass(frozen=True)
class Shot:
    """The drawn surface of one frame, with the field as ``shown``, and its time in s."""

    surface: Any
    outline: Any
    """Lines along the sharp edges of the bodies and of their fragments, but those of sections."""
    time: float | None
    bounds: Any
    """(3, 2) lowest and highest coordinates of the whole body, m."""


def draw(picture: Picture) -> Drawn:
    """Writes ``picture.out``. Raises ViewError where a frame cannot be drawn."""
    field = FIELDS[picture.field]
    picture, shots = _shots(picture)
    _require_sections(picture, np.array([shot.bounds for shot in shots]))
    values = [np.asarray(shot.surface["shown"]) for shot in shots]
    scale = None if field.kind in scales.NAMED else scales.ends(values, field, picture.look)
    Path(picture.out).parent.mkdir(parents=True, exist_ok=True)
    write = _animation if picture.out.lower().endswith(".gif") else _still
    write(shots, picture, scale)
    return Drawn(
        out=picture.out, field=picture.field, unit=field.unit, faces=sum(int(shot.surface.n_cells) for shot in shots),
        low=float(min(each.min() for each in values)), high=float(max(each.max() for each in values)),
        limits=scale[:2] if scale else None, times=[shot.time for shot in shots],
    )  # fmt: skip


def _still(shots: Sequence[Shot], picture: Picture, scale: Scale) -> None:
    """All shots side by side, as a PNG."""
    Image.fromarray(_image(shots, picture, scale, shots)).save(picture.out)


def _animation(shots: Sequence[Shot], picture: Picture, scale: Scale) -> None:
    """One shot after the other, as a GIF that begins again."""
    first, *others = (Image.fromarray(_image([shot], picture, scale, shots)) for shot in shots)
    pause = round(1000.0 / picture.look.rate)
    first.save(picture.out, save_all=True, append_images=others, duration=pause, loop=0, disposal=2)


# The surface --------------------------------------------------------------------------------------------------------


def _shots(picture: Picture) -> tuple[Picture, list[Shot]]:
    """All frames, and the picture with the camera that the first one asks for."""
    shots = []
    for path in picture.frames:
        mesh, time = _read(path)
        bounds = np.reshape(mesh.bounds, (3, 2))
        picture = camera.settled(picture, bounds)
        shots.append(Shot(_surface(mesh, picture), _outline(mesh, picture), time, bounds))
    return picture, shots


def read_mesh(path: Path) -> Any:
    """The whole mesh of a frame as a pyvista.UnstructuredGrid."""
    return _read(str(path))[0]


def _read(path: str) -> tuple[Any, float | None]:
    """The whole mesh of a frame, its pieces merged, and the frame's time. Raises ViewError for a damaged frame."""
    require_whole(path)
    mesh = pv.read(path)
    data = mesh.field_data
    if isinstance(mesh, pv.PartitionedDataSet | pv.MultiBlock):
        pieces = [piece for piece in mesh if piece is not None and piece.n_cells]
        data = pieces[0].field_data if pieces and "time" not in data else data
        mesh = pv.merge(pieces, merge_points=False)
    if mesh.n_cells == 0:
        raise ViewError(f"{path}: this frame has no elements")
    return mesh, float(np.ravel(data["time"])[0]) if "time" in data else None


def _surface(mesh: Any, picture: Picture) -> Any:
    """The outer faces with the field as ``shown``, cut open at the sections, reflected in every mirror."""
    field = FIELDS[picture.field]
    length = float(mesh.length)
    mesh = _with_field(mesh, picture.field, picture.look.raw or field.kind in scales.NAMED)
    towards = picture.camera or camera.FROM
    bounds = np.reshape(mesh.bounds, (3, 2))
    for plane in picture.sections:
        mesh = _cut(mesh, plane, towards[plane.axis], bounds[plane.axis])
    surface = mesh.extract_surface(algorithm="dataset_surface")
    if picture.mirrors:
        surface = surface.triangulate()  # a section leaves faces of three to six corners
    for mirror in picture.mirrors:
        surface = _reflected(surface, mirror, length)
    return surface


def _outline(mesh: Any, picture: Picture) -> Any:
    """Of the uncut body: where a section cuts tets, the faces that they have in common do not match any more."""
    bare = pv.UnstructuredGrid(mesh.cells, mesh.celltypes, np.asarray(mesh.points, dtype=float))
    surface, length = bare.extract_surface(algorithm="dataset_surface"), float(mesh.length)
    lines = surface.extract_feature_edges(
        _BEND, boundary_edges=True, feature_edges=True, manifold_edges=False, non_manifold_edges=False
    )
    for plane in picture.sections:
        lines = _clipped(lines, plane, (picture.camera or camera.FROM)[plane.axis])
    for mirror in picture.mirrors:
        lines = _reflected(lines, mirror, length)
    return lines


def _with_field(mesh: Any, name: str, cells: bool) -> Any:
    """The mesh with ``name`` as cell or point data ``shown``, in the unit of the picture, and nothing else."""
    factor = FIELDS[name].factor
    bare = pv.UnstructuredGrid(mesh.cells, mesh.celltypes, np.asarray(mesh.points, dtype=float))
    if name == "speed":
        _require(mesh.point_data, "velocity")
        bare.point_data["shown"] = np.linalg.norm(mesh.point_data["velocity"], axis=1) * factor
        return bare.point_data_to_cell_data() if cells else bare
    if name in mesh.point_data:
        bare.point_data["shown"] = np.asarray(mesh.point_data[name]) * factor
        return bare.point_data_to_cell_data() if cells else bare
    _require(mesh.cell_data, name)
    values = np.asarray(mesh.cell_data[name])
    if FIELDS[name].kind in scales.NAMED:
        bare.cell_data["shown"] = values
        bare.cell_data["part"] = mesh.cell_data.get("part", np.zeros(mesh.n_cells, int))
        return bare
    bare.cell_data["shown"] = values * factor
    return bare if cells else bare.cell_data_to_point_data()


def _require(data: Any, name: str) -> None:
    if name not in data:
        raise ViewError(f"this frame has no field {name!r}; it has: {', '.join(data.keys()) or 'none'}")


def _cut(mesh: Any, plane: Mirror, side: float, extent: Any) -> Any:
    """Without what lies between the plane and the camera, which is on this side of it; ``extent``: of the whole body
    across the plane, m.
    """
    left = _clipped(mesh, plane, side)
    if left.n_cells == 0:
        axis, (low, high) = "xyz"[plane.axis], extent
        raise _beyond(axis, plane.at, low, high)
    return left


def _clipped(mesh: Any, plane: Mirror, side: float) -> Any:
    normal, origin = np.zeros(3), np.zeros(3)
    normal[plane.axis], origin[plane.axis] = (1.0 if side >= 0.0 else -1.0), plane.at
    return mesh.clip(normal=normal, origin=origin)


def _require_sections(picture: Picture, bounds: Any) -> None:
    """Raises LookError for a section off the bodies of all frames, which have the ``bounds`` (frames, 3, 2), m."""
    for plane in picture.sections:
        low, high = bounds[:, plane.axis, 0].min(), bounds[:, plane.axis, 1].max()
        if not low <= plane.at <= high:
            raise _beyond("xyz"[plane.axis], plane.at, low, high)


def _beyond(axis: str, at: float, low: float, high: float) -> LookError:
    first, last = exacts((low, high), "", 4)
    return LookError(f"section = {axis}={number(at)}: the body is between {axis}={first} and {axis}={last} (in m)")


def _reflected(surface: Any, mirror: Mirror, length: float) -> Any:
    """The surface, or lines on it, and its image, joined without what lies in the plane."""
    points = np.asarray(surface.points)
    near = np.abs(points[:, mirror.axis] - mirror.at) < 1e-6 * length
    faces = surface.regular_faces if surface.n_lines == 0 else surface.lines.reshape(-1, 3)[:, 1:]
    outer = surface.extract_cells(np.flatnonzero(~near[faces].all(axis=1)))
    image = outer.copy()
    image.points[:, mirror.axis] = 2.0 * mirror.at - image.points[:, mirror.axis]
    joined = pv.merge([outer, image], merge_points=True)
    return joined.extract_surface(algorithm="dataset_surface")


# The picture --------------------------------------------------------------------------------------------------------


def _image(shots: Sequence[Shot], picture: Picture, scale: Scale, every: Sequence[Shot]) -> Any:
    """Pixels of the panels of ``shots``; the camera sees the bodies of ``every`` shot."""
    field, title = FIELDS[picture.field], sheet.title(picture, [shot.time for shot in shots])
    points = [np.asarray(shot.surface.points, float) for shot in every]
    laid = sheet.lay(points, len(shots), picture, bool(title), field.kind != "fragments")
    plotter = _plotter(laid, picture)
    drawn: Any = None
    for place, shot in enumerate(shots):
        plotter.subplot(*laid.panel(place))
        drawn = _add_body(plotter, shot.surface, field, picture, scale)
        if shot.outline.n_cells and not (picture.look.raw or picture.look.edges):
            width = max(1.0, picture.look.size[1] / 900)
            plotter.add_mesh(shot.outline, color=INK, line_width=width, opacity=0.5, lighting=False)
        _set_camera(plotter, laid.eye)
        if not picture.out.lower().endswith(".gif"):  # a second a picture
            _add_shade(plotter, laid.eye.deep)
        _add_marks(plotter, laid, place, [shot.time for shot in shots], picture)
    if title:
        add_title(plotter, title, picture)
    if laid.side:
        plotter.subplot(*laid.beside)
        add_side(plotter, picture, scale, drawn, [shot.surface["shown"] for shot in every])
    return _pixels(plotter, picture.look.transparent)


def _plotter(laid: Sheet, picture: Picture) -> Any:
    rows, columns = laid.weights()
    grid: dict[str, Any] = {"shape": (len(rows), len(columns)), "row_weights": rows, "col_weights": columns}
    grid |= {"groups": laid.groups()} if laid.groups() else {}
    plotter: Any = pv.Plotter(
        off_screen=True, window_size=list(picture.look.size), lighting="none", border=False, **grid
    )
    plotter.set_background(PAPER, all_renderers=True)
    plotter.enable_anti_aliasing("ssaa", all_renderers=True)
    return plotter


def _pixels(plotter: Any, transparent: bool) -> Any:
    pixels = plotter.screenshot(None, return_img=True, transparent_background=transparent)
    plotter.close()
    return np.asarray(pixels)


def _add_body(plotter: Any, surface: Any, field: Field, picture: Picture, scale: Scale) -> Any:
    """The body with its lights: a key light from the upper left, a weaker one from the right, held to the camera."""
    for position, intensity in (((-0.7, 0.9, 1.6), 0.66), ((1.3, 0.2, 1.0), 0.34)):
        plotter.add_light(pv.Light(position=position, intensity=intensity, light_type="camera light"), only_active=True)
    raw = picture.look.raw
    look = {
        "scalars": "shown", "smooth_shading": not raw, "split_sharp_edges": not raw, "feature_angle": 35.0,
        "ambient": 0.45, "diffuse": 0.85, "specular": 0.10, "specular_power": 20.0, "show_scalar_bar": False,
        "show_edges": picture.look.edges, "edge_color": INK, "edge_opacity": 0.25,
    }  # fmt: skip
    if scale is None:
        shown, bodies = surface["shown"], max(len(picture.parts), 1)
        fragments = field.kind == "fragments"
        named = hues.of_fragments(shown, surface["part"], bodies) if fragments else hues.of_names(shown)
        surface.cell_data["colours"] = named
        flat = {"smooth_shading": False} if field.kind == "fragments" else {}
        drawn = plotter.add_mesh(surface, **{**look, "scalars": "colours", "rgb": True, **flat})
    else:
        colours = field.colours if isinstance(field.colours, str) else scales.blend(field.colours)
        drawn = plotter.add_mesh(surface, cmap=colours, clim=scale[:2], **look)
    for wall in picture.walls:
        _add_wall(plotter, surface, wall)
    return drawn


def _add_shade(plotter: Any, deep: float) -> None:
    """Ambient occlusion: cracks and hollows are darker."""
    plotter.enable_ssao(radius=_SHADE * deep, bias=0.1 * _SHADE * deep, kernel_size=64, blur=True)


def _set_camera(plotter: Any, eye: Camera) -> None:
    """Parallel, far enough that everything lies before it, and no farther: depths are of single precision."""
    plotter.camera.focal_point = eye.centre
    plotter.camera.position = eye.centre + _FAR * eye.deep * eye.towards
    plotter.camera.up = eye.above
    plotter.camera.enable_parallel_projection()
    plotter.camera.parallel_scale = eye.half
    plotter.renderer.ResetCameraClippingRange()
    plotter.camera_set = True


def _add_marks(plotter: Any, laid: Sheet, place: int, times: Sequence[float | None], picture: Picture) -> None:
    """Time of a panel among several; the axes at the lower left, at the lower right the bar of a round length."""
    size, last, whens = sheet.font(14, picture.look.size[1]), len(times) - 1, sheet.when(times)
    if last:
        top = 1.0 - 40.0 / laid.height
        plotter.add_text(whens[place], position=(0.03, top), viewport=True, font_size=size, color=INK)
    if place == last - last % laid.columns:
        share = min(0.16 * picture.look.size[1] / laid.height, 0.3)
        plotter.add_axes(color=INK, line_width=3, viewport=(0.0, 0.0, share / max(laid.aspect, 1.0), share))
    if place == last and picture.look.scale:
        _add_scale(plotter, laid, size)


def _add_scale(plotter: Any, laid: Sheet, size: int) -> None:
    """A line of a round length at the lower right, nearer than the body."""
    eye, aspect = laid.eye, laid.aspect
    length, text = camera.scale_bar(eye, aspect)
    corner = 0.95 * aspect * eye.half * eye.right - 0.95 * eye.half * eye.above
    end = eye.centre + corner + 0.5 * _FAR * eye.deep * eye.towards
    line = pv.Line(end - length * eye.right, end)
    plotter.add_mesh(line, color=INK, line_width=max(2, size // 3), lighting=False, reset_camera=False)
    plotter.renderer.ResetCameraClippingRange()
    start = 0.5 + 0.5 * (0.95 - length / (aspect * eye.half))
    plotter.add_text(text, position=(start, 0.035), viewport=True, font_size=size, color=INK)


def _add_wall(plotter: Any, surface: Any, wall: Wall) -> None:
    """A pale disk in the wall, a little larger than the body; it takes no part in the fit of the camera."""
    normal = np.asarray(wall.normal) / np.linalg.norm(wall.normal)
    centre = np.asarray(surface.center)
    points = np.asarray(surface.points) - centre
    radius = 1.35 * float(np.linalg.norm(points - np.outer(points @ normal, normal), axis=1).max())
    foot = centre - ((centre - np.asarray(wall.point)) @ normal + 2e-3 * radius) * normal
    disk = pv.Disc(center=foot, inner=0.0, outer=radius, normal=normal, r_res=1, c_res=96)
    plotter.add_mesh(disk, color="#aab6c3", opacity=0.55, lighting=False, reset_camera=False)


def main() -> int:
    """Reads standard input, draws, prints the result as one line of JSON; a failure is one line on standard error."""
    code, line = told(sys.stdin.buffer.read())
    print(line, file=sys.stderr if code else sys.stdout)
    return code


def told(asked: bytes) -> tuple[int, str]:
    """The exit code and the line for a Picture as JSON."""
    picture = msgspec.json.decode(asked, type=Picture)
    try:
        return 0, msgspec.json.encode(draw(picture)).decode()
    except (ViewError, OSError, ValueError, RuntimeError) as error:
        return LookError.exit_code if isinstance(error, LookError) else 1, reason(error, picture.out)


if __name__ == "__main__":
    sys.exit(main())
