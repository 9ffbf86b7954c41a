"""Our programs as processes of their own, without importing them anew for each: see `worlds.program_forker`."""

import atexit
import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import IO, Final

from worlds.program_forker import MODULES

FORKER: Final = Path(__file__).with_name("program_forker.py")
CHECKOUT: Final = FORKER.parents[2]


class ForkedProgram:
    """What a test uses of `subprocess.Popen`."""

    def __init__(self, pid: int, command: Sequence[str], exit_pipe: int) -> None:
        self.pid = pid
        self.args = list(command)
        self.returncode: int | None = None
        self._exit_pipe = exit_pipe

    def poll(self) -> int | None:
        return self._look(0)

    def wait(self, timeout: float | None = None) -> int:
        """Raises subprocess.TimeoutExpired."""
        code = self._look(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
        return code

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def _look(self, timeout: float | None) -> int | None:
        if self.returncode is None and select.select([self._exit_pipe], [], [], timeout)[0]:
            self.returncode = int(os.read(self._exit_pipe, 16) or -signal.SIGKILL)
            os.close(self._exit_pipe)
        return self.returncode


class Forker:
    """The process that has imported one program."""

    def __init__(self, program: str) -> None:
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, str(FORKER), program, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                cwd=CHECKOUT,
            )
        atexit.register(self.stop)

    def start(self, command: Sequence[str], log: IO[bytes], environment: Mapping[str, str]) -> ForkedProgram:
        request = {"command": list(command), "environment": dict(environment), "folder": str(CHECKOUT)}
        ours, theirs = os.pipe()
        socket.send_fds(self._control, [json.dumps(request).encode()], [log.fileno(), theirs])
        os.close(theirs)
        return ForkedProgram(int(self._control.recv(16)), command, ours)

    def stop(self) -> None:
        self._control.close()
        self._process.wait(10)


_forker: Final = cache(Forker)
"""One for each program, in each process that runs tests."""


def can_fork(command: Sequence[str]) -> bool:
    """Whether `fork` starts this command as an ordinary start does."""
    program = Path(command[0])
    is_ours = program.parent == Path(sys.executable).parent and program.name in MODULES
    return is_ours and command[1:2] != ["connect"] and sys.platform == "linux" and _is_in_our_network()


def fork(command: Sequence[str], log: IO[bytes], environment: Mapping[str, str]) -> ForkedProgram:
    """Starts a program for which `can_fork`."""
    return _forker(Path(command[0]).name).start(command, log, environment)


def _is_in_our_network() -> bool:
    """A test may move a thread into another network namespace; an ordinary start would follow it there."""
    return Path("/proc/thread-self/ns/net").stat().st_ino == Path("/proc/self/ns/net").stat().st_ino
