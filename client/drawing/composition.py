"""Composition of a picture from panels and captions."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from PIL import Image

from conoid.cases.figures import count, counted, exact

from . import arrows, captions, outlines, picture_layout
from .captions import Painter
from .fields import FIELDS
from .offscreen import Studio
from .picture import Picture
from .scales import Scale, rgb
from .shot import Shot

_FINE, _FINEST = 2, 4096
"""Factor by which a picture is drawn larger and then reduced, and largest width or height of a picture in pixels for
which this is done (chosen values)."""
_LINE = rgb(captions.LIGHT.ink)
_GLASS = 0.55
"""Opacity of rigid walls in a picture with a transparent background."""


class Printer:
    """Composes images from shots. An image of a film has one shot; any other picture has all shots side by side."""

    def __init__(self, picture: Picture, shots: Sequence[Shot], scale: Scale | None) -> None:
        self._picture, self._shots, self._scale = picture, shots, scale
        self._legend: list[tuple[str, str]] = []
        self._note = ""
        self._laid = self._lay(1 if picture.film else len(shots))
        size = self._laid.panels[0][2:]
        self._fine = _FINE if _FINE * max(size) <= _FINEST else 1
        self._ground = captions.DARK if picture.look.dark else captions.LIGHT
        self._studio = Studio((self._fine * size[0], self._fine * size[1]), picture, scale, self._ground.paper)
        self._clear = picture.look.transparent and not picture.film
        self._longest = arrows.longest(shots) if picture.look.vectors else 0.0
        self.beyond = max(shot.beyond(self._inside) for shot in shots)
        """Largest number of pieces of debris outside of the picture, over all shots."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._studio.close()

    def image(self, shots: Sequence[Shot]) -> Any:
        """Composes one image with a panel for each shot."""
        look = self._picture.look
        clear = self._clear
        image = Image.new("RGBA" if clear else "RGB", look.size, (0, 0, 0, 0) if clear else self._ground.paper)
        for shot, box in zip(shots, self._laid.panels, strict=True):
            image.paste(self._panel(shot), box[:2])
        self._write(image, shots)
        return image

    # The panels ---------------------------------------------------------------------------------------------------

    def _panel(self, shot: Shot) -> Any:
        """Draws one panel with its lines at a larger size, and reduces the panel to its final size."""
        laid, look = self._laid, self._picture.look
        on = arrows.on(shot, laid.eye, laid.aspect, self._longest) if look.vectors else None
        exposure = self._studio.expose(shot, laid.eye, on)
        colours = np.asarray(exposure.colour, float)
        if look.outlines and not look.edges:
            dark = outlines.lines(exposure, laid.pixel / self._fine, round(self._fine * laid.panels[0][3]))[..., None]
            colours += dark * (np.array(_LINE, float) - colours)
        solid = np.maximum(exposure.glass > 0, _GLASS * exposure.wall)[..., None]
        layers = np.concatenate([colours * solid, 255.0 * solid], axis=2) if self._clear else colours
        return Image.fromarray(_smaller(layers, self._fine, self._clear))

    def _inside(self, places: Any) -> Any:
        """Returns (n,) True for the points of ``places`` (n, 3) that lie inside of a panel."""
        eye = self._laid.eye
        seen = places - eye.centre
        return (np.abs(seen @ eye.right) < eye.half * self._laid.aspect) & (np.abs(seen @ eye.above) < eye.half)

    # The captions -------------------------------------------------------------------------------------------------

    def _lay(self, n: int) -> picture_layout.Sheet:
        picture, shots, head, side = self._picture, self._shots, 0, 0
        field, size = FIELDS[picture.field], picture_layout.font(picture.look)
        if picture_layout.captioned(picture):
            head = round(2.6 * size) if picture.title or n == 1 else 0
            if self._scale is not None:
                side = captions.beside_bar(field, self._scale, size)
            else:
                self._legend = captions.entries(picture.field, _present(picture, shots), picture.parts)
                self._note = _counted(shots) if field.kind == "fragments" else ""
                side = captions.beside_legend(self._legend, self._note, size)
        near, every = [shot.near(picture.focus) for shot in shots], [shot.points for shot in shots]
        return picture_layout.lay(near, every, n, picture, head, side)

    def _write(self, image: Any, shots: Sequence[Shot]) -> None:
        picture, laid, field = self._picture, self._laid, FIELDS[self._picture.field]
        neutral = self._clear and not picture.look.captions
        painter = Painter(image, laid, captions.NEUTRAL if neutral else self._ground)
        times = dict(zip(map(id, self._shots), picture_layout.when([shot.time for shot in self._shots]), strict=True))
        whens = [times[id(shot)] for shot in shots]
        last = len(shots) - 1
        if min(picture.look.size) >= picture_layout.LEAST:
            painter.triad(laid.panels[last - last % laid.columns])
            if picture.look.scale:
                painter.length(laid.panels[last])
        if len(shots) > 1:
            for box, when in zip(laid.panels, whens, strict=True):
                painter.when(box, when)
        if not picture_layout.captioned(picture):
            return
        painter.notes(laid.panels[last - last % laid.columns], self._notes())
        if laid.head[3]:
            painter.title(picture.title, whens[0] if len(shots) == 1 else "")
        if self._scale is None:
            painter.legend(self._legend, _counted(shots) if field.kind == "fragments" else "")
        else:
            every = [shot.shown for shot in self._shots]
            painter.bar(field, self._scale, (min(map(np.min, every)), max(map(np.max, every))))

    def _notes(self) -> list[str]:
        """Returns the notes about arrows and about debris outside of the picture."""
        notes = []
        if self._longest > 0.0:
            unit = {"velocity": "m/s", "displacement": "m"}[self._picture.look.vectors]
            notes.append(f"arrows: {self._picture.look.vectors}, longest {exact(self._longest, unit, 3)}")
        if self.beyond:
            notes.append(f"{counted(self.beyond, 'piece')} outside the picture")
        return notes


def _present(picture: Picture, shots: Sequence[Shot]) -> list[int]:
    """Returns the numbers of the parts or ranks that the shots show."""
    if picture.field == "rank":
        return sorted({int(n) for shot in shots for n in np.unique(shot.shown)})
    return sorted({piece.part for shot in shots for piece in shot.pieces})


def _counted(shots: Sequence[Shot]) -> str:
    """Returns a text with the number of fragments that are visible in the shots."""
    most = [len(np.unique(shot.shown)) for shot in shots]
    return counted(most[0], "fragment") if len(most) == 1 else f"{count(most[0])} to {counted(most[-1], 'fragment')}"


def _smaller(layers: Any, fine: int, clear: bool) -> Any:
    """Returns (height, width, 3 or 4) bytes: means over squares of ``fine`` by ``fine`` pixels. Colours are weighted
    by opacity.
    """
    height, width, depth = layers.shape
    blocks = layers.reshape(height // fine, fine, width // fine, fine, depth).mean(axis=(1, 3))
    if clear:
        blocks[..., :3] /= np.maximum(blocks[..., 3:] / 255.0, 1e-6)
    return np.floor(blocks.clip(0.0, 255.0) + 0.5).astype(np.uint8)
