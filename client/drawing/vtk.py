"""All functions that use pyvista: meshes, lights and the off-screen window. Only this module imports pyvista."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv

from ..errors import ViewError
from .frame import require_whole


def read(path: str) -> tuple[Any, float | None]:
    """Reads the whole mesh of a frame, with its pieces merged, and the time of the frame, s. Raises ViewError for a
    damaged frame.
    """
    require_whole(path)
    mesh = pv.read(path)
    data = mesh.field_data
    if isinstance(mesh, pv.PartitionedDataSet | pv.MultiBlock):
        pieces = [piece for piece in mesh if piece is not None and piece.n_cells]
        data = pieces[0].field_data if pieces and "time" not in data else data
        mesh = pv.merge(pieces, merge_points=False)
    if mesh.n_cells == 0:
        raise ViewError(f"{path}: the frame has no elements")
    return mesh, float(np.ravel(data["time"])[0]) if "time" in data else None


def bare(mesh: Any) -> Any:
    """Returns a copy of a mesh with points in double precision and without fields."""
    return pv.UnstructuredGrid(mesh.cells, mesh.celltypes, np.asarray(mesh.points, dtype=float))


def joined(surfaces: Sequence[Any]) -> Any:
    """Merges surfaces; points at the same position become one point."""
    return pv.merge(list(surfaces), merge_points=True).extract_surface(algorithm="dataset_surface")


def window(size: tuple[int, int], ground: str) -> Any:
    """Returns an off-screen window without anti-aliasing, because pictures are drawn larger and then reduced."""
    plotter: Any = pv.Plotter(off_screen=True, window_size=list(size), lighting="none", border=False)
    plotter.set_background(ground)
    plotter.render_window.SetMultiSamples(0)
    return plotter


def light(position: Sequence[float], intensity: float) -> Any:
    """Returns a light that moves with the camera."""
    return pv.Light(position=position, intensity=intensity, light_type="camera light")


def disk(centre: Any, normal: Any, radius: float) -> Any:
    """Returns a flat circular disk with a centre, a normal and a radius."""
    return pv.Disc(center=centre, inner=0.0, outer=radius, normal=normal, r_res=1, c_res=96)


def tube(centre: Any, axis: Any, radius: float, height: float) -> Any:
    """Returns the side surface of a cylinder, open at both ends."""
    return pv.Cylinder(center=centre, direction=axis, radius=radius, height=height, resolution=96, capping=False)


def ball(centre: Any, radius: float) -> Any:
    """Returns the surface of a sphere."""
    return pv.Sphere(radius=radius, center=centre, theta_resolution=72, phi_resolution=48)


def arrows(places: Any, vectors: Any, factor: float) -> Any:
    """Returns arrows at ``places`` along ``vectors``, both (n, 3); ``factor`` scales their lengths."""
    cloud = pv.PolyData(places)
    cloud["vector"] = vectors
    shape = pv.Arrow(tip_length=0.26, tip_radius=0.075, shaft_radius=0.022, tip_resolution=12, shaft_resolution=8)
    return cloud.glyph(orient="vector", scale="vector", factor=factor, geom=shape)


def depths(plotter: Any) -> Any:
    """Returns the depth (height, width) of the last drawing: 0 at the near plane, 1 at the far plane and at the
    background.
    """
    width, height = plotter.window_size
    flat = pv._vtk.vtkFloatArray()
    plotter.render_window.GetZbufferData(0, 0, width - 1, height - 1, flat)
    return np.asarray(pv.convert_array(flat)).reshape(height, width)[::-1]
