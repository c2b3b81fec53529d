"""Sweeps to hand in: one case over four ends."""

import json
import tomllib
from typing import Any

from .running import User, case_text

ENDS = [f"{n} us" for n in range(1, 5)]


def wish(**extra: Any) -> bytes:
    """A sweep over four ends."""
    points = [{"run.end_time": end} for end in ENDS]
    return json.dumps({"case": tomllib.loads(case_text()), "points": points, **extra}).encode()


def handed_in(user: User, body: bytes, key: str | None = None, status: int = 202) -> dict[str, Any]:
    """The answer to a sweep."""
    headers = {"Content-Type": "application/json", **({"Idempotency-Key": key} if key else {})}
    answer = user.http.post("/v1/sweeps", content=body, headers=headers)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found
