"""Time: the stable step, its growth, and steps that land on output times."""

import math

COLLAPSE = 1e-6
"""A stable step below this share of the first one means that a tet is being crushed, not that it needs patience.
Chosen: a run of a million times the steps never ends."""

STARVED = 1e-3
"""A stable step below this share of the first one is worth a warning: what is left takes a thousand times the steps.
Chosen: dust and penetration take it down to a hundredth."""

SLOWED = 0.1
"""A stable step below this share of the first one is named where a run has used up its time or its steps: it is why.
Chosen: flow and dust take it down to a third without anybody's fault."""


class Clock:
    """Simulated time, compensated (Kahan), and the step that leads on."""

    def __init__(self, end: float, safety: float, growth: float, frames: int) -> None:
        self.t = 0.0
        self.step = 0
        self.dt = 0.0
        """The step ahead, s."""
        self.last_dt = 0.0
        """The step behind, s."""
        self.mean_dt = 0.0
        """Mean of the two: it carries v(n-1/2) to v(n+1/2)."""
        self.shorter = 0.0
        """A quarter of what the step ahead is shorter than the one behind, s."""
        self._first = 0.0
        self._lost = 0.0
        self._stable = math.inf
        self._end = end
        self._safety = safety
        self._growth = growth
        self._frames = frames
        self.frame = 0
        """Index of the next frame time to land on."""
        self._of = -1
        """Of which frame the two times are."""
        self._landing = self._after = 0.0
        """Times of the next frame and of the one after it, s."""

    def keep(self) -> dict[str, float]:
        """Its whole state."""
        return dict(vars(self))

    def resume(self, known: dict[str, float]) -> None:
        """Takes it back."""
        vars(self).update(known)

    @property
    def done(self) -> bool:
        """Whether the end time is reached."""
        return self.t >= self._end

    def frame_time(self, index: int) -> float:
        """Time of frame ``index``, s; the last is the end of the run."""
        return self._end * (index / self._frames) if self._frames and index < self._frames else self._end

    @property
    def frame_due(self) -> bool:
        """Whether a frame belongs to the present time."""
        if self._of != self.frame:
            self._of, self._landing, self._after = self.frame, *map(self.frame_time, (self.frame, self.frame + 1))
        return self.t >= self._landing and self._frames > 0 and self.frame <= self._frames

    def choose(self, limit: float) -> float:
        """The next step, s: ``limit`` is the largest one-over-stable-step of all tets, 1/s, zero when none is left.

        Returns the mean step.

        The way to the next frame is divided into equal steps, as few as are stable: steps that change little cost
        little energy, and none is a sliver. ``growth`` bounds the stable step. At the end of the run it is the step
        that would follow, as long as the last one where that is stable.
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
        """The longest step that may follow the one ahead, s."""
        return self._growth * self.dt

    def choose_again(self, limit: float) -> float:
        """The step anew, for another ``limit``, before it is used; see ``choose``."""
        self.dt = self.last_dt
        return self.choose(limit)

    @property
    def collapsed(self) -> bool:
        """Whether the stable step has fallen so far below the first that the run would not end."""
        return self._stable < COLLAPSE * self._first

    @property
    def starved(self) -> bool:
        """Whether the stable step has fallen so far that people should know."""
        return self._stable < STARVED * self._first

    @property
    def share(self) -> float:
        """Of the first stable step, what is left of it."""
        return self._stable / self._first

    @property
    def steps_left(self) -> float:
        """To the end of the run, at the stable step as it is."""
        return (self._end - self.t) / self._stable

    @property
    def stable(self) -> float:
        """The step that stability and growth allow, s, before landing on an output time."""
        return self._stable

    def advance(self) -> None:
        """Moves on by the chosen step; lands on a frame time exactly."""
        increment = self.dt - self._lost
        new = self.t + increment
        self._lost = (new - self.t) - increment
        self.t = new
        self.step += 1
        target = self._landing if self._of == self.frame else self.frame_time(self.frame)
        if abs(target - self.t) <= 1e-9 * self.dt:
            self.t, self._lost = target, 0.0
