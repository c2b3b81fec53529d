"""The command ``sandbox.py UNIT STATE -- COMMAND`` runs COMMAND in the sandbox of a systemd unit, without systemd. The
command needs root.

The file of the unit sets mounts, user, limits and filters of system calls. A setting of the unit that this program does
not support is an error: no restriction is omitted silently. The folder ``STATE`` replaces /var/lib/conoid, and the
environment of this Python replaces /opt/conoid. The page systemd.exec(5) describes the settings.
"""

import ctypes
import errno
import os
import pwd
import resource
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.server import syscalls

_LIBC = ctypes.CDLL(None, use_errno=True)
_NEW_MOUNTS = 0x00020000
_READ_ONLY, _NO_SUID, _NO_DEVICES, _REMOUNT, _BIND, _RECURSIVE, _PRIVATE = 1, 2, 4, 32, 4096, 16384, 1 << 18
"""Flags of mount(2)."""
_BOUNDING_DROP, _NO_NEW_PRIVILEGES = 24, 38
"""Options of prctl(2)."""
_API = ("/dev", "/proc", "/sys")
_DEVICES = ("null", "zero", "full", "random", "urandom", "tty")
_HOMES = ("/home", "/root", "/run/user")
_TUNABLES = ("/proc/sys", "/proc/irq", "/proc/bus", "/proc/fs", "/sys")
_PASSED_OVER = {
    "ExecStart", "Restart", "RestartSec", "KillMode", "OOMPolicy", "UMask", "WorkingDirectory", "User", "Environment",
    "LimitNOFILE", "StateDirectory", "StateDirectoryMode", "ReadWritePaths", "SystemCallErrorNumber", "RemoveIPC",
}  # fmt: skip
"""Settings of the unit that ``enter`` reads, and settings that act only at the start or the end of a service."""
Unit = dict[str, list[str]]


def read(path: Path) -> Unit:
    """Returns the settings of the section [Service] of the unit, each with its values in order."""
    found: Unit = {}
    section = ""
    for line in path.read_text().splitlines():
        if line.startswith("["):
            section = line
        elif section == "[Service]" and "=" in line and not line.startswith("#"):
            name, _, value = line.partition("=")
            found.setdefault(name, []).append(value)
    return found


def enter(unit: Unit, state: Path) -> None:
    """Puts this process into the sandbox of the unit."""
    unknown = set(unit) - _PASSED_OVER - set(_MOUNTS) - set(_CALLS) - {"NoNewPrivileges", "CapabilityBoundingSet"}
    if unknown:
        raise SystemExit(f"sandbox: settings that it does not have: {', '.join(sorted(unknown))}")
    _check(_LIBC.unshare(_NEW_MOUNTS), "unshare")
    _mount("none", "/", _PRIVATE | _RECURSIVE)
    os.umask(0o022)  # systemd makes mount points with this file mode mask
    _install(state)
    for name, protect in _MOUNTS.items():
        if name in unit:
            protect(unit)
    files = min(int(unit["LimitNOFILE"][-1]), resource.getrlimit(resource.RLIMIT_NOFILE)[1])
    resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))
    os.umask(int(unit["UMask"][-1], 8))
    os.chdir(unit["WorkingDirectory"][-1])
    _becomenobody()
    _check(_LIBC.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0), "prctl")
    for name, forbid in _CALLS.items():
        if name in unit:
            forbid(unit)


def environment(unit: Unit) -> dict[str, str]:
    """Returns the environment variables that systemd sets for a service of this unit."""
    own = dict(pair.split("=", 1) for line in unit.get("Environment", ()) for pair in line.split())
    home = "/var/lib/conoid"
    path = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
    return {"PATH": path, "HOME": home, "USER": "conoid", "LOGNAME": "conoid", "LANG": "C.UTF-8", **own}


# Mounts ---------------------------------------------------------------------------------------------------------------


def _install(state: Path) -> None:
    """Mounts /var/lib/conoid and /opt/conoid, the paths of docs/howto/site.md."""
    for place, source in (("/var/lib/conoid", state), ("/opt/conoid", Path(sys.prefix))):
        held = os.open(source, os.O_PATH)
        _mount("tmpfs", os.path.dirname(place), 0, "tmpfs", "mode=755")
        os.mkdir(place)
        _mount(f"/proc/self/fd/{held}", place, _BIND | _RECURSIVE)
        os.close(held)


def _strict(unit: Unit) -> None:
    """Makes all file systems read-only, except the programming interfaces of the kernel and the paths that the unit
    allows.
    """
    writable = (
        *_API,
        *_words(unit, "ReadWritePaths"),
        *(f"/var/lib/{name}" for name in _words(unit, "StateDirectory")),
    )
    for name in _words(unit, "StateDirectory"):
        own = Path("/var/lib") / name
        own.mkdir(0o700, exist_ok=True)
        os.chown(own, nobody().pw_uid, nobody().pw_gid)
    for path in writable[len(_API) :]:
        _mount(path, path, _BIND)
    for place in _mount_points():
        if not _below(place, writable):
            _read_only(place)


def _no_homes(unit: Unit) -> None:
    """Makes the home folders empty, except for this Python and its code, which an installation has in /opt."""
    needed = [Path(sys.base_prefix), Path(sys.prefix), Path(__file__).parents[2]]
    hidden = [path for path in needed if _below(str(path), _HOMES)]
    held = [os.open(path, os.O_PATH) for path in hidden]
    for home in filter(os.path.isdir, _HOMES):
        _mount("tmpfs", home, 0, "tmpfs", "mode=711")
    for path, source in zip(hidden, held, strict=True):
        path.mkdir(0o755, parents=True, exist_ok=True)
        _mount(f"/proc/self/fd/{source}", str(path), _BIND | _RECURSIVE)
        os.close(source)


def _own_temporary(unit: Unit) -> None:
    for place in ("/tmp", "/var/tmp"):
        hidden = [path for path in (Path(sys.prefix), Path(__file__).parents[2]) if _below(str(path), (place,))]
        assert not hidden, f"PrivateTmp hides {hidden}"
        _mount("tmpfs", place, _NO_SUID | _NO_DEVICES, "tmpfs", "mode=1777")


def _own_devices(unit: Unit) -> None:
    """Mounts /dev without hardware devices; MPI uses the shared memory of the machine."""
    held = {name: os.open(f"/dev/{name}", os.O_PATH) for name in (*_DEVICES, "shm", "mqueue", "pts") if _there(name)}
    _mount("tmpfs", "/dev", _NO_SUID, "tmpfs", "mode=755")
    for name, source in held.items():
        place = Path("/dev") / name
        place.touch() if name in _DEVICES else place.mkdir()
        _mount(f"/proc/self/fd/{source}", str(place), _BIND)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        os.symlink(f"/proc/self/fd/{number}", f"/dev/{name}")
    os.symlink("/proc/self/fd", "/dev/fd")


def _there(name: str) -> bool:
    return os.path.exists(f"/dev/{name}")


def _hidden_processes(unit: Unit) -> None:
    _mount("proc", "/proc", _NO_SUID | _NO_DEVICES, "proc", "hidepid=invisible")


def _kept_as_they_are(*places: str) -> Callable[[Unit], None]:
    def protect(unit: Unit) -> None:
        for place in filter(os.path.exists, places):
            _mount(place, place, _BIND)
            _read_only(place)

    return protect


def _mount_points() -> list[str]:
    lines = Path("/proc/self/mountinfo").read_text().splitlines()
    return [line.split()[4].encode().decode("unicode_escape") for line in lines]


def _below(path: str, places: tuple[str, ...]) -> bool:
    return any(path == place or path.startswith(f"{place}/") for place in places)


def _read_only(place: str) -> None:
    """Makes a mount read-only and keeps the other flags of the mount."""
    with suppress(FileNotFoundError, PermissionError):
        flags = os.statvfs(place).f_flag & (_NO_SUID | _NO_DEVICES)
        _mount("none", place, _REMOUNT | _BIND | _READ_ONLY | flags)


def _mount(source: str, place: str, flags: int, kind: str = "", options: str = "") -> None:
    _check(_LIBC.mount(source.encode(), place.encode(), kind.encode(), flags, options.encode()), f"mount {place}")


def _check(failed: int, what: str) -> None:
    if failed:
        code = ctypes.get_errno()
        raise OSError(code, f"{what}: {os.strerror(code)}")


# User and calls -------------------------------------------------------------------------------------------------------


def nobody() -> pwd.struct_passwd:
    """Returns user and group of the service on this machine."""
    return pwd.getpwnam("nobody")


def _becomenobody() -> None:
    """Changes to a user without a capability; the process also has no capability after an exec."""
    for capability in range(64):
        if _LIBC.prctl(_BOUNDING_DROP, capability, 0, 0, 0):
            break
    os.setgroups([])
    os.setresgid(*(nobody().pw_gid,) * 3)
    os.setresuid(*(nobody().pw_uid,) * 3)


def _words(unit: Unit, name: str) -> list[str]:
    return [word for line in unit.get(name, ()) for word in line.split()]


def _system_calls(unit: Unit) -> None:
    words = [
        ("~" if line.startswith("~") else "") + word
        for line in unit["SystemCallFilter"]
        for word in line.strip("~").split()
    ]
    syscalls.calls(words, int(getattr(errno, unit.get("SystemCallErrorNumber", ["EPERM"])[-1])))


def _nothing(unit: Unit) -> None:
    """Does nothing: a user without a capability satisfies this setting."""


_MOUNTS: dict[str, Callable[[Unit], None]] = {
    "ProtectSystem": _strict,
    "ProtectHome": _no_homes,
    "PrivateTmp": _own_temporary,
    "PrivateDevices": _own_devices,
    "ProtectProc": _hidden_processes,
    "ProtectKernelTunables": _kept_as_they_are(*_TUNABLES),
    "ProtectControlGroups": _kept_as_they_are("/sys/fs/cgroup"),
    "ProtectKernelModules": _nothing,
    "ProtectKernelLogs": _nothing,
    "PrivateMounts": _nothing,
    "DevicePolicy": _nothing,
}
"""Settings of the unit, in the order in which this program applies them."""
_CALLS: dict[str, Callable[[Unit], None]] = {
    "SystemCallArchitectures": lambda unit: syscalls.native(),
    "RestrictAddressFamilies": lambda unit: syscalls.address_families(_words(unit, "RestrictAddressFamilies")),
    "RestrictNamespaces": lambda unit: syscalls.namespaces(),
    "RestrictRealtime": lambda unit: syscalls.realtime(),
    "RestrictSUIDSGID": lambda unit: syscalls.set_id_bits(),
    "MemoryDenyWriteExecute": lambda unit: syscalls.write_and_execute(),
    "LockPersonality": lambda unit: syscalls.personality(),
    "ProtectClock": lambda unit: syscalls.denied(["@clock"])(),
    "ProtectHostname": lambda unit: syscalls.denied(["sethostname", "setdomainname"])(),
    "SystemCallFilter": _system_calls,
}


def main(arguments: list[str]) -> None:
    """Enters the sandbox and replaces this process with the command."""
    unit, state, command = read(Path(arguments[0])), Path(arguments[1]), arguments[3:]
    enter(unit, state)
    os.execvpe(command[0], command, environment(unit))


if __name__ == "__main__":
    main(sys.argv[1:])
