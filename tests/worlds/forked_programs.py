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
import threading
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Final

from worlds.program_forker import MODULES

FORKER: Final = Path(__file__).with_name("program_forker.py")
CHECKOUT: Final = FORKER.parents[2]
RUNS_FOR_S: Final = 120.0


class ForkedProgram:
    """What a test uses of `subprocess.Popen`."""

    def __init__(self, pid: int, command: Sequence[str], exit_pipe: int) -> None:
        self.pid = pid
        self.args = list(command)
        self.returncode: int | None = None
        self._exit_pipe = exit_pipe
        self._reading = threading.Lock()

    def poll(self) -> int | None:
        return self._exit_code_within(0)

    def wait(self, timeout: float | None = None) -> int:
        """Raises subprocess.TimeoutExpired."""
        code = self._exit_code_within(timeout)
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

    def _exit_code_within(self, timeout_s: float | None) -> int | None:
        if self.returncode is not None:
            return self.returncode
        ended = select.poll()  # unlike select, with descriptors above 1023
        ended.register(self._exit_pipe, select.POLLIN)
        if ended.poll(None if timeout_s is None else timeout_s * 1000):
            with self._reading:
                if self.returncode is None:
                    self.returncode = int(os.read(self._exit_pipe, 16) or -signal.SIGKILL)
                    os.close(self._exit_pipe)
        return self.returncode


class Forker:
    """The process that has imported one program."""

    def __init__(self, program: str) -> None:
        self._asking = threading.Lock()
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, str(FORKER), program, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                cwd=CHECKOUT,
            )
        self.network = _network_of(str(self._process.pid))
        atexit.register(self.stop)

    def start(
        self, command: Sequence[str], environment: Mapping[str, str], files: tuple[IO[bytes], IO[bytes], IO[bytes]]
    ) -> ForkedProgram:
        """`files`: standard input, output and error."""
        request = {"command": list(command), "environment": dict(environment), "folder": str(CHECKOUT)}
        ours, theirs = os.pipe()
        try:
            with self._asking:
                fds = [*(file.fileno() for file in files), theirs]
                socket.send_fds(self._control, [json.dumps(request).encode()], fds)
                pid = int(self._control.recv(16) or 0)
        finally:
            os.close(theirs)
        assert pid, f"the forker of {command[0]} ended: see its words on standard error"
        return ForkedProgram(pid, command, ours)

    def stop(self) -> None:
        self._control.close()
        self._process.wait(10)


_forker: Final = cache(Forker)
"""One for each program, in each process that runs tests."""


def run_forked(command: Sequence[str], environment: Mapping[str, str], stdin: bytes) -> tuple[int, bytes, bytes]:
    """Runs one of our programs to its end. Returns its exit code, output and errors."""
    with TemporaryFile() as given, TemporaryFile() as out, TemporaryFile() as err:
        given.write(stdin)
        given.seek(0)
        program = _forker(Path(command[0]).name).start(command, environment, (given, out, err))
        try:
            code = program.wait(RUNS_FOR_S)
        finally:
            program.kill()
        out.seek(0)
        err.seek(0)
        return code, out.read(), err.read()


def fork(command: Sequence[str], log: IO[bytes], environment: Mapping[str, str]) -> ForkedProgram | None:
    """Starts one of our programs. Returns None, having done nothing, if only an ordinary start is the same."""
    program = Path(command[0])
    is_ours = program.parent == Path(sys.executable).parent and program.name in MODULES
    if not is_ours or command[1:2] == ["connect"] or sys.platform != "linux":
        return None
    forker = _forker(program.name)
    if forker.network != _network_of("thread-self"):
        return None  # the test has moved this thread into another network namespace, and an ordinary start follows it
    with Path(os.devnull).open("rb") as nothing:
        return forker.start(command, environment, (nothing, log, log))


def _network_of(process: str) -> int:
    return Path(f"/proc/{process}/ns/net").stat().st_ino
