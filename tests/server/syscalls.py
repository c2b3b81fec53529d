"""System calls that a systemd unit forbids, as filters of libseccomp in the calling process.

Each systemd setting that acts on system calls is one filter; a system call must pass all filters. The rules of the
filters are those of systemd.exec(5) and of systemd's ``src/shared/seccomp-util.c``.
"""

import ctypes
import errno
import shutil
import socket
import stat
import subprocess
from collections.abc import Callable, Iterable, Sequence

_ALLOW, _ERRNO = 0x7FFF0000, 0x00050000
_NOT_EQUAL, _EQUAL, _ABOVE, _MASKED = 1, 4, 6, 7
"""Comparisons of libseccomp (seccomp.h): an argument with a number, or masked bits of the argument with a number."""
_NAMESPACES = (0x02000000, 0x00020000, 0x04000000, 0x08000000, 0x10000000, 0x20000000, 0x40000000)
"""CLONE_NEWCGROUP, NEWNS, NEWUTS, NEWIPC, NEWUSER, NEWPID, NEWNET (linux/sched.h)."""
_REALTIME = (1, 2, 6)
"""SCHED_FIFO, SCHED_RR, SCHED_DEADLINE."""
_MOST_FAMILIES = 64


class _Compare(ctypes.Structure):
    _fields_ = (("arg", ctypes.c_uint), ("op", ctypes.c_int), ("a", ctypes.c_uint64), ("b", ctypes.c_uint64))


def library() -> ctypes.CDLL | None:
    """Returns the library libseccomp; None if libseccomp is not installed."""
    try:
        found = ctypes.CDLL("libseccomp.so.2", use_errno=True)
    except OSError:
        return None
    found.seccomp_init.restype = ctypes.c_void_p
    for function in (found.seccomp_load, found.seccomp_release):
        function.argtypes = [ctypes.c_void_p]
    found.seccomp_rule_add_array.argtypes = [
        ctypes.c_void_p, ctypes.c_uint32, ctypes.c_int, ctypes.c_uint, ctypes.POINTER(_Compare),
    ]  # fmt: skip
    return found


class Filter:
    """One filter: a list of allowed system calls, or a list of forbidden system calls."""

    def __init__(self, default: int = _ALLOW) -> None:
        """Makes a filter; ``default`` is the action for a system call without a rule."""
        lib = library()
        assert lib is not None
        self._lib, self._context = lib, lib.seccomp_init(ctypes.c_uint32(default))

    def rule(self, action: int, call: str, *where: tuple[int, int, int, int]) -> None:
        """Adds a rule for a system call; ``where`` has the argument, the comparison and its two numbers. A system call
        that this machine does not have is skipped.
        """
        number = self._lib.seccomp_syscall_resolve_name(call.encode())
        compare = (_Compare * len(where))(*(_Compare(*each) for each in where))
        failed = number != -1 and self._lib.seccomp_rule_add_array(self._context, action, number, len(where), compare)
        assert failed in (0, -errno.EDOM, -errno.EFAULT), f"{call}: {failed}"

    def deny(self, call: str, *where: tuple[int, int, int, int], code: int = errno.EPERM) -> None:
        """Adds the rule by which the system call fails with ``code``."""
        self.rule(_ERRNO | code, call, *where)

    def load(self) -> None:
        """Applies the filter to this process and its child processes."""
        failed = self._lib.seccomp_load(self._context)
        assert failed == 0, f"seccomp_load: {failed}"
        self._lib.seccomp_release(self._context)


def address_families(names: Sequence[str]) -> None:
    """RestrictAddressFamilies: allows sockets of the named families only."""
    allowed, only = {int(getattr(socket, name)) for name in names}, Filter()
    for family in set(range(_MOST_FAMILIES)) - allowed:
        only.deny("socket", (0, _EQUAL, family, 0), code=errno.EAFNOSUPPORT)
    only.deny("socket", (0, _ABOVE, _MOST_FAMILIES - 1, 0), code=errno.EAFNOSUPPORT)
    only.load()


def calls(words: Sequence[str], code: int) -> None:
    """SystemCallFilter: allows the system calls of the named groups, without the calls of the groups with a ``~``."""
    allowed: set[str] = set()
    for word in words:
        if word.startswith("~"):
            allowed -= _members(word[1:])
        else:
            allowed |= _members(word)
    only = Filter(_ERRNO | code)
    for call in sorted(allowed | _members("@default")):
        only.rule(_ALLOW, call)
    only.load()


def _members(word: str) -> set[str]:
    """Returns the system calls of a group, from the output of systemd-analyze."""
    if not word.startswith("@"):
        return {word}
    command = [str(shutil.which("systemd-analyze")), "--no-pager", "syscall-filter", word]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[1:]
    lines = [line.strip() for line in printed]
    return set().union(*(_members(line) for line in lines if line and not line.startswith("#")))


def namespaces() -> None:
    """RestrictNamespaces=yes: forbids to make a namespace and to change to another namespace."""
    none = Filter()
    none.deny("setns")
    none.deny("clone3", code=errno.ENOSYS)
    for bit in _NAMESPACES:
        none.deny("unshare", (0, _MASKED, bit, bit))
        none.deny("clone", (0, _MASKED, bit, bit))
    none.load()


def realtime() -> None:
    """RestrictRealtime=yes: forbids the real-time scheduling policies."""
    none = Filter()
    for policy in _REALTIME:
        none.deny("sched_setscheduler", (1, _EQUAL, policy, 0))
    none.load()


def set_id_bits() -> None:
    """RestrictSUIDSGID=yes: forbids to set the SUID and SGID bits of a file."""
    none = Filter()
    for bit in (stat.S_ISUID, stat.S_ISGID):
        for call, place in (("chmod", 1), ("fchmod", 1), ("fchmodat", 2), ("mkdir", 1), ("mkdirat", 2), ("creat", 1)):
            none.deny(call, (place, _MASKED, bit, bit))
    none.load()


def write_and_execute() -> None:
    """MemoryDenyWriteExecute=yes: forbids memory that is writable and executable, at the same time or one after the
    other.
    """
    none = Filter()
    none.deny("mmap", (2, _MASKED, 6, 6))
    none.deny("mprotect", (2, _MASKED, 4, 4))
    none.deny("pkey_mprotect", (2, _MASKED, 4, 4))
    none.load()


def personality() -> None:
    """LockPersonality=yes: forbids to change the personality of the process."""
    none = Filter()
    none.deny("personality", (0, _NOT_EQUAL, 0, 0))
    none.load()


def denied(names: Iterable[str]) -> Callable[[], None]:
    """Returns a filter by which the given system calls, or groups of system calls, always fail."""

    def load() -> None:
        none = Filter()
        for name in sorted(set().union(*(_members(name) for name in names))):
            none.deny(name)
        none.load()

    return load


def native() -> None:
    """SystemCallArchitectures=native: libseccomp ends a process that uses call numbers of another architecture."""
    Filter().load()
