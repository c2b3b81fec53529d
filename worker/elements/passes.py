"""A pass over the tets by the threads of a rank: the kernel of the tasks, and a table of arguments for each block."""

from typing import Any

from ..kernels.jit import Kernel
from ..model.state import Block, Nodes
from ..parallel.arguments import Arguments, Tie
from .records import Scratches, body_of, marks_of, motion_of

Values = tuple[Any, ...]


class BlockPass:
    """Pass of a kernel over the tets. ``kinds``: types of the arguments of the kernel: Motion, Body, Marks if
    ``marked``, Scratches, Means if the form has means, and numbers.
    """

    def __init__(self, kernel: Kernel, kinds: tuple[object, ...], *, marked: bool = True) -> None:
        self.kernel = kernel
        self._kinds, self._marked = kinds, marked
        self._tables: dict[int, Arguments] = {}
        """Tables of arguments; the keys are the parts."""

    def address(self, nodes: Nodes, block: Block, scratches: Scratches, means: Values, numbers: Values) -> int:
        """Returns the address of the table of arguments for a block. ``means``: the fields of Means (averages over
        nodes); empty if the pass uses no averages.
        """
        return self._table(block).set(*self._records(nodes, block), scratches, means, *numbers)

    def bind(
        self, nodes: Nodes, block: Block, scratches: Scratches, means: Values, numbers: Values
    ) -> tuple[int, tuple[Tie, ...]]:  # fmt: skip
        """Returns the address of the table for a program of stages. Also returns the words of the table that depend on
        numbers of the program (arguments.py).
        """
        return self._table(block).bind(*self._records(nodes, block), scratches, means, *numbers)

    def _table(self, block: Block) -> Arguments:
        table = self._tables.get(block.part)
        if table is None:
            table = self._tables[block.part] = Arguments(*self._kinds)
        return table

    def _records(self, nodes: Nodes, block: Block) -> Values:
        return motion_of(nodes), body_of(block), marks_of(block) if self._marked else ()
