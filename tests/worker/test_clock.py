"""Clock of the run: output times are reached exactly, no step is much shorter than necessary, the growth of the step
is limited, and the sum of the steps is exact."""

import math
from itertools import pairwise

import numpy as np
import pytest

from conoid.worker.clock import Clock


def steps_of(clock: Clock, limits: list[float]) -> list[tuple[float, float, bool]]:
    """Runs the clock to its end in the same way as the loop; returns the time, the next step and whether a frame is
    scheduled, at each n.
    """
    seen = []
    n = 0
    while True:
        clock.choose(limits[n % len(limits)])
        seen.append((clock.t, clock.dt, clock.frame_due))
        if clock.frame_due:
            clock.frame += 1
        if clock.done:
            return seen
        clock.advance()
        n += 1


@pytest.mark.parametrize("frames", [0, 1, 7, 10, 333])
@pytest.mark.parametrize("seed", range(5))
def test_frames_are_met_exactly_and_without_slivers(frames: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    end, limit = 8.1e-5, 10.0 ** random.uniform(6.0, 7.5)
    limits = (limit * random.uniform(0.5, 1.0, 1000)).tolist()
    seen = steps_of(Clock(end, 0.9, 1.05, frames), limits)
    times = [t for t, _, due in seen if due]
    assert times == [end * (i / frames) if i < frames else end for i in range(frames + 1)] * (frames > 0)
    assert seen[-1][0] == end
    assert [t for t, _, _ in seen] == sorted({t for t, _, _ in seen})
    for (t, dt, _), (later, _, _) in pairwise(seen):
        assert abs(later - t - dt) <= 1e-9 * dt + 1e-16 * end


def test_no_step_is_a_sliver() -> None:
    """Before an output time the step is at least half of the stable step, unless the whole interval is shorter."""
    end, stable = 1e-4, 0.9 / 1e7
    for frames in (0, 3, 17, 100):
        seen = steps_of(Clock(end, 0.9, 2.0, frames), [1e7])
        smallest = min(dt for _, dt, _ in seen[:-1])
        assert smallest >= min(0.5 * stable, end / max(frames, 1)) * (1 - 1e-9)
        assert max(dt for _, dt, _ in seen) <= stable * (1 + 1e-15)


def test_step_is_within_safety_and_growth() -> None:
    limits = [1e7, 1e7, 8e7, 1e7, 1e6, 1e6, 1e6, 5e6]
    clock = Clock(1.0, 0.7, 1.1, 0)
    old = math.inf
    for limit in limits * 20:
        mean = clock.choose(limit)
        assert clock.dt <= 0.7 / limit
        assert clock.stable == min(0.7 / limit, 1.1 * old)
        assert clock.dt == pytest.approx(clock.stable, rel=1e-6)
        assert clock.dt <= clock.stable
        assert mean == 0.5 * (clock.last_dt + clock.dt)
        old = clock.stable
        clock.advance()


def test_steps_to_an_output_time_are_equal_and_as_few_as_are_stable() -> None:
    seen = steps_of(Clock(1e-5, 0.9, 1.05, 3), [1e7])
    steps = np.array([dt for _, dt, _ in seen[:-1]])
    wanted = 3 * math.ceil(1e-5 / 3 / 0.9e-7)
    assert len(steps) == wanted
    assert steps == pytest.approx(1e-5 / wanted, rel=1e-9)


def test_time_is_compensated_over_a_million_steps() -> None:
    """After a million unequal steps the time is the exact sum of the steps to the last bits; a plain sum has larger
    errors."""
    random = np.random.default_rng(1)
    limits = (1e7 * random.uniform(0.5, 2.0, 997)).tolist()
    clock, plain, steps = Clock(1e9, 0.9, 2.0, 0), 0.0, []
    for n in range(1_000_000):
        clock.choose(limits[n % 997])
        steps.append(clock.dt)
        plain += clock.dt
        clock.advance()
    exact = math.fsum(steps)
    assert clock.step == 1_000_000
    assert abs(clock.t - exact) <= 2.0 * math.ulp(exact)
    assert abs(plain - exact) > 10.0 * math.ulp(exact)


def test_at_the_end_stands_the_step_that_would_follow() -> None:
    """The next step is equal to the last step, if the last step is still stable."""
    for limits in ([3e7], [3e7] * 30 + [6e7] * 100):
        clock = Clock(1e-6, 0.9, 1.05, 2)
        steps = [dt for _, dt, _ in steps_of(clock, limits)]
        assert clock.done
        assert 0.0 < clock.dt == steps[-1] <= min(steps[-2], clock.stable)


def test_time_goes_on_when_no_tet_is_left_however_many_frames_are_wanted() -> None:
    """Without a limit the stable step grows from step to step, in the end beyond the range of floating-point
    numbers."""
    clock = Clock(1e-3, 0.9, 2.0, 2000)
    clock.choose(1e7)
    clock.advance()
    assert sum(due for _, _, due in steps_of(clock, [0.0])) == 2001
    assert clock.stable == math.inf
