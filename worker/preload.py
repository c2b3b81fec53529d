"""Kernels that a scene needs, loaded on all ranks at once before the first step.

A kernel is loaded at its first call (worker/jit.py), which takes 3 to 20 ms. Those of fracture are called first by one
rank after the other, as cracks come to them, some forty kernels each, and all others wait. Which they are is listed
nowhere: those that functions of the packages name.
"""

import sys
from collections.abc import Iterator
from functools import cached_property
from inspect import isclass, isfunction, ismodule
from types import CodeType, ModuleType
from typing import Any

from conoid.cases.schema import Case

from .inheriting import inherit
from .jit import Kernel

_WORKER = __package__ or ""


def preload(case: Case) -> None:
    """Loads what contact, fracture and boundaries call, where the ``case`` has them."""
    needed = {
        "contact.": case.contact is not None,
        "fracture.": case.fractures,
        **dict.fromkeys(("boundaries", "drivers", "walls"), bool(case.boundaries)),
    }
    prefixes = tuple(f"{_WORKER}.{name}" for name, there in needed.items() if there)
    for name, module in sorted(sys.modules.items()):
        if name.startswith(prefixes):
            for kernel in called(module):
                kernel.load()
    if case.fractures:
        inherit.load()


def called(module: ModuleType) -> Iterator[Kernel]:
    """The kernels that functions and methods of a module name, as its own or as those of another module."""
    for code in _codes(vars(module), module.__name__):
        names = code.co_names
        known = [vars(module)[name] for name in names if name in vars(module)]
        others = [vars(found) for found in known if ismodule(found) and found.__name__.startswith(_WORKER)]
        known += [other[name] for other in others for name in names if name in other]
        yield from (found for found in known if isinstance(found, Kernel))


def _codes(members: dict[str, Any], module: str) -> Iterator[CodeType]:
    """Of the functions among the ``members`` that the ``module`` defines, of its classes, and what is within."""
    for member in list(members.values()):
        member = _function(member)
        if isclass(member) and member.__module__ == module:
            yield from _codes(dict(vars(member)), module)
        elif isfunction(member) and member.__module__ == module:
            yield from _nested(member.__code__)


def _function(member: Any) -> Any:
    """What a property, a class method or a static one is made of; others as they are."""
    if isinstance(member, property):
        return member.fget
    if isinstance(member, cached_property):
        return member.func
    return getattr(member, "__func__", member)


def _nested(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _nested(constant)
