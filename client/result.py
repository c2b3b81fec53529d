"""Results of a run: outcome, time history, frames, resolved case. Each file is read at its first use."""

import json
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import msgspec

from conoid.cases import outcome
from conoid.cases.figures import si
from conoid.cases.messages import AnyMessage
from conoid.cases.outcome import Outcome
from conoid.cases.output import fragments, layout
from conoid.cases.run import State
from conoid.cases.units import parse_quantity

from .columns import Columns, joined, read_columns
from .drawing.picture import Drawn
from .drawing.planes import Mirror, Wall
from .drawing.scene import Scene, draw
from .drawing.view_options import FILMS
from .errors import ClientError, LookError, NotFoundError, UnfinishedError, ViewError
from .history import read_history
from .journal import from_line
from .local.folders import Folder, LocalFolder
from .reports import html

_TABLE = re.compile(rf"{fragments.FOLDER}/fragments_(\d+)\.csv")
_BEYOND = 0.01
"""Fraction of the simulated time from the first to the last frame by which a requested time may lie outside (chosen
value: a run ends within one step of its end time)."""


class _Part(msgspec.Struct):
    """Fields of a part of the case that pictures use."""

    name: str
    material: str | None = None
    velocity: tuple[float, float, float] | None = None
    mesh: dict[str, Any] = {}
    fracture: dict[str, Any] | None = None


class _Boundary(msgspec.Struct):
    """Fields of a boundary of the case that pictures use. The axis of a plane is a name, that of a wall a vector."""

    kind: str
    axis: Literal["x", "y", "z"] | tuple[float, float, float] | None = None
    at: float = 0.0
    shape: Literal["plane", "cylinder", "sphere"] = "plane"
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] | None = None
    radius: float | None = None
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass: float | None = None
    parts: list[str] | None = None


class _Case(msgspec.Struct):
    """Fields of a case that pictures use. A file with another structure is refused; the error names the wrong field."""

    name: str | None = None
    title: str | None = None
    description: str | None = None
    parts: list[_Part] = []
    boundaries: list[_Boundary] = []


@dataclass(frozen=True)
class FrameFile:
    """A written frame: number, simulated time in s (None if unknown), and file name in the folder of the run."""

    index: int
    time: float | None
    name: str


class Result:
    """Result of a run. Data is read at its first use and kept."""

    def __init__(self, folder: Folder) -> None:
        """Stores the folder of the run; no file is read yet."""
        self.folder = folder

    @classmethod
    def open(cls, path: Path | str) -> "Result":
        """Opens the result in the folder of a run on this machine. Raises NotFoundError if the folder does not
        exist.
        """
        root = Path(path)
        if not root.is_dir():
            raise NotFoundError(f"{root}: this folder does not exist")
        return cls(LocalFolder(root))

    def __repr__(self) -> str:
        """Text with the name of the run."""
        return f"<result of {self.folder.name}>"

    def _repr_html_(self) -> str:
        """State and reference numbers of the run as HTML, for notebooks."""
        try:
            name, ended = str(self.case.get("title") or self.case.get("name")), self.outcome
        except UnfinishedError:
            return html.head(self.folder.name, self.folder.name, None)
        return html.head(self.folder.name, name, ended) + html.references(ended)

    def mesh(self, time: float | None = None) -> Any:
        """Returns the frame nearest to ``time``, s, with all its fields as a pyvista.UnstructuredGrid; None means
        the last frame. Raises UnfinishedError, ViewError if pyvista is not installed.
        """
        try:
            from .drawing.surfaces import read_mesh  # Loaded only if needed, because pyvista loads slowly.
        except ModuleNotFoundError as error:
            raise ViewError(f"meshes need the extra 'view': pip install 'conoid[view]' ({error})") from None
        return read_mesh(self.frame(-1 if time is None else self.nearest(time)))

    @cached_property
    def outcome(self) -> Outcome:
        """The outcome of the run. Raises UnfinishedError before the end of the run."""
        path = self.folder.path(layout.OUTCOME)
        try:
            return outcome_of(path.read_bytes())
        except msgspec.MsgspecError as error:
            raise ClientError(f"{self.folder.named(layout.OUTCOME)}: the outcome cannot be read: {error}") from None

    @cached_property
    def case(self) -> dict[str, Any]:
        """The case with all defaults, in SI units, as plain data. Raises UnfinishedError, ClientError."""
        path = self.folder.path(layout.RESOLVED_CASE)
        try:
            data = msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
            msgspec.convert(data, _Case)
        except (msgspec.MsgspecError, RecursionError) as error:
            raise ClientError(f"{self.folder.named(layout.RESOLVED_CASE)}: the case cannot be read: {error}") from None
        return data

    @cached_property
    def history(self) -> Columns:
        """The columns of history.csv: step, t (s), dt (s), the energies (J), the probes. Warns if rows are missing."""
        text = self.folder.path(layout.HISTORY).read_text("utf-8", "replace")
        return read_history(text, self.folder.named(layout.HISTORY), lambda: self.outcome)

    @cached_property
    def fragment_tables(self) -> list[int]:
        """Numbers of the frames that have a table of fragments."""
        return sorted(int(found[1]) for name in self.folder.names() if (found := _TABLE.fullmatch(name)))

    def fragments_of(self, index: int = -1) -> Columns:
        """Returns the table of fragments of a frame (-1: the last frame). Raises UnfinishedError if the frame has no
        table.
        """
        known = self.fragment_tables
        if not known or (index != -1 and index not in known):
            wanted = "any frame" if index == -1 else f"frame {index}"
            raise UnfinishedError(
                f"{self.folder.name} has no fragments of {wanted}; there are {len(known)} tables of fragments"
            )
        name = f"{fragments.FOLDER}/{fragments.path(Path(), known[-1] if index == -1 else index).name}"
        return read_columns(self.folder.path(name).read_text(encoding="utf-8"))

    @cached_property
    def fragments(self) -> Columns:
        """The fragments of all frames in one table; ``fragments.frame()`` returns a pandas.DataFrame."""
        return joined((index, self.fragments_of(index)) for index in self.fragment_tables)

    @cached_property
    def messages(self) -> list[AnyMessage]:
        """The messages of the run in order, without incomplete lines."""
        found = []
        for line in self.folder.path(layout.JOURNAL).read_bytes().splitlines():
            with suppress(msgspec.DecodeError):
                found.append(from_line(line))
        return found

    @cached_property
    def frames(self) -> list[FrameFile]:
        """The frames, in the order of their numbers."""
        times = self._frame_times()
        names = [name for name in self.folder.names() if name.startswith(f"{layout.FRAMES}/")]
        return [
            FrameFile(int(path.stem), times.get(path.name), path.as_posix())
            for path in sorted(map(Path, names))
            if path.suffix == ".vtkhdf" and path.stem.isdecimal()
        ]

    def frame(self, index: int = -1) -> Path:
        """Returns the path of a frame by its number; -1 means the last frame. Raises UnfinishedError if the frame
        does not exist.
        """
        found = self.frames[-1:] if index == -1 else [frame for frame in self.frames if frame.index == index]
        if not found:
            wanted = "any frame" if index == -1 else f"frame {index}"
            raise UnfinishedError(f"{self.folder.name} has not written {wanted}; it has {len(self.frames)}")
        return self.folder.path(found[0].name)

    def view(
        self,
        field: str = "mises",
        out: Path | str | None = None,
        *,
        frame: int | Sequence[int] | None = None,
        time: float | str | Sequence[float | str] | None = None,
        **options: Any,
    ) -> Drawn:
        """Draws frames as a PNG, several frames side by side, or as a film (``out`` ends in .gif or .mp4). ``frame``
        has the numbers of the frames. ``time`` has times in s or texts such as ``"60 us"``; the nearest frames are
        drawn. Without both, a picture has the last frame and a film has every frame. ``options`` are the fields of
        ``conoid.client.drawing.view_options.Look``. Raises ViewError.
        """
        every = str(out or "").lower().endswith(FILMS)
        if not self.frames:
            self.folder.path(layout.JOURNAL)  # A folder without frames may not be the folder of a run.
            raise UnfinishedError(f"{self.folder.name} has not written any frame")
        chosen = self._chosen(_listed(frame), [seconds(one) for one in _listed(time)], every)
        scene = self.scene()
        if options.get("fixed"):
            scene = replace(scene, frames=tuple(self.frame(one.index) for one in self.frames))
        return draw([self.frame(one) for one in chosen], scene, self.folder.name, field, out, **options)

    def _chosen(self, frames: Sequence[int], times: Sequence[float], every: bool) -> list[int]:
        """Returns the numbers of the requested frames, in the order of the request."""
        if not frames and not times:
            return [one.index for one in self.frames] if every else [-1]
        return [*frames, *(self.nearest(time) for time in times)]

    def nearest(self, time: float) -> int:
        """Returns the number of the frame nearest to ``time``, s. Raises UnfinishedError, ViewError."""
        known = {one.time: one.index for one in self.frames if one.time is not None}
        if not known:
            raise UnfinishedError(f"{self.folder.name} has no frame with a known time")
        first, last = min(known), max(known)
        if not first - _BEYOND * (last - first) <= time <= last + _BEYOND * (last - first):
            range_of_frames = f"the frames of {self.folder.name} have times from {si(first, 's')} to {si(last, 's')}"
            raise LookError(f"time = {si(time, 's')}: {range_of_frames}")
        return known[min(known, key=lambda at: abs(at - time))]

    def scene(self) -> Scene:
        """Returns the data of the case that a picture uses; empty if the run has no readable case."""
        try:
            case = self.case
        except ClientError:
            return Scene()
        boundaries: list[dict[str, Any]] = case.get("boundaries", [])
        return Scene(
            mirrors=tuple(
                Mirror("xyz".index(one["axis"]), float(one.get("at", 0.0)))
                for one in boundaries
                if one["kind"] == "symmetry" and not one.get("parts")
            ),
            walls=tuple(_wall(one) for one in boundaries if one["kind"] == "wall"),
            parts=tuple(part["name"] for part in case.get("parts", [])),
            title=str(case.get("title") or case.get("name") or ""),
        )

    def _frame_times(self) -> dict[str, float]:
        try:
            text = self.folder.path(f"{layout.FRAMES}/{layout.FRAME_SERIES}").read_bytes()
            return {entry["name"]: float(entry["time"]) for entry in json.loads(text)["files"]}
        except (UnfinishedError, ValueError, KeyError, TypeError):
            return {}


def _wall(boundary: dict[str, Any]) -> Wall:
    """Returns the wall for a boundary of the kind ``wall``."""
    moves = any(boundary.get("velocity") or ()) or boundary.get("mass") is not None
    along = boundary.get("normal") or boundary.get("axis") or (0.0, 0.0, 1.0)
    shape, radius = boundary.get("shape", "plane"), float(boundary.get("radius") or 0.0)
    return Wall(tuple(boundary["point"]), tuple(along), shape, radius, moves)


def outcome_of(text: bytes) -> Outcome:
    """Decodes an outcome. Raises msgspec.MsgspecError if the data or the state of the run is unknown."""
    ended = outcome.from_json(text)
    msgspec.convert(ended.state, State)
    return ended


def seconds(time: object) -> float:
    """Returns a time in s from a number or a text with a unit, such as ``60 us``. Raises LookError without a unit."""
    try:
        if not isinstance(time, str) or time.strip()[-1:].isalpha():
            return parse_quantity(time, "s")
        reason = "write the time with its unit, such as '60 us'"
    except ValueError as error:
        reason = str(error)
    raise LookError(f"time = {time!r}: {reason}")


def _listed(value: float | str | Sequence[Any] | None) -> Sequence[Any]:
    if value is None:
        return ()
    return value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
