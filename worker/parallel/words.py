"""Atomic words, the clock, and calls of the C library, for kernels."""

from typing import Any

from llvmlite import ir

from ..kernels.jit import intrinsic, types

_WORD = ir.IntType(64)
_MONOTONIC, SECOND = 1, 1_000_000_000
"""Number of the clock CLOCK_MONOTONIC, which gives the same time in all threads; and the number of ns in a second."""
TASK = "void(int64, int64, int64, int64)"
"""Signature of a kernel that runs a task: address of its arguments (arguments.py), first index, end, number of the
thread."""


def _call(_: Any, kernel: Any, table: Any, first: Any, end: Any, thread: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [_WORD] * 4)
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), emit


def _place(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    data = context.make_array(signature.args[0])(context, builder, args[0]).data
    return builder.gep(data, [args[1]])


def _added(_: Any, words: Any, at: Any, number: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.atomic_rmw("add", _place(context, builder, signature, args), args[2], "seq_cst")

    return types.int64(words, at, number), emit


def _swapped(_: Any, words: Any, at: Any, number: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.atomic_rmw("xchg", _place(context, builder, signature, args), args[2], "seq_cst")

    return types.int64(words, at, number), emit


def _loaded(_: Any, words: Any, at: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load_atomic(_place(context, builder, signature, args), "acquire", 8)

    return types.int64(words, at), emit


def _read(_: Any, address: Any, k: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(builder.gep(builder.inttoptr(args[0], _WORD.as_pointer()), [args[1]]))

    return types.int64(address, k), emit


def _set(_: Any, address: Any, k: Any, number: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[2], builder.gep(builder.inttoptr(args[0], _WORD.as_pointer()), [args[1]]))
        return context.get_dummy_value()

    return types.void(address, k, number), emit


def _write(_: Any, address: Any, number: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[1], builder.inttoptr(args[0], ir.DoubleType().as_pointer()))
        return context.get_dummy_value()

    return types.void(address, number), emit


def _read_clock(_: Any, words: Any, at: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.IntType(32), [_WORD, _WORD.as_pointer()])
        name = "clock_gettime"
        ask = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)
        place = _place(context, builder, signature, args)
        builder.call(ask, [_WORD(_MONOTONIC), place])
        whole, rest = builder.load(place), builder.load(builder.gep(place, [_WORD(1)]))
        return builder.add(builder.mul(whole, _WORD(SECOND)), rest)

    return types.int64(words, at), emit


def _library(name: str, signature: Any) -> Any:
    """Return a call of a function of the C library for kernels. Callers ignore the result of the function."""

    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.IntType(32), [_WORD] * len(args))
        builder.call(builder.module.globals.get(name) or ir.Function(builder.module, kind, name), args)
        return context.get_dummy_value()

    return signature, emit


call_task: Any = intrinsic(_call)
add: Any = intrinsic(_added)
"""Function for kernels; it adds to a word atomically and returns the old value of the word. Two threads that add at the
same time never get the same old value."""
swap: Any = intrinsic(_swapped)
"""Function for kernels; it sets a word and returns the old value of the word. Threads that read the new value also see
all earlier writes of the thread."""
load: Any = intrinsic(_loaded)
"""Function for kernels; it reads a word that other threads may write."""
now: Any = intrinsic(_read_clock)
"""Function for kernels; it returns the time, ns, and uses two words at the address ``at`` as temporary memory."""
word_at: Any = intrinsic(_read)
"""Function for kernels; it returns word number ``k`` at an address."""
set_word: Any = intrinsic(_set)
"""Function for kernels; it writes word number ``k`` at an address."""
write_real: Any = intrinsic(_write)
"""Function for kernels; it writes a float64 to an address."""
sched_yield: Any = intrinsic(lambda _: _library("sched_yield", types.void()))
sem_wait: Any = intrinsic(lambda _, semaphore: _library("sem_wait", types.void(semaphore)))
sem_post: Any = intrinsic(lambda _, semaphore: _library("sem_post", types.void(semaphore)))
