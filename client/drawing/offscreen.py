"""Drawing of the pieces of a frame off screen: shaded colours, and for each pixel the number and the depth of the
nearest part or fragment.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import part_colours, vtk, walls
from .camera import Camera
from .fields import FIELDS, Field
from .picture import Picture
from .planes import Wall
from .scales import Scale
from .shot import Shot
from .surfaces import Piece

FAR = 4.0
"""Distance of the camera from the centre, relative to the radius of the body (chosen value: the camera stands outside
of the walls)."""
_SHADE = 0.04
"""Radius of the ambient occlusion, relative to the radius of the body. Hollows that are deeper than this radius are
drawn darker (chosen value)."""
_LIGHTS = ((-0.7, 0.9, 1.6), 0.66), ((1.3, 0.2, 1.0), 0.34)
"""Position and intensity of the lights: a strong light from the upper left and a weaker light from the right."""
_WALL = "#aab6c3"
_MATTER = {"ambient": 0.45, "diffuse": 0.85, "specular": 0.10, "specular_power": 20.0}
_ROUND = {"lighting": True, "ambient": 0.75, "diffuse": 0.45, "specular": 0.0, "smooth_shading": True}
"""Shading of curved walls: pale colours with a visible shape."""
_FEATURE = 35.0
"""Angle between two faces, degrees, above which the shading of their common edge is not smoothed (chosen value:
neighbouring faces of a curved surface differ by a smaller angle)."""


@dataclass(frozen=True)
class Exposure:
    """A drawn panel; arrays (height, width).

    ``colour`` is the image. ``part`` and ``fragment`` are the numbers, from 1, of the nearest part and fragment; 0
    for the background. ``depth`` is in m. ``wall`` is True for pixels that show a wall. ``glass`` has the same
    numbers as ``part``, but it includes transparent parts.
    """

    colour: Any
    part: Any
    fragment: Any
    depth: Any
    glass: Any
    wall: Any


class Studio:
    """A window of fixed size in which frames are drawn one after the other."""

    def __init__(self, size: tuple[int, int], picture: Picture, scale: Scale | None, paper: str) -> None:
        self._picture, self._scale, self._paper = picture, scale, paper
        self._plotter = vtk.window(size, paper)

    def expose(self, shot: Shot, eye: Camera, arrows: Any | None) -> Exposure:
        """Draws the pieces of a frame, its rigid walls, and arrows on the pieces."""
        plotter, pieces = self._plotter, shot.pieces
        plotter.clear()
        labels, table = _labels(pieces)
        self._look(eye)
        solid = [piece.opacity == 1.0 for piece in pieces]
        flat = [self._flat(piece, label) for piece, label in zip(pieces, labels, strict=True)]
        for actor, shown in zip(flat, solid, strict=True):
            actor.SetVisibility(shown)
        number, depth = self._numbers(eye)
        glass = number
        if not all(solid):
            for actor in flat:
                actor.SetVisibility(True)
            glass, _ = self._numbers(eye)
        for actor in flat:
            plotter.remove_actor(actor, reset_camera=False, render=False)
        colour, wall = self._lit(shot, eye, arrows)
        parts, fragments = np.append(0, table[:, 0] + 1), np.append(0, np.arange(len(table)) + 1)
        return Exposure(colour, parts[number], fragments[number], depth, parts[glass], wall)

    def close(self) -> None:
        """Closes the window."""
        self._plotter.close()

    def _flat(self, piece: Piece, label: Any) -> Any:
        """Adds a piece to the window; the colour of each cell encodes the number of the cell."""
        numbers = np.stack([label & 255, label >> 8 & 255, label >> 16], axis=1).astype(np.uint8)
        copy = piece.surface.copy()
        copy.clear_data()
        copy.cell_data["number"] = numbers
        return self._plotter.add_mesh(copy, scalars="number", rgb=True, lighting=False, show_scalar_bar=False,
                                      reset_camera=False)  # fmt: skip

    def _numbers(self, eye: Camera) -> tuple[Any, Any]:
        """Returns two arrays (height, width): the number of the nearest cell group, 0 for the background, and its
        depth, m.
        """
        plotter = self._plotter
        plotter.set_background("black")
        plotter.renderer.ResetCameraClippingRange()
        plotter.render()
        red, green, blue = np.moveaxis(plotter.screenshot(None, return_img=True)[..., :3].astype(np.int32), 2, 0)
        near, far = plotter.camera.clipping_range
        depth = near + (far - near) * vtk.depths(plotter).astype(np.float64)
        plotter.set_background(self._paper)
        return red + (green << 8) + (blue << 16), depth

    def _lit(self, shot: Shot, eye: Camera, arrows: Any | None) -> tuple[Any, Any]:
        """Returns the colour of each pixel, and a mask that is True for pixels of walls."""
        plotter, picture = self._plotter, self._picture
        for position, intensity in _LIGHTS:
            plotter.add_light(vtk.light(position, intensity))
        for piece in shot.pieces:
            self._add(piece)
        if arrows is not None:
            plotter.add_mesh(arrows, color="#1d2733", **_MATTER, reset_camera=False)
        glassy = bool(picture.opacity)
        if glassy:
            plotter.enable_depth_peeling(number_of_peels=8)
        elif not picture.film:  # Ambient occlusion takes 1 s for each picture.
            plotter.enable_ssao(radius=_SHADE * eye.deep, bias=0.1 * _SHADE * eye.deep, kernel_size=64, blur=True)
        plotter.renderer.ResetCameraClippingRange()
        colour = self._taken()
        plotter.disable_depth_peeling() if glassy else plotter.disable_ssao()
        if not shot.walls:
            return colour, np.zeros(colour.shape[:2], bool)
        for wall in shot.walls:
            self._add_wall(shot.points, wall)
        plotter.renderer.ResetCameraClippingRange()
        with_walls = self._taken()
        return with_walls, (with_walls != colour).any(axis=2)

    def _taken(self) -> Any:
        self._plotter.render()
        return np.asarray(self._plotter.screenshot(None, return_img=True))[..., :3]

    def _add(self, piece: Piece) -> None:
        """Adds a piece with the colours of the drawn field."""
        picture, scale, surface = self._picture, self._scale, piece.surface
        raw, field = picture.look.raw, FIELDS[picture.field]
        look = {
            **_MATTER, "show_scalar_bar": False, "reset_camera": False, "opacity": piece.opacity,
            "show_edges": picture.look.edges, "edge_color": "#1d2733", "edge_opacity": 0.35,
        }  # fmt: skip
        smooth = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": _FEATURE} if not raw else {}
        if scale is None:
            surface.cell_data["colours"] = named(field, surface, len(picture.parts))
            flat = {} if field.kind == "fragments" else smooth
            self._plotter.add_mesh(surface, scalars="colours", rgb=True, **look, **flat)
        elif scale.uniform is not None:
            self._plotter.add_mesh(surface, color=scale.colours[0], scalars=None, **look, **smooth)
        else:
            colours = {"cmap": list(scale.colours), "n_colors": len(scale.colours), "clim": (scale.low, scale.high)}
            self._plotter.add_mesh(surface, scalars="shown", **colours, **look, **smooth)

    def _add_wall(self, points: Any, wall: Wall) -> None:
        """Adds a pale wall. The camera is not fitted to walls."""
        matter = {"lighting": False} if wall.shape == "plane" else _ROUND
        self._plotter.add_mesh(walls.surface(points, wall), color=_WALL, opacity=0.55, reset_camera=False, **matter)

    def _look(self, eye: Camera) -> None:
        """Sets a parallel camera outside of the body. The near and the far plane are close to the body, because
        depths have single precision.
        """
        camera = self._plotter.camera
        camera.focal_point = eye.centre
        camera.position = eye.centre + FAR * eye.deep * eye.towards
        camera.up = eye.above
        camera.enable_parallel_projection()
        camera.parallel_scale = eye.half
        self._plotter.camera_set = True


def named(field: Field, surface: Any, bodies: int) -> Any:
    """Returns (cells, 3) colours for parts, ranks or fragments."""
    shown = surface.cell_data["shown"]
    if field.kind == "fragments":
        return part_colours.of_fragments(shown, surface.cell_data["part"], max(bodies, 1))
    return part_colours.of_names(shown)


def _labels(pieces: Sequence[Piece]) -> tuple[list[Any], Any]:
    """Returns two results: for each piece the numbers (cells,) of its fragments, from 1; for all pieces together an
    array (fragments, 2) with the part and the fragment of each number.
    """
    pairs = [
        np.stack([np.full(piece.surface.n_cells, piece.part), np.asarray(piece.surface.cell_data["fragment"])], axis=1)
        for piece in pieces
    ]
    table, which = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    ends = np.cumsum([len(each) for each in pairs])[:-1]
    return np.split(which.reshape(-1) + 1, ends), table
