"""Films: a sequence of images in one file. Pillow writes GIF, ffmpeg writes MP4."""

import shutil
import subprocess
from collections.abc import Iterator
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any

from PIL import Image

from ..errors import ViewError

_LOOKED_AT = 5
"""Number of frames, distributed evenly over the film, from which the 256 colours of a GIF are taken (chosen value)."""


def save(images: Iterator[Any], n: int, rate: float, out: Path) -> None:
    """Writes ``n`` images of equal size as a film with ``rate`` images per second. Raises ViewError for an MP4
    without ffmpeg.
    """
    if out.suffix.lower() == ".gif":
        _gif(list(images), rate, out)
    else:
        _mp4(images, rate, out)


def _gif(images: list[Any], rate: float, out: Path) -> None:
    """Writes a GIF. All frames use one palette, so that a colour keeps its meaning over the film."""
    some = [images[k * (len(images) - 1) // max(_LOOKED_AT - 1, 1)] for k in range(_LOOKED_AT)]
    width, height = images[0].size
    strip = Image.new("RGB", (width, height * len(some)))
    for n, image in enumerate(some):
        strip.paste(image.convert("RGB"), (0, n * height))
    palette = strip.quantize(256, method=Image.Quantize.MEDIANCUT)
    first, *others = (image.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    first.save(out, save_all=True, append_images=others, duration=round(1000.0 / rate), loop=0, disposal=2)


def _mp4(images: Iterator[Any], rate: float, out: Path) -> None:
    """Writes an MP4 with H.264 in a form that browsers and presentations can play. Width and height are even numbers
    of pixels.
    """
    first = next(images)
    width, height = (side - side % 2 for side in first.size)
    command = [
        ffmpeg(), "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
        "-r", f"{rate:g}", "-i", "-", "-an", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
        "-movflags", "+faststart", str(out),
    ]  # fmt: skip
    frames = (image.convert("RGB").crop((0, 0, width, height)).tobytes() for image in chain([first], images))
    done = subprocess.run(command, input=b"".join(frames), capture_output=True, check=False)
    if done.returncode:
        errors = done.stderr.decode(errors="replace").strip().splitlines()
        raise ViewError(f"ffmpeg could not write the film: {errors[-1] if errors else f'code {done.returncode}'}")


def ffmpeg() -> str:
    """Returns the path of the program ffmpeg, which writes MP4 files. Raises ViewError if ffmpeg is not installed."""
    if found := shutil.which("ffmpeg"):
        return found
    try:
        return str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        raise ViewError(
            "an .mp4 needs ffmpeg: install it with pip install imageio-ffmpeg or with your system; a .gif needs no "
            "ffmpeg"
        ) from None
