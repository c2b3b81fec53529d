"""Check of a case before it runs: errors, warnings, cost.

A program of the worker, if it is installed, reads mesh files in a process of its own.
"""

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from conoid.cases.checks.mesh_checks import missing_files
from conoid.cases.estimates.estimate import Estimate, estimate
from conoid.cases.load import CaseError, parse_case
from conoid.cases.model.schema import Case
from conoid.cases.model.solids import Measured
from conoid.cases.reading import survey
from conoid.cases.reading.problems import Problem, problem
from conoid.cases.reading.survey import Survey
from conoid.cases.warnings.plausible import bare_numbers
from conoid.cases.warnings.touching import Touch
from conoid.cases.warnings.touching import touching as touches
from conoid.cases.warnings.warned import warned

from .errors import ClientError


@dataclass(frozen=True)
class Examination:
    """A valid case: ``odd`` are its warnings, ``survey`` is the content of its mesh files, ``touching`` are the
    parts whose surfaces coincide.
    """

    case: Case
    expected: Estimate
    odd: list[Problem]
    survey: Survey
    touching: list[Touch]


def examine(data: Mapping[str, Any], folder: Path) -> Examination:
    """Checks a case in plain data whose mesh files are in ``folder``, or have full paths. Raises CaseError with
    every known reason for a refusal, ClientError if the program that reads mesh files fails.
    """
    case = parse_case(data)
    if missing := list(missing_files((part.mesh for part in case.parts), folder)):
        raise CaseError(missing)
    found, unread = _survey(case, folder)
    if found.refused:
        raise CaseError(Problem("", "", line) for line in found.refused)
    try:
        expected = estimate(case, folder, found)
    except (ArithmeticError, ValueError):
        raise CaseError([Problem("parts", "", "the elements are too many or too small to be counted")]) from None
    touching = [*touches(case), *found.touching]
    odd = [*unread, *bare_numbers(data), *warned(case, expected, found, touching)]
    return Examination(case, expected, odd, found, touching)


def _named(part: int, mesh: Any) -> tuple[tuple[str | int, ...], object]:
    """Returns the key of the file of a part, or of its mesh if it has several files, and the value."""
    path = getattr(mesh, "path", None)
    return (("parts", part, "mesh"), ...) if path is None else (("parts", part, "mesh", "path"), path)


def _survey(case: Case, folder: Path) -> tuple[Survey, list[Problem]]:
    """Returns the content of the mesh files, and a warning for each file that no program here can read."""
    files = [(i, part.mesh) for i, part in enumerate(case.parts) if isinstance(part.mesh, Measured)]
    if not files:
        return Survey(), []
    if not survey.installed():
        cure = "was not read: the solver is not installed here (pip install 'conoid[worker]')"
        return Survey(), [problem(*_named(i, mesh), cure) for i, mesh in files]
    asked = survey.question(case.model_dump(mode="json"), folder)
    ended = subprocess.run([sys.executable, "-P", "-m", survey.PROGRAM], input=asked, capture_output=True, check=False)
    try:
        if ended.returncode:
            raise ValueError
        return survey.from_json(ended.stdout), []
    except (ValueError, msgspec.MsgspecError):
        lines = ended.stderr.decode("utf-8", "replace").strip().splitlines()
        why = lines[-1] if lines else f"it ended with code {ended.returncode}"
        raise ClientError(f"the program that reads mesh files has failed: {why}") from None
