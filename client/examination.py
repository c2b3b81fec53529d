"""Check of a case before the run: errors, warnings, cost.

Mesh files are read by a program of the worker, in a process of its own, if the worker is installed.
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
    """Result of the check of a valid case: ``odd`` are the warnings, ``survey`` is the content of the mesh files,
    ``touching`` are the pairs of parts whose surfaces coincide.
    """

    case: Case
    expected: Estimate
    odd: list[Problem]
    survey: Survey
    touching: list[Touch]


def examine(data: Mapping[str, Any], folder: Path) -> Examination:
    """Checks a case given as plain data; relative paths of mesh files are relative to ``folder``. Raises CaseError
    with every known reason for a refusal, ClientError if the program that reads mesh files fails.
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
    """Returns the key of the file of a part, or the key of its mesh if the part has several files, and the value of
    the key.
    """
    path = getattr(mesh, "path", None)
    return (("parts", part, "mesh"), ...) if path is None else (("parts", part, "mesh", "path"), path)


def _survey(case: Case, folder: Path) -> tuple[Survey, list[Problem]]:
    """Returns the content of the mesh files, and a warning for each file that cannot be read on this machine."""
    files = [(i, part.mesh) for i, part in enumerate(case.parts) if isinstance(part.mesh, Measured)]
    if not files:
        return Survey(), []
    if not survey.installed():
        cure = (
            "the file was not read, because the solver is not installed on this machine (pip install 'conoid[worker]')"
        )
        return Survey(), [problem(*_named(i, mesh), cure) for i, mesh in files]
    asked = survey.question(case.model_dump(mode="json"), folder)
    ended = subprocess.run([sys.executable, "-P", "-m", survey.PROGRAM], input=asked, capture_output=True, check=False)
    try:
        if ended.returncode:
            raise ValueError
        return survey.from_json(ended.stdout), []
    except (ValueError, msgspec.MsgspecError):
        lines = ended.stderr.decode("utf-8", "replace").strip().splitlines()
        why = lines[-1] if lines else f"the program ended with code {ended.returncode}"
        raise ClientError(f"the program that reads mesh files has failed: {why}") from None
