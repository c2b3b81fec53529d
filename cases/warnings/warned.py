"""What is odd about a case and its meshes, one list for whoever checks it and for whoever runs it."""

from collections.abc import Iterable

from ..estimates.estimate import Estimate
from ..model.schema import Case
from ..reading.problems import Problem, problem
from ..reading.survey import Survey
from .plausible import oddities
from .touching import Touch, apart


def warned(case: Case, expected: Estimate, survey: Survey, touches: Iterable[Touch]) -> list[Problem]:
    """Every warning that does not depend on how the case is written (``plausible.bare_numbers``): ``expected`` is its
    estimate, ``survey`` what its mesh files hold, ``touches`` are the parts whose surfaces coincide.
    """
    return [
        *_notes(case, survey),
        *oddities(case, expected),
        *apart(case, touches),
        *(Problem("", "", line) for line in survey.told),
    ]


def _notes(case: Case, survey: Survey) -> list[Problem]:
    """What of the files is not in the meshes."""
    return [
        problem(("parts", each.part, "mesh", "path"), getattr(case.parts[each.part].mesh, "path", ...), note)
        for each in survey.parts
        for note in each.notes
    ]
