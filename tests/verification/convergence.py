"""Orders of convergence: measured orders, compared with the expected orders of rates.toml."""

import math
import tomllib
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

RATES = tomllib.loads(Path(__file__).with_name("rates.toml").read_text(encoding="utf-8"))


def assert_converges(name: str, errors: Sequence[float]) -> None:
    """Checks that the errors, each at half the size of the previous error, decrease with the order of the table, as far
    as the convergence goes.
    """
    rate = RATES[name]
    orders = [math.log2(coarse / fine) for coarse, fine in pairwise(errors)]
    assert min(orders) > rate["order"] - rate["within"], f"{name}: orders {orders}"
    for error, first in zip(errors, rate["errors"], strict=True):
        assert error < 1.1 * first, f"{name}: errors {errors}, first measured {rate['errors']}"
