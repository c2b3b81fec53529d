"""Kernels: functions that numba compiles for their declared signature, at their first call.

``numba.njit`` compiles a function with a signature at its declaration, or loads it from the cache. With ``numba.njit``
every rank would load every kernel of the worker at its start, for any scene. The decorator ``njit`` of this module
compiles or loads a kernel at its first call, from Python or from another kernel. No other module imports numba.

numba counts references to every array of every record that one kernel passes to another, with atomic operations. A
kernel that makes no array needs no reference counts, and is compiled without them. In the narrow phase of a stack of
plates, reference counts took three quarters of the time.
"""

import inspect
import os
import sys
import time
from collections.abc import Callable
from functools import cached_property
from types import ModuleType
from typing import Any

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

__all__ = ["DECLARED", "Kernel", "intrinsic", "njit", "packed", "prefetch", "record", "several", "types"]

_BLAS = "scipy.linalg"
_TO_READ, _TO_SECOND, _DATA = 0, 2, 1
"""Arguments of LLVM's prefetch instruction: reading, second-level cache, data."""
FunctionIdentity._unique_ids = iter(lambda: int.from_bytes(os.urandom(8), "big"), None)  # type: ignore[assignment]
"""Random numbers by which numba distinguishes functions with equal names. By default numba counts the functions of each
process. Two kernels from different processes may then have functions with equal name and number. Two such kernels both
use the function that is loaded first, so a kernel may call the wrong function and crash (numba issue 10486)."""
_MAKERS = {
    "arange", "argsort", "array", "concatenate", "copy", "cumsum", "empty", "full", "ones", "sort", "unique", "zeros",
}  # fmt: skip
"""Names of functions and methods that make arrays. A kernel that calls such a function needs reference counts. If a
kernel makes arrays in another way, or assigns whole rows, numba cannot compile it without reference counts. A kernel
with such array code is declared with ``_nrt=True``."""
DECLARED: list["Kernel"] = []
"""All kernels of the imported modules."""


def _folder() -> str:
    """Returns the cache folder of all kernels; "" if no folder is set."""
    return str(config.CACHE_DIR)  # type: ignore[attr-defined]


class _ModuleFolder(_CacheLocator):
    """Locator of cache files, an interface of numba, which returns the cache folder of the module of a kernel. The
    folder of a module is inside of the folder that kernels/store.py names by a hash of the sources.
    """

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file = file
        self._path = os.path.join(_folder(), function.__module__)
        os.makedirs(self._path, exist_ok=True)

    def get_cache_path(self) -> str:
        """Returns the cache folder of the module."""
        return self._path

    def get_source_stamp(self) -> str:
        """Returns a constant. numba expects a time stamp of the sources here, but different sources have different
        folders.
        """
        return ""

    def get_disambiguator(self) -> str:
        """Returns a part of the file name of a kernel. By default the file name contains the line of the kernel in the
        source. Here it is empty, because a changed docstring moves lines. Kernels with equal names share an index file,
        in which numba finds a kernel by its byte code.
        """
        return ""

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> "_ModuleFolder | None":
        """Returns None if the cache folder is not set or cannot be made. If the method returns None, numba uses its
        default folder.
        """
        try:
            return cls(function, file) if _folder() else None
        except OSError:
            return None


class _Kept(CompileResultCacheImpl):
    _locator_classes = [_ModuleFolder, *CompileResultCacheImpl._locator_classes]  # noqa: RUF012


class _Cache(FunctionCache):
    _impl_class = _Kept


class Kernel(CPUDispatcher):
    """Compiled function with one signature."""

    signature: Any = ""
    """Signature of the kernel as it was declared: text in numba's notation, or a signature made with ``types``."""

    @property
    def result(self) -> Any:
        """Type of the result of the kernel."""
        return normalize_signature(self.signature)[1]  # type: ignore[no-untyped-call]

    def enable_caching(self) -> None:
        """Sets the cache folder of the kernel to the folder of its module."""
        self._cache = _Cache(self.py_func)  # type: ignore[no-untyped-call]

    def load(self) -> None:
        """Compiles the kernel and the kernels that it calls, or loads them from the cache; this is done only once, in
        the thread that calls the kernel first.
        """
        with global_compiler_lock:
            if self.overloads:
                return
            with _loading:
                self.targetoptions.setdefault("_nrt", _makes_arrays(self))
                super().compile(self.signature)
            self.disable_compile()

    @cached_property
    def address(self) -> int:
        """Address of the machine code of the kernel. The code has the calling convention of C."""
        self.load()
        compiled: Any = next(iter(self.overloads.values()))
        return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name))

    def compile(self, sig: Any) -> Any:
        """Returns the entry point of this kernel. numba calls this method when it compiles a call of the kernel in
        another kernel. For any ``sig`` the result is the entry point of the declared signature.
        """
        self.load()
        (compiled,) = self.overloads.values()
        return compiled.entry_point  # type: ignore[attr-defined]

    def _compile_for_args(self, *args: Any, **kws: Any) -> "Kernel":
        """Loads the kernel. numba calls this method when Python calls the kernel for the first time. Then numba calls
        the kernel again and checks the types of the arguments.
        """
        self.load()
        return self


def _makes_arrays(kernel: Kernel) -> bool:
    """Returns True if a kernel needs reference counts, because it makes arrays or calls a kernel that returns
    arrays.
    """
    names, used = kernel.py_func.__code__.co_names, inspect.getclosurevars(kernel.py_func)
    known = [*used.nonlocals.values(), *used.globals.values()]
    known += [getattr(module, name, None) for module in known if isinstance(module, ModuleType) for name in names]
    handing = (kernel, *(each for each in known if isinstance(each, Kernel)))
    return not _MAKERS.isdisjoint(names) or any(_holds_arrays(each.result) for each in handing)


def _holds_arrays(kind: Any) -> bool:
    if isinstance(kind, types.BaseTuple):
        return any(_holds_arrays(each) for each in kind.types)  # type: ignore[attr-defined]
    return isinstance(kind, types.Array)


def njit(signature: Any, *, cache: bool = True, **options: Any) -> Callable[[Callable[..., Any]], Kernel]:
    """Declares a kernel with the given signature. ``options`` are the options of numba's njit."""

    def declare(function: Callable[..., Any]) -> Kernel:
        kernel = Kernel(function, targetoptions={"nopython": True, "boundscheck": None, **options})
        kernel.signature = signature
        if cache:
            kernel.enable_caching()
        DECLARED.append(kernel)
        return kernel

    return declare


def several(*kinds: Any) -> Any:
    """Returns the numba type of a tuple."""
    return types.Tuple(kinds)  # type: ignore[no-untyped-call]


def record(name: type, *kinds: Any) -> Any:
    """Returns the numba type of a named tuple."""
    if len(set(kinds)) == 1:
        return types.NamedUniTuple(kinds[0], len(kinds), name)  # type: ignore[no-untyped-call]
    return types.NamedTuple(kinds, name)  # type: ignore[no-untyped-call]


packed: Any = cgutils.pack_array
"""Makes an LLVM array from a list of values, for intrinsics."""


def _prefetch(_: Any, array: Any, index: Any) -> Any:
    word, byte = ir.IntType(32), ir.IntType(8).as_pointer()

    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
        call = builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
        place = builder.bitcast(builder.gep(data, [args[1]]), byte)
        builder.call(call, [place, word(_TO_READ), word(_TO_SECOND), word(_DATA)])
        return context.get_dummy_value()

    return types.void(array, index), emit


prefetch: Any = intrinsic(_prefetch)
"""Loads the cache line of an element of a one-dimensional array. The function must be called in a kernel. The call
changes no value, and an index beyond the end of the array causes no error."""


class _Loading:
    """CPU time and wall time that this thread has used to load kernels, s. The time of nested loads is counted once."""

    def __init__(self) -> None:
        self.spent = self.passed = 0.0
        self._depth = 0

    def __enter__(self) -> None:
        if not self._depth:
            self._began = time.thread_time(), time.monotonic()
        self._depth += 1

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        if not self._depth:
            self.spent += time.thread_time() - self._began[0]
            self.passed += time.monotonic() - self._began[1]


_loading = _Loading()


def _begin() -> None:
    """Loads numba's own functions, which the first kernel needs. The BLAS of scipy is not loaded, because no kernel
    needs it.

    Without this function, numba would import the whole linear algebra of scipy if scipy is installed.
    """
    absent = _BLAS not in sys.modules
    if absent:
        sys.modules[_BLAS] = None  # type: ignore[assignment]
    try:
        cpu_target.typing_context.refresh()
        cpu_target.target_context.refresh()
    finally:
        if absent:
            del sys.modules[_BLAS]


_begin()


def cpu_time() -> float:
    """Returns the CPU time of this thread so far, s, without the loading of kernels."""
    return time.thread_time() - _loading.spent


def wall_time() -> float:
    """Returns the wall time of a clock that stops while kernels are loaded, s."""
    return time.monotonic() - _loading.passed
