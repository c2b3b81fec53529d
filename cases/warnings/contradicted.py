"""Warning about an initial velocity without effect: a boundary prescribes another velocity of the part at the start."""

from collections.abc import Iterator

from ..model.boundaries import Prescribed
from ..model.schema import Case
from ..reading.problems import Problem, problem


def contradicted(case: Case) -> Iterator[Problem]:
    """Yields a warning for each part whose ``velocity`` has a component other than 0 for which a boundary prescribes
    another value at the start on the whole part.

    A boundary with a box or a set gives no warning, because it may intentionally hold some nodes of a moving part.
    """
    for number, drive in case.boundaries_of(Prescribed):
        if drive.low is not None or drive.on is not None:
            continue
        for i, part in enumerate(case.parts):
            if drive.parts and part.name not in drive.parts:
                continue
            for d, (axis, own) in enumerate(zip("xyz", part.velocity, strict=True)):
                given: float | None = getattr(drive, axis)
                first = None if given is None else given * (drive.course[0][1] if drive.course else 1.0) + 0.0
                if first is not None and own not in (0.0, first):
                    message = f"along {axis} boundaries[{number}] prescribes {first:g} m/s at the start"
                    yield problem(("parts", i, "velocity", d), f"{own:g} m/s", f"has no effect: {message}")
