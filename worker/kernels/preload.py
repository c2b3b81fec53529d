"""Loading of the kernels that a scene needs, on all ranks at once before the first step.

A kernel is loaded at its first call (worker/kernels/jit.py), which takes 3 to 20 ms. Without this module each rank
would load the forty kernels of fracture when cracks reach the rank, and all other ranks would wait for this rank. The
kernels are found by the names in the functions of the packages.
"""

import sys
from collections.abc import Iterator
from importlib.abc import InspectLoader
from inspect import ismodule
from types import CodeType, ModuleType

from conoid.cases.model.schema import Case

from ..model.inheriting import copy, fill, inherit
from .jit import DECLARED, Kernel

_WORKER = (__package__ or "").rpartition(".")[0]


def preload(case: Case) -> None:
    """Loads the kernels of contact, fracture and boundaries that the ``case`` uses."""
    needed = {
        "contact.": case.contact is not None,
        "fracture.": case.fractures,
        "boundaries.": bool(case.boundaries),
    }
    prefixes = tuple(f"{_WORKER}.{name}" for name, there in needed.items() if there)
    for name, module in sorted(sys.modules.items()):
        if name.startswith(prefixes):
            for kernel in called(module):
                kernel.load()
    if case.fractures:
        for kernel in (fill, copy, inherit):
            kernel.load()


def called(module: ModuleType) -> Iterator[Kernel]:
    """Yields the kernels to which the functions and methods of a module refer by name. The kernels may be in this
    module or in another module.
    """
    loader = module.__loader__
    assert isinstance(loader, InspectLoader)
    whole = loader.get_code(module.__name__)
    assert whole is not None
    for code in _functions(whole, {kernel.py_func.__code__ for kernel in DECLARED}):
        known = [vars(module)[name] for name in code.co_names if name in vars(module)]
        others = [vars(found) for found in known if ismodule(found) and found.__name__.startswith(_WORKER)]
        known += [other[name] for other in others for name in code.co_names if name in other]
        yield from (found for found in known if isinstance(found, Kernel))


def _functions(code: CodeType, kernels: set[CodeType]) -> Iterator[CodeType]:
    """Yields the functions that are defined in a code object, also those inside of other functions. Functions among
    ``kernels`` are left out.
    """
    for constant in code.co_consts:
        if isinstance(constant, CodeType) and constant not in kernels:
            yield constant
            yield from _functions(constant, kernels)
