"""The survey of the mesh files of a case, made by a program of the worker, for the checks and the estimate of the
case."""

import importlib.util
from pathlib import Path
from typing import Any

import msgspec

from ..shapes.geometry import Vector
from ..shapes.load import Load
from ..shapes.placed import Bulk
from ..warnings.touching import Touch

PROGRAM = "conoid.worker.scene.survey"
"""The program that surveys mesh files, one process per case."""


def installed() -> bool:
    """Whether the survey program can be started on this machine."""
    return all(importlib.util.find_spec(name) is not None for name in ("conoid.worker", "numpy"))


class Question(msgspec.Struct, kw_only=True, frozen=True):
    """A case as plain data, and the folder to which the paths of the case's mesh files are relative."""

    case: dict[str, Any]
    folder: str


class Surveyed(msgspec.Struct, kw_only=True, frozen=True):
    """Survey of one part with a mesh from a file, at its initial position, in SI units."""

    part: int
    """Index of the part in the case."""
    elements: int
    nodes: int
    faces: int
    """Number of surface nodes of the part."""
    step_length: float
    """Smallest value of 1 / sqrt(sum |grad N|^2) of the tets of the part, m."""
    altitude: float
    """Smallest altitude of the tets of the part, m."""
    mass: float
    low: Vector
    high: Vector
    """Corners of the bounding box of the part."""
    momentum: Vector
    energy: float
    """Kinetic energy of the part at the start, J, without the random velocities of ``jitter``."""
    speed: float
    """Largest speed of a node, m/s."""
    notes: list[str]
    """Contents of the mesh file that are not in the mesh, or that are interpreted in an unusual way."""

    @property
    def bulk(self) -> Bulk:
        """Mass, bounding box, momentum, energy and speed of the part, in the same form as for a generated part."""
        return Bulk(self.mass, self.low, self.high, self.momentum, self.energy, self.speed)


class Survey(msgspec.Struct, kw_only=True, frozen=True):
    """Survey of the mesh files of a case, with a line for every reason why a run of the case would be refused."""

    parts: list[Surveyed] = []
    loads: list[Load] = []
    """Loads of tractions and prescribed velocities that act only on parts from mesh files."""
    refused: list[str] = []
    touching: list[Touch] = []
    """Pairs of touching parts, at least one of which has a mesh from a file."""
    warnings: list[str] = []
    """Warnings about the meshes, one line each, as a run of the case gives them."""

    def of(self, part: int) -> Surveyed | None:
        """Returns the survey of part ``part``; None if the mesh of the part is generated, or was not read."""
        return next((each for each in self.parts if each.part == part), None)


def question(case: dict[str, Any], folder: Path) -> bytes:
    """Returns the bytes for the standard input of the survey process (worker/scene/survey.py)."""
    return msgspec.json.encode(Question(case=case, folder=str(folder.resolve())))


def read_question(data: bytes) -> Question:
    """Reads the standard input of the survey program. Raises msgspec.MsgspecError if the input is damaged."""
    return msgspec.json.decode(data, type=Question)


def to_json(survey: Survey) -> bytes:
    """Returns the standard output of the survey program."""
    return msgspec.json.encode(survey)


def from_json(data: bytes) -> Survey:
    """Reads the standard output of the survey program. Raises msgspec.MsgspecError if the output is damaged."""
    return msgspec.json.decode(data, type=Survey)
