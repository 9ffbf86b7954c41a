"""Starts one of our programs again and again, by forking a process that has imported it once.

Importing the tower takes most of the time of its start. Run as a script by `worlds.forked_programs`; it imports
nothing of the tests. Control socket: one request per message, with the three standard files and a pipe for the exit
status.

A forked program shares no state with another: the forker only imports and makes the models of routes, so it has no
event loop, no database, no open file and no second thread (it refuses to fork with one), and Python and OpenSSL reseed
at a fork. It differs from an ordinary start in three things: the hash seed is the forker's, the garbage collector
ignores what was imported, and `/proc/PID/cmdline` names this file.
"""

import contextlib
import gc
import importlib
import json
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Final

MAX_REQUEST_BYTES: Final = 1 << 17
MODULES: Final = {
    "tower": ("server.app.cli", "server.app.composition", "server.app.serving", "server.app.log", "uvloop"),
    "tower-agent": ("onboard_agent.cli", "uvloop"),
    "tower-sim": ("simulator.cli", "uvloop"),
}
"""What each program imports in every run. Its `main` is the installed entry point's."""


class Forker:
    def __init__(self, control: socket.socket) -> None:
        self._control = control
        self._exit_pipes: dict[int, int] = {}
        """The write end for each process that has not ended."""

    def next_child(self) -> dict[str, Any] | None:
        """Forks at each request. Returns the request in each child, and None in the parent when the tests end."""
        threads = len(list(Path("/proc/self/task").iterdir()))
        if threads != 1:
            raise RuntimeError(f"an import started {threads - 1} threads: a fork would copy the locks they hold")
        woken, wakes = os.pipe()
        os.set_blocking(wakes, False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(wakes, warn_on_full_buffer=False)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the tests, and they end this

        while True:
            ready, _, _ = select.select([self._control, woken], [], [])
            if woken in ready:
                os.read(woken, 4096)
                self._report_ended()
            if self._control in ready:
                message, fds, _, _ = socket.recv_fds(self._control, MAX_REQUEST_BYTES, 4)
                if not message:
                    self._end_the_rest()
                    return None
                *files, exit_pipe = fds
                pid = os.fork()
                if pid == 0:
                    signal.set_wakeup_fd(-1)
                    for fd in (woken, wakes, exit_pipe, *self._exit_pipes.values()):
                        os.close(fd)
                    self._control.close()
                    for number, file in enumerate(files):
                        os.dup2(file, number)
                        os.close(file)
                    return dict(json.loads(message))
                for file in files:
                    os.close(file)
                self._exit_pipes[pid] = exit_pipe
                self._control.send(str(pid).encode())

    def _end_the_rest(self) -> None:
        """Ends what a test left that hung and was ended with its worker: nobody else would."""
        for pid in self._exit_pipes:
            os.kill(pid, signal.SIGKILL)

    def _report_ended(self) -> None:
        with contextlib.suppress(ChildProcessError):
            while True:
                pid, status = os.waitpid(-1, os.WNOHANG)
                if pid == 0:
                    return
                pipe = self._exit_pipes.pop(pid)
                with contextlib.suppress(BrokenPipeError):
                    os.write(pipe, str(os.waitstatus_to_exitcode(status)).encode())
                os.close(pipe)


def become(request: dict[str, Any]) -> None:
    """Makes this process look as if it had just been started."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ.clear()
    os.environ.update(request["environment"])
    time.tzset()
    os.chdir(request["folder"])
    sys.argv[:] = request["command"]


def make_route_models() -> None:
    """Makes what a tower makes once in a process, at its start. It takes most of the time that imports leave."""
    from fastapi import FastAPI

    from server.app.routers import included_routes
    from server.http.prepare_routes import prepare_routes

    prepare_routes(FastAPI(routes=[*included_routes()]))


def main() -> None:
    program, control_fd = sys.argv[1], int(sys.argv[2])
    sys.path[0] = str(Path(sys.executable).parent)  # as a console script has it
    (entry_point,) = entry_points(group="console_scripts", name=program)
    main_of_program: Callable[[], object] = entry_point.load()
    for name in MODULES[program]:
        importlib.import_module(name)
    if program == "tower":
        make_route_models()
    gc.collect()
    gc.freeze()  # otherwise the first collection of each child copies the memory of all imports
    request = Forker(socket.socket(fileno=control_fd)).next_child()
    if request is not None:
        become(request)
        sys.exit(main_of_program())  # as a console script does


if __name__ == "__main__":
    main()
