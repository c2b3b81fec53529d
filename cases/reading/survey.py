"""What the mesh files of a case hold: read by a program of the worker, told to whoever checks the case."""

import importlib.util
from pathlib import Path
from typing import Any

import msgspec

from ..shapes.geometry import Vector
from ..shapes.loaded import Load
from ..shapes.placed import Bulk
from ..warnings.touching import Touch

PROGRAM = "conoid.worker.scene.survey"
"""The program that reads mesh files, one case a process."""


def installed() -> bool:
    """Whether it can be started here."""
    return all(importlib.util.find_spec(name) is not None for name in ("conoid.worker", "numpy"))


class Question(msgspec.Struct, kw_only=True, frozen=True):
    """A case, as plain data, and the folder in which relative paths of its mesh files start."""

    case: dict[str, Any]
    folder: str


class Surveyed(msgspec.Struct, kw_only=True, frozen=True):
    """One part whose mesh is from a file, where it is at the start. SI units."""

    part: int
    """Its number in the case."""
    elements: int
    nodes: int
    faces: int
    """Of its surface."""
    step_length: float
    """Smallest 1 / sqrt(sum |grad N|^2) of its tets, m."""
    altitude: float
    """Smallest altitude of its tets, m."""
    mass: float
    low: Vector
    high: Vector
    """Corners of the box round it."""
    momentum: Vector
    energy: float
    """Kinetic, without jitter."""
    speed: float
    """The largest of a node."""
    notes: list[str]
    """What of the file is not in the mesh, or is taken otherwise than one might think."""

    @property
    def bulk(self) -> Bulk:
        """What it brings along, as of a part that is generated."""
        return Bulk(self.mass, self.low, self.high, self.momentum, self.energy, self.speed)


class Survey(msgspec.Struct, kw_only=True, frozen=True):
    """What the mesh files of a case hold, and every reason why a run of it would be refused, a line each."""

    parts: list[Surveyed] = []
    loads: list[Load] = []
    """Of the tractions and prescribed velocities that are for parts from mesh files alone."""
    refused: list[str] = []
    touching: list[Touch] = []
    """Of the pairs of parts at least one of which has a mesh from a file."""
    told: list[str] = []
    """Warnings that the meshes themselves give rise to, a line each, as a run gives them."""

    def of(self, part: int) -> Surveyed | None:
        """What is known of part ``part``; None where its mesh is generated, or was not read."""
        return next((each for each in self.parts if each.part == part), None)


def question(case: dict[str, Any], folder: Path) -> bytes:
    """What the program reads on its standard input."""
    return msgspec.json.encode(Question(case=case, folder=str(folder.resolve())))


def read_question(data: bytes) -> Question:
    """The same, read. Raises msgspec.MsgspecError."""
    return msgspec.json.decode(data, type=Question)


def to_json(survey: Survey) -> bytes:
    """What the program writes on its standard output."""
    return msgspec.json.encode(survey)


def from_json(data: bytes) -> Survey:
    """The same, read. Raises msgspec.MsgspecError."""
    return msgspec.json.decode(data, type=Survey)
