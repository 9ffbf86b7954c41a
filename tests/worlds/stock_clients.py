"""Third-party ground stations: where they are installed, and MAVProxy driven by typed commands."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Final

CLIENTS: Final = Path(sys.prefix) / "stock-clients"
ENVIRONMENT: Final = {**os.environ, "PYTHONPATH": str(CLIENTS), "PYTHONUNBUFFERED": "1", "PYTHONWARNINGS": "ignore"}

MODULES: Final = "cmdlong,arm,mode,param,wp,misc"
"""MAVProxy's modules to load. Its default set needs packages for maps and joysticks."""


def installed() -> bool:
    """Whether deploy/install_test_parts.sh has installed them."""
    return (CLIENTS / "installed.txt").exists()


class MavProxy:
    """The published MAVProxy, without a screen. `log` holds its output."""

    def __init__(self, master: str, folder: Path) -> None:
        self._log = folder / "mavproxy.log"
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [
                    *(sys.executable, str(CLIENTS / "bin" / "mavproxy.py"), f"--master={master}", "--streamrate=-1"),
                    *(f"--default-modules={MODULES}", f"--state-basedir={folder}", f"--logfile={folder / 'mav.tlog'}"),
                ],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=folder,
                env=ENVIRONMENT,
            )

    @property
    def log(self) -> str:
        return self._log.read_text(errors="replace")

    def type(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line.encode() + b"\n")
        self._process.stdin.flush()

    def until(self, pattern: str, *, again: str = "", timeout_s: float = 60.0) -> None:
        """Waits until the output matches. Types `again` every second until then."""
        deadline = time.monotonic() + timeout_s
        typed_at = time.monotonic()
        while not re.search(pattern, self.log):
            assert self._process.poll() is None, self.log
            assert time.monotonic() < deadline, f"MAVProxy never said {pattern}: {self.log[-2000:]}"
            if again and time.monotonic() - typed_at > 1.0:
                typed_at = time.monotonic()
                self.type(again)
            time.sleep(0.05)

    def close(self) -> None:
        if self._process.poll() is None:
            self._process.terminate()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()
