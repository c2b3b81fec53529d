"""Columns of a table: new rows get values by the rules of the columns, in spare rows of arrays that may be replaced."""

from types import SimpleNamespace

import numpy as np
import pytest

from conoid.worker.model.columns import ABSENT, COPIED, ZERO, Columns
from conoid.worker.model.growing import spacious_copy


def table(n: int) -> SimpleNamespace:
    x = np.arange(3.0 * n).reshape(n, 3)
    return SimpleNamespace(x=x, flag=np.ones(n, bool), first=np.arange(n, dtype=np.int32), none=np.zeros((0, 2)))


def test_rows_are_appended_by_rule_and_copies_have_the_rows_of_their_sources() -> None:
    one, many, n = table(5), Columns(), 5
    before = table(5)
    many.declare(one, x=COPIED, flag=ZERO, first=ABSENT, none=ZERO)
    for more in (1, 2, 7):
        many.extend(n, more)
        sources, targets = np.arange(more) % n, np.arange(n, n + more)
        many.copy(sources, targets)
        assert (one.x[targets] == one.x[sources]).all()
        assert not one.flag[targets].any()
        assert (one.first[targets] == -1).all()
        n += more
    assert len(one.none) == 0
    for name in ("x", "flag", "first"):
        assert len(getattr(one, name)) == n
        assert (getattr(one, name)[:5] == getattr(before, name)).all()


def test_spare_rows_are_used_and_a_column_that_was_replaced_is_found_again() -> None:
    holder, many = SimpleNamespace(table=None), Columns()
    many.declare(holder, "table", x=COPIED)
    many.extend(5, 1)  # no table yet
    holder.table = SimpleNamespace(x=spacious_copy(table(6).x))
    room = holder.table.x.base
    many.extend(6, 2)
    assert holder.table.x.base is room
    many.declare(holder, "table", first=ABSENT)
    holder.table = table(8)
    many.extend(8, 1)
    assert holder.table.x[:8].tolist() == table(8).x.tolist()
    assert holder.table.first.tolist() == [*range(8), -1]


def test_a_column_of_another_length_is_an_error() -> None:
    one, many = table(4), Columns()
    many.declare(one, x=COPIED)
    with pytest.raises(ValueError, match="column 'x' has 4 rows instead of 3"):
        many.extend(3, 1)
