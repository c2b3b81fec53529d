"""Query parameters that all lists of runs have."""

from typing import Annotated

from fastapi import Depends, Query

from conoid.cases.run import State

from ..answers.filters import Chosen
from ..errors import ServiceError
from ..intake.submission import labels_of

_MOST_WORDS, _LONGEST = 8, 200
"""Largest number of words in a search, and largest number of characters of the search text (chosen values)."""


def chosen(
    state: Annotated[str | None, Query(description="one or more states, with commas between")] = None,
    label: Annotated[list[str] | None, Query(description="NAME=VALUE; runs that have all of them")] = None,
    case: Annotated[str, Query(max_length=_LONGEST, description="name of the case; * stands for any letters")] = "",
    text: Annotated[
        str,
        Query(max_length=_LONGEST, description="words, all of which the name, title, labels, state or message have"),
    ] = "",
    since: Annotated[float | None, Query(allow_inf_nan=False, description="submitted then or later, Unix s")] = None,
    until: Annotated[float | None, Query(allow_inf_nan=False, description="submitted before, Unix s")] = None,
) -> Chosen:
    """Returns the filters of a request. Raises ServiceError with status 400 if a filter is invalid."""
    words = text.split()
    if len(words) > _MOST_WORDS:
        raise ServiceError(400, "bad_parameter", f"text has {len(words)} words; allowed: {_MOST_WORDS}", pointer="text")
    for name, value in (("case", case), ("text", text), *(("label", each) for each in label or ())):
        if "\0" in value:
            raise ServiceError(400, "bad_parameter", f"{name} = {value[:80]!r}: no text has a null byte", pointer=name)
    return Chosen(_states(state), labels_of(label or ()), case, words, since, until)


ChosenOf = Annotated[Chosen, Depends(chosen)]


def _states(text: str | None) -> list[State]:
    try:
        return [State(word) for word in text.split(",")] if text else []
    except ValueError as error:
        allowed = ", ".join(State)
        raise ServiceError(400, "bad_parameter", f"state: {error}; allowed: {allowed}", pointer="state") from None
