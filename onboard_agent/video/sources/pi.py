"""A Raspberry Pi's camera: the child process `rpicam-vid` writes raw pictures to its standard output.

It is a system program rather than a library, because libcamera's Python bindings come only with Raspberry Pi OS, and
only for the system's Python.
"""

import os
import select
import shutil
import subprocess
import threading
import time
from typing import IO, Final

import av
import numpy as np

from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.source import (
    OPEN_PATIENCE_S,
    READ_PATIENCE_S,
    CameraLost,
    PictureRequest,
    Source,
    Taken,
    now_us,
)

_PROGRAMS: Final = ("rpicam-vid", "libcamera-vid")
_WIDTH_STEP: Final = 64
"""Rows of raw pictures are padded to a multiple of this many pixels; such widths need no cropping."""
_KILL_AFTER_S: Final = 0.5


class PiSource(Source):
    """The pictures have no timestamp: each is timed when its first byte leaves the pipe."""

    def __init__(self, name: str, number: int, mode: Mode) -> None:
        super().__init__(name)
        self._number = number
        self._mode = mode
        self._child: subprocess.Popen[bytes] | None = None
        self._last_words = ""
        self._width = self._height = 0
        self._picture = bytearray()
        self._filled = 0
        self._began_us = 0
        self._patient_until = 0.0

    def open(self, request: PictureRequest) -> None:
        program = next(filter(None, map(shutil.which, _PROGRAMS)), None)
        if program is None:
            raise CameraLost(f"{self.name}: {_PROGRAMS[0]} is not installed")
        width = self._mode.width or request.width
        self._width = max(width // _WIDTH_STEP, 1) * _WIDTH_STEP
        self._height = (self._mode.height or request.height) // 2 * 2
        self._picture = bytearray(self._width * self._height * 3 // 2)
        self._filled = 0
        self._last_words = ""
        self._child = subprocess.Popen(  # noqa: S603 - no shell, and nothing in it is a stranger's
            [program, *self._arguments(self._mode.rate_hz or request.rate_hz)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        assert self._child.stderr is not None
        threading.Thread(target=self._listen, args=(self._child.stderr,), name="camera-words", daemon=True).start()
        self._patient_until = time.monotonic() + OPEN_PATIENCE_S

    def read(self) -> Taken | None:
        child = self._child
        if child is None or child.stdout is None:
            raise CameraLost(f"{self.name}: is closed")
        pipe = child.stdout.fileno()
        if not select.select([pipe], [], [], 0.2)[0]:
            if time.monotonic() > self._patient_until:
                raise CameraLost(f"{self.name}: gives no pictures")
            return None
        if self._filled == 0:
            self._began_us = now_us()
        count = os.readv(pipe, [memoryview(self._picture)[self._filled :]])
        if count == 0:
            raise CameraLost(f"{self.name}: {self._last_words or 'has ended'}")
        self._filled += count
        if self._filled < len(self._picture):
            return None
        self._filled = 0
        self._patient_until = time.monotonic() + READ_PATIENCE_S
        planes = np.frombuffer(self._picture, np.uint8).reshape(self._height * 3 // 2, self._width)
        return Taken(av.VideoFrame.from_ndarray(planes, format="yuv420p"), self._began_us)

    def close(self) -> None:
        child, self._child = self._child, None
        if child is None:
            return
        child.terminate()
        try:
            child.wait(_KILL_AFTER_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        assert child.stdout is not None
        child.stdout.close()

    def _arguments(self, rate_hz: float) -> list[str]:
        return [
            *("--camera", str(self._number), "--timeout", "0", "--nopreview", "--verbose", "0", "--flush"),
            *("--codec", "yuv420", "--width", str(self._width), "--height", str(self._height)),
            *("--framerate", f"{rate_hz:g}", "--output", "-"),
        ]

    def _listen(self, pipe: IO[bytes]) -> None:
        """Keeps the last line of the program's error output, which says why it ended."""
        with pipe:
            for line in pipe:
                words = line.decode(errors="replace").strip()
                if words:
                    self._last_words = words[:150]
