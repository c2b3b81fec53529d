"""The request for a sweep (case, points, largest number of concurrent runs), and the case of each point."""

import json
from typing import Any

import msgspec

from conoid.cases.load import CaseError, Problem, apply_overrides, json_data

from ..answers.schemas.sweeps import MOST_POINTS
from ..errors import ServiceError, invalid_case


class Wish(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Request for a sweep: a case as JSON, the changed values of each point, and the largest number of concurrent
    runs.
    """

    case: dict[str, Any]
    points: list[dict[str, Any]]
    at_once: int | None = None


def wish_of(body: bytes) -> Wish:
    """Reads the request for a sweep. Raises ServiceError if the request is not valid."""
    try:
        wish = msgspec.convert(json_data(body), Wish)
    except CaseError as error:
        raise invalid_case(error.problems) from None
    except msgspec.ValidationError as error:
        raise ServiceError(422, "invalid_sweep", str(error), hint="case, points, at_once") from None
    if not 1 <= len(wish.points) <= MOST_POINTS:
        raise ServiceError(422, "invalid_sweep", f"{len(wish.points)} points; allowed: 1 to {MOST_POINTS}")
    if wish.at_once is not None and wish.at_once < 1:
        raise ServiceError(422, "invalid_sweep", f"at_once = {wish.at_once}: at least 1")
    return wish


def changed(case: dict[str, Any], point: dict[str, Any], n: int) -> bytes:
    """Returns the case at point ``n`` as JSON. Raises ServiceError if the changes of the point are invalid."""
    try:
        return json.dumps(apply_overrides(case, point)).encode()
    except CaseError as error:
        raise at_point(n, error) from None
    except RecursionError:
        raise at_point(n, CaseError([Problem("", "", "the values of this point are nested too deeply")])) from None


def at_point(n: int, error: CaseError) -> ServiceError:
    """Returns ``error`` with the number ``n`` of the point that caused it."""
    return invalid_case([Problem(each.key, each.value, f"{each.message} (point {n})") for each in error.problems])
