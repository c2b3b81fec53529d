"""Draws one frame as a PNG: ``python -m conoid.client.render`` reads a Picture as JSON and prints a Drawn.

The only module that imports pyvista. It runs in a child process of ``view``.
"""

import sys
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyvista as pv

from .errors import ViewError
from .pictures import FIELDS, Drawn, Field, Mirror, Picture, Wall

_INK, _PAPER, _HAZE = "#1d2733", "#ffffff", "#dfe6ee"
_NAMED = ("classes", "fragments")
"""Kinds of fields whose values are names."""
_WHOLE = "#c9d3dc"
_CLASSES = [
    "#4c78a8",
    "#f58518",
    "#54a24b",
    "#e45756",
    "#72b7b2",
    "#b279a2",
    "#eeca3b",
    "#9d755d",
    "#ff9da6",
    "#bab0ac",
]
_FROM = (1.0, -1.55, 0.62)
"""Direction from the body to the camera where nothing else decides: from the front, the right and above. Chosen."""
_BAR = {
    "vertical": True, "position_x": 0.885, "position_y": 0.17, "width": 0.045, "height": 0.62,
    "color": _INK, "font_family": "arial", "fmt": " %.4g",
}  # fmt: skip


def draw(picture: Picture) -> Drawn:
    """Writes ``picture.out``. Raises ViewError where the frame cannot be drawn."""
    field = FIELDS[picture.field]
    surface = _surface(_read(picture.frame), picture)
    values = np.asarray(surface["shown"])
    plotter: Any = pv.Plotter(off_screen=True, window_size=list(picture.size), lighting="none")
    _add_lights(plotter)
    plotter.set_background(_HAZE, top=_PAPER)
    _add_body(plotter, surface, field, picture)
    _place_camera(plotter, surface, _view_from(surface, picture))
    for wall in picture.walls:
        _add_wall(plotter, surface, wall)
    if picture.title:
        plotter.add_text(
            picture.title, position=(0.03, 0.93), viewport=True, font_size=_points(15, picture), color=_INK
        )
    plotter.add_axes(color=_INK, line_width=3, viewport=(0.0, 0.0, 0.16, 0.16))
    plotter.enable_anti_aliasing("ssaa")
    Path(picture.out).parent.mkdir(parents=True, exist_ok=True)
    plotter.screenshot(picture.out)
    plotter.close()
    return Drawn(
        out=picture.out, field=picture.field, unit=field.unit, faces=int(surface.n_cells),
        low=float(values.min()), high=float(values.max()),
    )  # fmt: skip


def _read(path: str) -> Any:
    """The whole mesh of a frame, its pieces merged."""
    mesh = pv.read(path)
    if isinstance(mesh, pv.PartitionedDataSet | pv.MultiBlock):
        mesh = pv.merge([piece for piece in mesh if piece is not None and piece.n_cells], merge_points=False)
    if mesh.n_cells == 0:
        raise ViewError(f"{path}: this frame has no elements")
    return mesh


def _surface(mesh: Any, picture: Picture) -> Any:
    """The outer faces with the field as ``shown``, reflected in every mirror."""
    field = FIELDS[picture.field]
    cells = picture.raw or field.kind in _NAMED
    mesh = _with_field(mesh, picture.field, cells)
    surface = mesh.extract_surface(algorithm="dataset_surface")
    for mirror in picture.mirrors:
        surface = _reflected(surface, mirror, float(mesh.length))
    return surface


def _with_field(mesh: Any, name: str, cells: bool) -> Any:
    """The mesh with ``name`` as cell or point data ``shown``, in the unit of the picture, and nothing else."""
    factor = FIELDS[name].factor
    bare = pv.UnstructuredGrid(mesh.cells, mesh.celltypes, np.asarray(mesh.points, dtype=float))
    if name == "speed":
        _require(mesh.point_data, "velocity")
        bare.point_data["shown"] = np.linalg.norm(mesh.point_data["velocity"], axis=1) * factor
        return bare.point_data_to_cell_data() if cells else bare
    _require(mesh.cell_data, name)
    values = np.asarray(mesh.cell_data[name])
    bare.cell_data["shown"] = values if FIELDS[name].kind in _NAMED else values * factor
    return bare if cells else bare.cell_data_to_point_data()


def _require(data: Any, name: str) -> None:
    if name not in data:
        raise ViewError(f"this frame has no field {name!r}; it has: {', '.join(data.keys()) or 'none'}")


def _reflected(surface: Any, mirror: Mirror, length: float) -> Any:
    """The surface and its image, joined without the faces that lie in the plane."""
    points = np.asarray(surface.points)
    near = np.abs(points[:, mirror.axis] - mirror.at) < 1e-6 * length
    faces = surface.regular_faces
    outer = surface.extract_cells(np.flatnonzero(~near[faces].all(axis=1)))
    image = outer.copy()
    image.points[:, mirror.axis] = 2.0 * mirror.at - image.points[:, mirror.axis]
    joined = pv.merge([outer, image], merge_points=True)
    return joined.extract_surface(algorithm="dataset_surface")


def _points(size: float, picture: Picture) -> int:
    """A font size that is ``size`` in a picture of 1200 lines."""
    return max(6, round(size * picture.size[1] / 1200))


def _add_lights(plotter: Any) -> None:
    """A key light from the upper left and a weaker fill from the right, both held to the camera."""
    for position, intensity in (((-0.7, 0.9, 1.6), 0.66), ((1.3, 0.2, 1.0), 0.34)):
        light = pv.Light(position=position, intensity=intensity, light_type="camera light")
        plotter.add_light(light)


def _add_body(plotter: Any, surface: Any, field: Field, picture: Picture) -> None:
    look = {
        "scalars": "shown", "smooth_shading": not picture.raw, "split_sharp_edges": not picture.raw,
        "feature_angle": 35.0, "ambient": 0.38, "diffuse": 0.85, "specular": 0.10, "specular_power": 20.0,
        "show_edges": picture.edges, "edge_color": _INK, "edge_opacity": 0.25,
    }  # fmt: skip
    if field.kind in _NAMED:
        add = _add_classes if field.kind == "classes" else _add_fragments
        add(plotter, surface, look, picture)
        return
    low, high, labels = _scale(np.asarray(surface["shown"]), field, picture.limits)
    bar = {
        **_BAR, "title": f"{field.label}\n{field.unit}\n" if field.unit else f"{field.label}\n", "n_labels": labels,
        "title_font_size": _points(30, picture), "label_font_size": _points(26, picture),
    }  # fmt: skip
    colours = field.colours if isinstance(field.colours, str) else _blend(field.colours)
    plotter.add_mesh(surface, cmap=colours, clim=(low, high), scalar_bar_args=bar, **look)


def _blend(colours: tuple[str, ...]) -> list[str]:
    """256 colours from the first to the last."""
    corners = np.array([pv.Color(colour).float_rgb for colour in colours])
    places = np.linspace(0, len(colours) - 1, 256)
    channels = [np.interp(places, range(len(colours)), corners[:, i]) for i in range(3)]
    return [pv.Color(colour).hex_rgb for colour in np.stack(channels, axis=1)]


def _scale(values: Any, field: Field, limits: tuple[float, float] | None) -> tuple[float, float, int]:
    """The ends of the colour bar, at round numbers around the values, and the number of labels."""
    if limits is not None:
        return (*limits, 6)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if field.kind == "centred":
        low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))
    elif 0 < low < 0.1 * high:
        low = 0.0
    span = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-30)
    power = 10.0 ** np.floor(np.log10(span / 4))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if span / (factor * power) <= 6)
    first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
    last = max(last, first + 1)
    return float(first * step), float(last * step), int(last - first) + 1


def _add_classes(plotter: Any, surface: Any, look: dict[str, Any], picture: Picture) -> None:
    """One colour a part or rank, with a legend."""
    classes = np.asarray(surface["shown"]).astype(int)
    present = np.unique(classes)
    surface.cell_data["colours"] = np.array([pv.Color(_CLASSES[i % len(_CLASSES)]).int_rgb for i in classes], np.uint8)
    plotter.add_mesh(surface, **{**look, "scalars": "colours", "rgb": True})
    names = picture.parts if picture.field == "part" else []
    entries = [
        [names[i] if i < len(names) else f"{picture.field} {i}", _CLASSES[i % len(_CLASSES)]] for i in present[:16]
    ]
    plotter.add_legend(
        entries,
        face="rectangle",
        bcolor=None,
        border=False,
        loc="upper right",
        size=(0.13, 0.032 * len(entries) + 0.01),
    )


def _add_fragments(plotter: Any, surface: Any, look: dict[str, Any], picture: Picture) -> None:
    """One colour a fragment, from its name; what is largest to the eye is grey."""
    _, which, faces = np.unique(np.asarray(surface["shown"]).astype(np.int64), return_inverse=True, return_counts=True)
    palette = np.array([pv.Color(colour).int_rgb for colour in _CLASSES], np.uint8)
    colours = palette[np.random.default_rng(0).integers(len(palette), size=len(faces))]
    colours[np.argmax(faces)] = pv.Color(_WHOLE).int_rgb
    surface.cell_data["colours"] = colours[which.reshape(-1)]
    plotter.add_mesh(surface, **{**look, "scalars": "colours", "rgb": True, "smooth_shading": False})


def _view_from(surface: Any, picture: Picture) -> Any:
    """The direction to the camera: the front right from above, or where the sections of a cut model can be seen."""
    sides = {cut.axis: 1.0 if cut.at > surface.center[cut.axis] else -1.0 for cut in picture.cuts if cut.axis < 2}
    if not sides:
        return np.array(_FROM)
    direction = np.array([sides.get(0, 0.8), sides.get(1, -0.8), _FROM[2]])
    if len(sides) == 1:
        direction[list(sides)] *= 1.55
    return direction


def _place_camera(plotter: Any, surface: Any, direction: Any) -> None:
    """As near as the body fits in the picture, left of the colour bar."""
    centre, length = np.asarray(surface.center), float(surface.length) or 1.0
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + direction / np.linalg.norm(direction) * 3.0 * length
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.camera.view_angle = 24.0
    plotter.reset_camera(bounds=surface.bounds)
    plotter.camera.zoom(_fill(plotter, surface))
    plotter.camera.SetWindowCenter(0.07, 0.0)


def _fill(plotter: Any, surface: Any) -> float:
    """How much nearer the camera may come until the body touches the margins."""
    camera, (width, height) = plotter.camera, plotter.window_size
    matrix = camera.GetCompositeProjectionTransformMatrix(width / height, -1.0, 1.0)
    project = pv.array_from_vtkmatrix(matrix)
    points = np.c_[np.asarray(surface.points), np.ones(surface.n_points)] @ project.T
    seen = np.abs(points[:, :2] / points[:, 3:])
    return float(0.80 / max(seen[:, 0].max(), seen[:, 1].max() / 1.02, 1e-6))


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
    try:
        picture = msgspec.json.decode(sys.stdin.buffer.read(), type=Picture)
        print(msgspec.json.encode(draw(picture)).decode())
    except (ViewError, OSError, ValueError, RuntimeError) as error:
        print(" ".join(str(error).split()) or type(error).__name__, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
