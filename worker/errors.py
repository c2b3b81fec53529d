"""Errors of the worker, and their exit codes.

::

    ConoidError                      exit 1   base of the errors of the worker
    ├── CompileError                 exit 1   kernels cannot be compiled
    ├── StoppedError                 exit 4   the run was asked to stop before its first step
    ├── InputError (ValueError)      exit 2   the case, or a file it names, is wrong
    │   └── MeshError                exit 2   the mesh cannot be made, read or used
    └── PhysicsError                 exit 3   the solution has diverged
        └── EnergyError              exit 3   the energy ledger does not close

The text of each error is a single line for the author of the case. The line has the key, the value and the allowed
values.
"""

from typing import ClassVar

from conoid.cases.reading import problems
from conoid.cases.run import Cause, ExitCode, State


class ConoidError(problems.ConoidError):
    """Base class of the errors of the worker. A user of Conoid catches problems.ConoidError (client/errors.py)
    instead.
    """

    exit_code: ClassVar[int] = ExitCode.CRASHED
    cause: ClassVar[Cause] = Cause.SERVICE
    state: ClassVar[State] = State.FAILED


class CompileError(ConoidError):
    """Error that is raised if the kernels cannot be compiled."""


class StoppedError(ConoidError):
    """Error that is raised if the run was asked to stop before its first step."""

    exit_code = ExitCode.INTERRUPTED
    cause = Cause.CANCELLED
    state = State.CANCELLED


class InputError(ConoidError, ValueError):
    """Error that is raised if the case, or a file that the case names, is wrong."""

    exit_code = ExitCode.BAD_INPUT
    cause = Cause.INPUT


class MeshError(InputError):
    """Error that is raised if the mesh cannot be made, read or used."""

    cause = Cause.MESH


class PhysicsError(ConoidError):
    """Error that is raised if the solution has diverged."""

    exit_code = ExitCode.PHYSICS
    cause = Cause.DIVERGED


class EnergyError(PhysicsError):
    """Error that is raised if the residual of the energy ledger is above its limit."""

    cause = Cause.ENERGY
