"""The survey of the mesh files of a case: data for the checks and the estimate of the case. A program of the worker
reads the files and makes the survey.
"""

import importlib.util
from pathlib import Path
from typing import Any

import msgspec

from ..shapes.geometry import Vector
from ..shapes.load import Load
from ..shapes.placed import Bulk
from ..warnings.touching import Touch

PROGRAM = "conoid.worker.scene.survey"
"""Module of the program that surveys mesh files; it runs as one process per case."""


def installed() -> bool:
    """Whether the survey program can be started on this machine."""
    return all(importlib.util.find_spec(name) is not None for name in ("conoid.worker", "numpy"))


class Question(msgspec.Struct, kw_only=True, frozen=True):
    """The question to the survey program: a case as plain data, and the folder to which the paths of its mesh files are
    relative.
    """

    case: dict[str, Any]
    folder: str


class Surveyed(msgspec.Struct, kw_only=True, frozen=True):
    """Survey of one part with a mesh from a file, at its initial position, in SI units."""

    part: int
    """Index of the part in the case."""
    elements: int
    nodes: int
    faces: int
    """Number of surface faces of the part."""
    step_length: float
    """Smallest step length 1 / sqrt(sum |grad N|^2) of the tets of the part, m."""
    altitude: float
    """Smallest altitude of the tets of the part, m."""
    mass: float
    low: Vector
    high: Vector
    """Corners of the bounding box of the part, m."""
    momentum: Vector
    energy: float
    """Kinetic energy of the part at the start, J, without the random velocities of ``jitter``."""
    speed: float
    """Largest speed of a node of the part at the start, m/s."""
    notes: list[str]
    """Contents of the mesh file that are not used, or that are interpreted in an unusual way."""

    @property
    def bulk(self) -> Bulk:
        """Mass, bounding box, momentum, energy and speed of the part in the form that generated parts have, too."""
        return Bulk(self.mass, self.low, self.high, self.momentum, self.energy, self.speed)


class Survey(msgspec.Struct, kw_only=True, frozen=True):
    """Survey of the mesh files of a case, and every reason for which a run of the case would be refused, one line
    each.
    """

    parts: list[Surveyed] = []
    loads: list[Load] = []
    """Loads of tractions and prescribed velocities that act only on parts from mesh files."""
    refused: list[str] = []
    touching: list[Touch] = []
    """Pairs of touching parts, at least one of which has a mesh from a file."""
    warnings: list[str] = []
    """Warnings about the meshes, one line each; a run of the case gives the same warnings."""

    def of(self, part: int) -> Surveyed | None:
        """Returns the survey of the part with the index ``part``; None if its mesh is generated or was not read."""
        return next((each for each in self.parts if each.part == part), None)


def question(case: dict[str, Any], folder: Path) -> bytes:
    """Returns the question to the survey program as bytes for its standard input (worker/scene/survey.py)."""
    return msgspec.json.encode(Question(case=case, folder=str(folder.resolve())))


def read_question(data: bytes) -> Question:
    """Returns the question from the standard input of the survey program. Raises msgspec.MsgspecError if the data is
    invalid.
    """
    return msgspec.json.decode(data, type=Question)


def to_json(survey: Survey) -> bytes:
    """Returns the survey as bytes for the standard output of the survey program."""
    return msgspec.json.encode(survey)


def from_json(data: bytes) -> Survey:
    """Returns the survey from the standard output of the survey program. Raises msgspec.MsgspecError if the data is
    invalid.
    """
    return msgspec.json.decode(data, type=Survey)
