"""Notation of times on the command line: a date, a date with a time of day, or a duration before now."""

import re
from datetime import datetime, timedelta

from conoid.cases.reading.problems import shown

from ..errors import UsageError

_AGO = re.compile(r"(\d{1,6}(?:\.\d{0,6})?)\s*(min|h|d|w|hours?|days?|weeks?|minutes?)")
_SECONDS = {"m": 60.0, "h": 3600.0, "d": 86400.0, "w": 604800.0}
_ALLOWED = "write a date such as 2026-11-28 or '2026-11-28 14:30', today, yesterday, or how long ago, such as 12h or 3d"


def moment(text: str, named: str, now: datetime | None = None) -> float:
    """Returns the Unix time in s of a text; dates are in the local time zone. Raises UsageError with the name
    ``named`` of the option.
    """
    here = now or datetime.now()
    words = text.strip().lower()
    midnight = here.replace(hour=0, minute=0, second=0, microsecond=0)
    if words in ("today", "yesterday"):
        return (midnight - timedelta(days=words == "yesterday")).timestamp()
    if (ago := _AGO.fullmatch(words)) is not None:
        return here.timestamp() - float(ago[1]) * _SECONDS[ago[2][0]]
    try:
        return datetime.fromisoformat(text.strip()).timestamp()
    except (ValueError, OverflowError, OSError):
        raise UsageError(f"{named} = {shown(text)}: {_ALLOWED}") from None
