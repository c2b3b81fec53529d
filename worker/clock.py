"""Simulated time, and the choice of the time step by the stability limit, the growth limit and the output times."""

import math

from .kernels.jit import njit

T, LOST, DT, LAST_DT, MEAN_DT, SHORTER, STABLE = range(7)
"""Indices of the clock's numbers in a program of steps (stretch.py). The order is that of ``Clock.numbers``."""

COLLAPSE = 1e-6
"""Smallest allowed ratio of the stable step to the first stable step. If the ratio of the steps is smaller, a tet
counts as crushed and the run ends with an error. Chosen value: a run with a million times as many steps would never
end."""

STARVED = 1e-3
"""Ratio of the stable step to the first stable step below which the run gives a warning. If the stable step is a
thousandth of the first one, the rest of the run takes a thousand times as many steps. Chosen value: dust and
penetration reduce the stable step to a hundredth, which needs no warning."""

SLOWED = 0.1
"""Ratio of the stable step to the first stable step, for runs that reach their limit of time or of steps. If this ratio
is smaller than the constant, the run reports the decrease of the stable step as the reason. Chosen value: plastic flow
and dust reduce the stable step to a third in any run."""


@njit("UniTuple(float64, 4)(float64, float64, float64, float64, float64, float64)", cache=True, error_model="numpy")
def chosen(limit, safety, growth, stable, last_dt, left):  # type: ignore[no-untyped-def]
    """Return the stable step, the next step, the mean of the last and the next step, and a quarter of their difference,
    s. ``left``: simulated time to the next output, s. See ``Clock.choose``.
    """
    stable = min(safety / limit if limit > 0.0 else math.inf, growth * stable)
    dt = min(stable, last_dt)
    if left > 0.0:
        dt = left / max(float(math.ceil(left / stable)), 1.0)
    return stable, dt, 0.5 * (last_dt + dt), 0.25 * (last_dt - dt)


@njit("UniTuple(float64, 2)(float64, float64, float64, float64)", cache=True)
def advanced(t, lost, dt, target):  # type: ignore[no-untyped-def]
    """Return the simulated time after a step ``dt``, s, and the rounding error of this time. ``target``: time of the
    next output, s; the returned time is equal to it if the step ends there.
    """
    increment = dt - lost
    new = t + increment
    if abs(target - new) <= 1e-9 * dt:
        return target, 0.0
    return new, (new - t) - increment


class Clock:
    """Simulated time and time step. The time is summed with compensation (Kahan)."""

    def __init__(self, end: float, safety: float, growth: float, frames: int) -> None:
        self.t = 0.0
        self.step = 0
        self.dt = 0.0
        """Time step from n to n+1, s."""
        self.last_dt = 0.0
        """Time step from n-1 to n, s."""
        self.mean_dt = 0.0
        """Mean of ``dt`` and ``last_dt``, s. In the velocity update from v(n-1/2) to v(n+1/2) the forces act for the
        mean of the two steps."""
        self.shorter = 0.0
        """A quarter of the difference ``last_dt - dt``, s."""
        self._first = 0.0
        self._lost = 0.0
        self._stable = math.inf
        self._end = end
        self._safety = safety
        self._growth = growth
        self._frames = frames
        self.frame = 0
        """Index of the next frame. A step ends exactly at the time of a frame."""
        self._of = -1
        """Index of the frame for which ``_landing`` and ``_after`` are valid."""
        self._landing = self._after = 0.0
        """Time of the next frame, s; and time of the frame after the next frame, s."""

    def keep(self) -> dict[str, float]:
        """Returns the state of the clock for a checkpoint."""
        return dict(vars(self))

    def resume(self, known: dict[str, float]) -> None:
        """Restores the state that ``keep`` returned."""
        vars(self).update(known)

    @property
    def done(self) -> bool:
        """True if the simulated time has reached the end of the run."""
        return self.t >= self._end

    def frame_time(self, index: int) -> float:
        """Returns the time of frame ``index``, s; the time of the last frame is the end of the run."""
        return self._end * (index / self._frames) if self._frames and index < self._frames else self._end

    @property
    def frame_due(self) -> bool:
        """True if a frame must be written at the present time."""
        if self._of != self.frame:
            self._of, self._landing, self._after = self.frame, *map(self.frame_time, (self.frame, self.frame + 1))
        return self.t >= self._landing and self._frames > 0 and self.frame <= self._frames

    def choose(self, limit: float) -> float:
        """Chooses the next time step ``dt`` and returns ``mean_dt``, s. ``limit``: largest value over all tets of 1 /
        stable step, 1/s; zero if no tet is left.

        The interval to the next frame is divided into equal steps, as few as are stable. Equal steps create little
        energy, and no step is much shorter than the others. ``growth`` bounds the ratio of two successive stable steps.
        At the end time, ``dt`` is the length of the step that would follow: the last step if it is still stable, else
        the stable step.
        """
        self.last_dt = self.dt
        left = (self._after if self.frame_due else self._landing) - self.t
        self._stable, self.dt, self.mean_dt, self.shorter = chosen(
            limit, self._safety, self._growth, self._stable, self.last_dt, left
        )
        self._first = self._first or self._stable
        return self.mean_dt

    @property
    def numbers(self) -> tuple[float, ...]:
        """The numbers of the clock for a program of steps (stretch.py), in the order of the indices T to STABLE."""
        return self.t, self._lost, self.dt, self.last_dt, self.mean_dt, self.shorter, self._stable

    @property
    def limits(self) -> tuple[float, float, float, float]:
        """Four limits: safety factor, growth factor, stable step below which a warning is needed, s, and time of the
        next output, s.
        """
        target = self._landing if self._of == self.frame else self.frame_time(self.frame)
        return self._safety, self._growth, STARVED * self._first, target

    def go_on(self, steps: int, numbers: list[float]) -> None:
        """Sets the clock from ``numbers`` after a program has executed ``steps`` further steps."""
        self.t, self._lost, self.dt, self.last_dt, self.mean_dt, self.shorter, self._stable = numbers
        self.step += steps

    @property
    def longest(self) -> float:
        """Largest allowed next time step, s: ``dt`` times the growth factor."""
        return self._growth * self.dt

    def choose_again(self, limit: float) -> float:
        """Chooses the time step again, for another ``limit``; to be called before the time step is used; see
        ``choose``.
        """
        self.dt = self.last_dt
        return self.choose(limit)

    @property
    def collapsed(self) -> bool:
        """True if the stable step is so much smaller than the first stable step that the run would practically never
        end.
        """
        return self._stable < COLLAPSE * self._first

    @property
    def starved(self) -> bool:
        """True if the stable step is so much smaller than the first stable step that a warning is given."""
        return self._stable < STARVED * self._first

    @property
    def share(self) -> float:
        """Ratio of the present stable step to the first stable step."""
        return self._stable / self._first

    @property
    def steps_left(self) -> float:
        """Number of steps to the end of the run, at the present stable step."""
        return (self._end - self.t) / self._stable

    @property
    def stable(self) -> float:
        """Largest time step that stability and growth allow, s. ``choose`` shortens this step so that a step ends at
        the output time.
        """
        return self._stable

    def advance(self) -> None:
        """Adds the chosen step to the simulated time. At a frame the time is set to the exact time of the frame."""
        target = self._landing if self._of == self.frame else self.frame_time(self.frame)
        self.t, self._lost = advanced(self.t, self._lost, self.dt, target)
        self.step += 1
