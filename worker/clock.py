"""Simulated time and the choice of the time step: stability limit, growth limit, landing on output times."""

import math

COLLAPSE = 1e-6
"""Share of the first stable step below which the run ends with an error: a tet is crushed. Chosen: a run with a
million times as many steps would never end."""

STARVED = 1e-3
"""Share of the first stable step below which a warning is given: the rest of the run takes a thousand times as many
steps. Chosen: dust and penetration reduce it to a hundredth."""

SLOWED = 0.1
"""Share of the first stable step below which a message that the limit of time or of steps was reached also names the
stable step as the reason. Chosen: plastic flow and dust reduce it to a third in any run."""


class Clock:
    """Simulated time, by compensated summation (Kahan), and the time step."""

    def __init__(self, end: float, safety: float, growth: float, frames: int) -> None:
        self.t = 0.0
        self.step = 0
        self.dt = 0.0
        """Time step from n to n+1, s."""
        self.last_dt = 0.0
        """Time step from n-1 to n, s."""
        self.mean_dt = 0.0
        """Mean of the two, s: the kick from v(n-1/2) to v(n+1/2) takes this time."""
        self.shorter = 0.0
        """A quarter of ``last_dt - dt``, s."""
        self._first = 0.0
        self._lost = 0.0
        self._stable = math.inf
        self._end = end
        self._safety = safety
        self._growth = growth
        self._frames = frames
        self.frame = 0
        """Index of the next frame on whose time a step ends."""
        self._of = -1
        """Index of the frame whose times ``_landing`` and ``_after`` are."""
        self._landing = self._after = 0.0
        """Times of the next frame and of the one after it, s."""

    def keep(self) -> dict[str, float]:
        """Returns the whole state, for a checkpoint."""
        return dict(vars(self))

    def resume(self, known: dict[str, float]) -> None:
        """Restores the state that ``keep`` returned."""
        vars(self).update(known)

    @property
    def done(self) -> bool:
        """Whether the end time is reached."""
        return self.t >= self._end

    def frame_time(self, index: int) -> float:
        """Returns the time of frame ``index``, s; that of the last one is the end of the run."""
        return self._end * (index / self._frames) if self._frames and index < self._frames else self._end

    @property
    def frame_due(self) -> bool:
        """Whether a frame is to be written at the present time."""
        if self._of != self.frame:
            self._of, self._landing, self._after = self.frame, *map(self.frame_time, (self.frame, self.frame + 1))
        return self.t >= self._landing and self._frames > 0 and self.frame <= self._frames

    def choose(self, limit: float) -> float:
        """Chooses the next time step ``dt`` and returns ``mean_dt``, s. ``limit``: the largest one-over-stable-step of
        all tets, 1/s; zero when no tet is left.

        The interval to the next frame is divided into as few equal steps as are stable: a step that changes little
        costs little energy, and no step is much shorter than the others. ``growth`` bounds the ratio of two
        successive stable steps. At the end time, ``dt`` is the step that would follow: the last one, if that is
        stable.
        """
        self.last_dt = self.dt
        self._stable = min(self._safety / limit if limit > 0.0 else math.inf, self._growth * self._stable)
        left = (self._after if self.frame_due else self._landing) - self.t
        following = min(self._stable, self.last_dt)
        self.dt = left / max(math.ceil(left / self._stable), 1) if left > 0.0 else following
        self._first = self._first or self._stable
        self.mean_dt, self.shorter = 0.5 * (self.last_dt + self.dt), 0.25 * (self.last_dt - self.dt)
        return self.mean_dt

    @property
    def longest(self) -> float:
        """The largest time step that may follow ``dt``, s."""
        return self._growth * self.dt

    def choose_again(self, limit: float) -> float:
        """Chooses the time step again, for another ``limit``, before it is used; see ``choose``."""
        self.dt = self.last_dt
        return self.choose(limit)

    @property
    def collapsed(self) -> bool:
        """Whether the stable step is so far below the first one that the run would not end."""
        return self._stable < COLLAPSE * self._first

    @property
    def starved(self) -> bool:
        """Whether the stable step is so far below the first one that the user is warned."""
        return self._stable < STARVED * self._first

    @property
    def share(self) -> float:
        """The stable step over the first one."""
        return self._stable / self._first

    @property
    def steps_left(self) -> float:
        """Number of steps to the end of the run, at the present stable step."""
        return (self._end - self.t) / self._stable

    @property
    def stable(self) -> float:
        """The time step that stability and growth allow, s, before it is shortened to land on an output time."""
        return self._stable

    def advance(self) -> None:
        """Adds the chosen step to the time; a frame time is set exactly."""
        increment = self.dt - self._lost
        new = self.t + increment
        self._lost = (new - self.t) - increment
        self.t = new
        self.step += 1
        target = self._landing if self._of == self.frame else self.frame_time(self.frame)
        if abs(target - self.t) <= 1e-9 * self.dt:
            self.t, self._lost = target, 0.0
