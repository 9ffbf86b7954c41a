"""Starts, monitors, restarts and ends programs, for `make run`."""

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Final

AGAIN_AFTER_S: Final = 0.5
SETTLED_AFTER_S: Final = 10.0
MAX_QUICK_EXITS: Final = 3
END_WITHIN_S: Final = 5.0
TAIL_LINES: Final = 15

_PR_SET_PDEATHSIG: Final = 1
_libc: Final = ctypes.CDLL(None, use_errno=True) if sys.platform == "linux" else None


def _die_with_parent() -> None:
    # Even a kill -9 of this process must leave nothing behind. Linux only; elsewhere Ctrl-C and SIGTERM still work.
    if _libc is not None:
        _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


class ProgramFailed(Exception):
    """A program ended and cannot be kept running. Names the program, the reason, and its last output."""

    def __init__(self, program: "Program", why: str) -> None:
        super().__init__(f"The {program.name} failed: {why}.\n{program.last_words()}")


class Program:
    """One program with its log file. The log is appended to, so that the reason of a crash is not lost."""

    def __init__(self, name: str, command: Sequence[str | Path], log: Path) -> None:
        self.name = name
        self._command = [str(word) for word in command]
        self._log = log
        self._process: subprocess.Popen[bytes] | None = None
        self._started_at = 0.0
        self._again_at: float | None = None
        self._quick_deaths = 0

    def start(self) -> None:
        """In its own session: Ctrl-C must reach only this process, which then ends the programs in order."""
        out: IO[bytes] = self._log.open("ab")
        with out:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=_die_with_parent,
            )
        self._started_at = time.monotonic()
        self._again_at = None

    def check(self) -> None:
        """Raises ProgramFailed if it has ended."""
        if self._process is not None and self._process.poll() is not None:
            raise ProgramFailed(self, f"it ended with code {self._process.returncode}")

    def ends_within(self, timeout_s: float) -> bool:
        """Waits for a program that ends by itself; returns whether it has."""
        if self._process is None:
            return True
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def keep_alive(self, say: Callable[[str], None]) -> None:
        """Restarts it if it has ended, as systemd would. Raises ProgramFailed if it keeps failing."""
        now = time.monotonic()
        if self._again_at is not None:
            if now >= self._again_at:
                self.start()
            return
        if self._process is None or self._process.poll() is None:
            return
        self._quick_deaths = self._quick_deaths + 1 if now - self._started_at < SETTLED_AFTER_S else 1
        if self._quick_deaths > MAX_QUICK_EXITS:
            raise ProgramFailed(self, f"it ended {self._quick_deaths} times in a row, last with {self._ended_how()}")
        say(f"The {self.name} ended with {self._ended_how()}; starting it again")
        self._again_at = now + AGAIN_AFTER_S

    def _ended_how(self) -> str:
        assert self._process is not None
        code = self._process.returncode
        return f"signal {signal.Signals(-code).name}" if code < 0 else f"code {code}"

    def ask_to_end(self) -> None:
        """Sends SIGTERM, without waiting."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()

    def wait_or_kill(self, deadline: float) -> None:
        """Waits until it has ended; kills it after the deadline."""
        if self._process is None:
            return
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()

    def last_words(self) -> str:
        """Returns the end of its log."""
        try:
            lines = self._log.read_text(errors="replace").splitlines()[-TAIL_LINES:]
        except OSError:
            return ""
        return "\n".join(f"  | {line}" for line in lines)


def end_all(programs: Sequence[Program]) -> None:
    """Ends all at once, the last started first; nothing is left behind, even if Ctrl-C is pressed again meanwhile."""
    held = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for program in reversed(programs):
            program.ask_to_end()
        deadline = time.monotonic() + END_WITHIN_S
        for program in reversed(programs):
            program.wait_or_kill(deadline)
    finally:
        for number, handler in held.items():
            signal.signal(number, handler)


def run_once(*command: str | Path, stdin: str = "") -> str:
    """Runs a program to its end and returns its output. Raises StepFailed with the program's error output."""
    done = subprocess.run([str(word) for word in command], input=stdin, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        name = " ".join(Path(str(word)).name if index == 0 else str(word) for index, word in enumerate(command))
        raise StepFailed(f"`{name}` failed with code {done.returncode}:\n{(done.stderr or done.stdout).strip()}")
    return done.stdout


class StepFailed(Exception):
    """A step of the preparation failed; the text is the program's own."""
