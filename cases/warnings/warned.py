"""All warnings about a case and its meshes; ``conoid validate``, the server and the run give them."""

from collections.abc import Iterable

from ..estimates.estimate import Estimate
from ..model.schema import Case
from ..reading.problems import Problem, problem
from ..reading.survey import Survey
from .plausible import oddities
from .touching import Touch, apart


def warned(case: Case, expected: Estimate, survey: Survey, touches: Iterable[Touch]) -> list[Problem]:
    """Returns all warnings except those that depend on how the case is written (``plausible.bare_numbers``).
    ``expected``: estimate of the case; ``survey``: survey of its mesh files; ``touches``: pairs of parts that touch.
    """
    return [
        *_notes(case, survey),
        *oddities(case, expected),
        *apart(case, touches),
        *(Problem("", "", line) for line in survey.warnings),
    ]


def _notes(case: Case, survey: Survey) -> list[Problem]:
    """Returns the notes of the survey on contents of mesh files that are not used."""
    return [
        problem(("parts", each.part, "mesh", "path"), getattr(case.parts[each.part].mesh, "path", ...), note)
        for each in survey.parts
        for note in each.notes
    ]
