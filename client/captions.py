"""What stands beside a picture: its title, the colour bar with the extremes, the legend. For a plotter of pyvista."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from conoid.cases.figures import exacts

from . import sheet
from .pictures import FIELDS, Picture

INK, PAPER = "#1d2733", "#ffffff"
_BAR = {
    "vertical": True, "position_x": 0.05, "position_y": 0.2, "width": 0.30, "height": 0.6, "title": "",
    "color": INK, "font_family": "arial", "fmt": " %.4g",
}  # fmt: skip

Scale: TypeAlias = tuple[float, float, int] | None
"""Ends of the colour bar and its labels; None where colours are names."""


def add_title(plotter: Any, title: str, picture: Picture) -> None:
    """Above all panels."""
    plotter.subplot(0, 0)
    width, height = picture.look.size
    size = min(sheet.font(15, height), max(6, round(1.05 * width / len(title))))
    plotter.add_text(title, position=(0.02, 0.3), viewport=True, font_size=size, color=INK)


def add_side(plotter: Any, picture: Picture, scale: Scale, drawn: Any, values: Sequence[Any]) -> None:
    """The colour bar with the extremes of the values, or the legend."""
    height, field = picture.look.size[1], FIELDS[picture.field]
    if scale is None:
        names = sheet.legend(values, picture)
        size = (0.85, 0.035 * len(names) + 0.01)
        plotter.add_legend(names, face="rectangle", bcolor=None, border=False, loc="upper left", size=size)
        return
    plotter.add_scalar_bar(**_BAR, n_labels=scale[2], label_font_size=sheet.font(26, height), mapper=drawn.mapper)
    name = f"{field.label}\n{field.unit}" if field.unit else field.label
    plotter.add_text(name, position=(0.02, 0.85), viewport=True, font_size=sheet.font(13, height), color=INK)
    low, high = min(float(np.min(each)) for each in values), max(float(np.max(each)) for each in values)
    if low < scale[0] or high > scale[1]:
        text = "values from {}\nto {}".format(*exacts((low, high), "", 4))
        plotter.add_text(text, position=(0.02, 0.11), viewport=True, font_size=sheet.font(9, height), color=INK)
