"""Recursive coordinate bisection: which rank computes which tet. Berger and Bokhari 1987."""

import numpy as np

from ..state import Floats, Indices


def bisect(points: Floats, weights: Floats, parts: int) -> Indices:
    """(n,) part of each point (n, 3): boxes cut across their longest axis so that the weights are equal.

    Points on the cut are told apart by their index, so the result depends on nothing but the arguments. A number of
    parts that is no power of two is split as floor : ceiling.
    """
    owner = np.zeros(len(points), np.int32)
    _bisect(points, weights, np.arange(len(points)), 0, parts, owner)
    return owner


def _bisect(points: Floats, weights: Floats, chosen: "np.ndarray", first: int, parts: int, owner: Indices) -> None:
    if parts == 1:
        owner[chosen] = first
        return
    axis = int(np.argmax(np.ptp(points[chosen], axis=0))) if len(chosen) else 0
    order = chosen[np.argsort(points[chosen, axis], kind="stable")]
    left = parts // 2
    sums = np.cumsum(weights[order])
    cut = int(np.searchsorted(sums, sums[-1] * left / parts, side="right")) if len(order) else 0
    _bisect(points, weights, order[:cut], first, left, owner)
    _bisect(points, weights, order[cut:], first + left, parts - left, owner)
