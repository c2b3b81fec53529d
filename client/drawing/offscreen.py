"""Draws the pieces of a frame off screen: their colours in light, and what is where, by number and by depth."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import part_colours, vtk
from .camera import Camera
from .fields import FIELDS, Field
from .picture import Picture
from .planes import Wall
from .scales import Scale
from .surfaces import Piece

FAR = 4.0
"""How far the camera stands, in reaches of the body. Chosen: beyond walls."""
_SHADE = 0.04
"""Of the reach of the body, that deep hollows are darker up to this distance. Chosen."""
_LIGHTS = ((-0.7, 0.9, 1.6), 0.66), ((1.3, 0.2, 1.0), 0.34)
"""A key light from the upper left and a weaker one from the right."""
_WALL = "#aab6c3"
_MATTER = {"ambient": 0.45, "diffuse": 0.85, "specular": 0.10, "specular_power": 20.0}
_FEATURE = 35.0
"""Degrees by which faces are bent where the light on them is not smoothed. Chosen: more than a curved face has."""


@dataclass(frozen=True)
class Exposure:
    """A panel as it was drawn, arrays (height, width): colours, the number of the part and of the fragment that are
    nearest, from 1 on and 0 for the ground, their depth in m, whether a wall is there; ``glass`` as ``part`` with what
    can be seen through.
    """

    colour: Any
    part: Any
    fragment: Any
    depth: Any
    glass: Any
    wall: Any


class Studio:
    """A window of one size, in which one frame after the other is drawn."""

    def __init__(self, size: tuple[int, int], picture: Picture, scale: Scale | None, paper: str) -> None:
        self._picture, self._scale, self._paper = picture, scale, paper
        self._plotter = vtk.window(size, paper)

    def expose(self, pieces: Sequence[Piece], eye: Camera, arrows: Any | None) -> Exposure:
        """Draws the pieces of a frame, and arrows on them."""
        plotter = self._plotter
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
        colour, wall = self._lit(pieces, eye, arrows)
        parts, fragments = np.append(0, table[:, 0] + 1), np.append(0, np.arange(len(table)) + 1)
        return Exposure(colour, parts[number], fragments[number], depth, parts[glass], wall)

    def close(self) -> None:
        """Ends the window."""
        self._plotter.close()

    def _flat(self, piece: Piece, label: Any) -> Any:
        """The piece, each cell in the colour of its number."""
        numbers = np.stack([label & 255, label >> 8 & 255, label >> 16], axis=1).astype(np.uint8)
        copy = piece.surface.copy()
        copy.clear_data()
        copy.cell_data["number"] = numbers
        return self._plotter.add_mesh(copy, scalars="number", rgb=True, lighting=False, show_scalar_bar=False,
                                      reset_camera=False)  # fmt: skip

    def _numbers(self, eye: Camera) -> tuple[Any, Any]:
        """(height, width) the number that is nearest, 0 for the ground, and its depth, m."""
        plotter = self._plotter
        plotter.set_background("black")
        plotter.renderer.ResetCameraClippingRange()
        plotter.render()
        red, green, blue = np.moveaxis(plotter.screenshot(None, return_img=True)[..., :3].astype(np.int32), 2, 0)
        near, far = plotter.camera.clipping_range
        depth = near + (far - near) * vtk.depths(plotter).astype(np.float64)
        plotter.set_background(self._paper)
        return red + (green << 8) + (blue << 16), depth

    def _lit(self, pieces: Sequence[Piece], eye: Camera, arrows: Any | None) -> tuple[Any, Any]:
        """The colours, and where a wall is drawn."""
        plotter, picture = self._plotter, self._picture
        for position, intensity in _LIGHTS:
            plotter.add_light(vtk.light(position, intensity))
        for piece in pieces:
            self._add(piece)
        if arrows is not None:
            plotter.add_mesh(arrows, color="#1d2733", **_MATTER, reset_camera=False)
        glassy = bool(picture.opacity)
        if glassy:
            plotter.enable_depth_peeling(number_of_peels=8)
        elif not picture.film:  # a second a picture
            plotter.enable_ssao(radius=_SHADE * eye.deep, bias=0.1 * _SHADE * eye.deep, kernel_size=64, blur=True)
        plotter.renderer.ResetCameraClippingRange()
        colour = self._taken()
        plotter.disable_depth_peeling() if glassy else plotter.disable_ssao()
        if not picture.walls:
            return colour, np.zeros(colour.shape[:2], bool)
        for wall in picture.walls:
            self._add_wall(pieces, wall)
        plotter.renderer.ResetCameraClippingRange()
        with_walls = self._taken()
        return with_walls, (with_walls != colour).any(axis=2)

    def _taken(self) -> Any:
        self._plotter.render()
        return np.asarray(self._plotter.screenshot(None, return_img=True))[..., :3]

    def _add(self, piece: Piece) -> None:
        """The piece in its colours."""
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

    def _add_wall(self, pieces: Sequence[Piece], wall: Wall) -> None:
        """A pale disk in the wall, a little larger than the body; it takes no part in the fit of the camera."""
        normal = np.asarray(wall.normal) / np.linalg.norm(wall.normal)
        points = np.concatenate([np.asarray(piece.surface.points, float) for piece in pieces])
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        across = points - centre
        radius = 1.35 * float(np.linalg.norm(across - np.outer(across @ normal, normal), axis=1).max())
        foot = centre - ((centre - np.asarray(wall.point)) @ normal + 2e-3 * radius) * normal
        self._plotter.add_mesh(
            vtk.disk(foot, normal, radius), color=_WALL, opacity=0.55, lighting=False, reset_camera=False
        )

    def _look(self, eye: Camera) -> None:
        """Parallel, far enough that everything lies before it, and no farther: depths are of single precision."""
        camera = self._plotter.camera
        camera.focal_point = eye.centre
        camera.position = eye.centre + FAR * eye.deep * eye.towards
        camera.up = eye.above
        camera.enable_parallel_projection()
        camera.parallel_scale = eye.half
        self._plotter.camera_set = True


def named(field: Field, surface: Any, bodies: int) -> Any:
    """(cells, 3) the colours of parts, ranks or fragments."""
    shown = surface.cell_data["shown"]
    if field.kind == "fragments":
        return part_colours.of_fragments(shown, surface.cell_data["part"], max(bodies, 1))
    return part_colours.of_names(shown)


def _labels(pieces: Sequence[Piece]) -> tuple[list[Any], Any]:
    """Of each piece (cells,) numbers from 1 on for its fragments, and (fragments, 2) part and fragment of each."""
    pairs = [
        np.stack([np.full(piece.surface.n_cells, piece.part), np.asarray(piece.surface.cell_data["fragment"])], axis=1)
        for piece in pieces
    ]
    table, which = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    ends = np.cumsum([len(each) for each in pairs])[:-1]
    return np.split(which.reshape(-1) + 1, ends), table
