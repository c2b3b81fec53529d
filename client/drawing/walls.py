"""Rigid walls in pictures: positions of the walls in a frame, and surfaces of the walls."""

from typing import Any

import msgspec
import numpy as np

from . import vtk
from .picture import Picture
from .planes import Wall


def placed(mesh: Any, picture: Picture) -> list[Wall]:
    """Returns the walls of a picture at the time of a frame. A moving wall is left out if the frame does not have
    its position.
    """
    if "wall_position" not in mesh.field_data:
        return [wall for wall in picture.walls if not wall.moves]
    places = np.asarray(mesh.field_data["wall_position"], float).reshape(-1, 3)
    return [
        msgspec.structs.replace(wall, point=tuple(place.tolist()))
        for wall, place in zip(picture.walls, places, strict=False)
    ]


def surface(points: Any, wall: Wall) -> Any:
    """Returns the surface of a wall: for a plane a disk a little larger than the body with the ``points`` (n, 3),
    for a cylinder a side surface a little longer than the body, or a sphere.
    """
    along = np.asarray(wall.direction) / np.linalg.norm(wall.direction)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    if wall.shape == "sphere":
        return vtk.ball(wall.point, wall.radius)
    heights = (points - centre) @ along
    if wall.shape == "cylinder":
        foot = np.asarray(wall.point) + ((centre - np.asarray(wall.point)) @ along) * along
        return vtk.tube(foot, along, wall.radius, 1.35 * float(np.ptp(heights)))
    across = points - centre
    radius = 1.35 * float(np.linalg.norm(across - np.outer(heights, along), axis=1).max())
    foot = centre - ((centre - np.asarray(wall.point)) @ along + 2e-3 * radius) * along
    return vtk.disk(foot, along, radius)
