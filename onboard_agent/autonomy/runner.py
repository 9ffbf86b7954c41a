"""Runs a controller in its process: telemetry from standard input, directions to what was standard output.

One thread on purpose: the sign of life is that `step` returns. Standard output itself becomes standard error, so that
a controller's `print` cannot be mistaken for a report.
"""

import os
import select
import sys
import traceback
from typing import Final

from onboard_agent.autonomy.cameras import ControllerCameras
from onboard_agent.autonomy.controller import Controller
from onboard_agent.autonomy.controller_settings import with_settings
from onboard_agent.autonomy.core.lines import (
    MAX_LINE_BYTES,
    Beat,
    Directed,
    FromController,
    Note,
    Raised,
    Ready,
    Seen,
    SetUp,
    decode_to_controller,
    encode_line,
)
from onboard_agent.autonomy.loading import load
from onboard_agent.autonomy.pose_history import PoseHistory

BEAT_EVERY_S: Final = 0.1
_INPUT: Final = 0


class Lines:
    """The lines from the flight process."""

    def __init__(self) -> None:
        self._buffer = b""

    def read(self, timeout_s: float | None) -> list[bytes]:
        """Returns the whole lines that have come; none after the timeout. Raises EOFError."""
        ready, _, _ = select.select([_INPUT], [], [], timeout_s)
        if not ready:
            return []
        data = os.read(_INPUT, MAX_LINE_BYTES)
        if not data:
            raise EOFError
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        return lines


class Runner:
    """`out`: the descriptor for reports."""

    def __init__(self, out: int) -> None:
        self._out = out
        self._lines = Lines()
        self._number = 0
        self._poses = PoseHistory()
        self._cameras = ControllerCameras((), self._poses)

    def run(self) -> None:
        """Returns when the flight process closes the input, or the controller fails."""
        try:
            while not (first := self._lines.read(None)):
                continue
            set_up = decode_to_controller(first[0])
            assert isinstance(set_up, SetUp)
            controller = self._loaded(set_up)
            self._say(Ready())
            while True:
                self._step(controller, self._lines.read(BEAT_EVERY_S))
        except (EOFError, BrokenPipeError):
            return
        except Exception as error:  # the controller's: whatever it is, the drone holds
            traceback.print_exc()
            self._say(Raised(f"{type(error).__name__}: {error}"[:400]))

    def _loaded(self, set_up: SetUp) -> Controller:
        controller = load(set_up.name, set_up.source)
        self._cameras = ControllerCameras(set_up.cameras, self._poses, frames_path=set_up.frames_path)
        controller.cameras = self._cameras
        controller.beat = self._beat
        controller.report = self._say
        controller.note = lambda words, aloud: self._say(Note(words[:400], aloud))
        controller.begin(with_settings(set_up, controller.described_settings))
        return controller

    def _step(self, controller: Controller, lines: list[bytes]) -> None:
        direction = None
        seen: Seen | None = None
        for line in lines:
            told = decode_to_controller(line)
            assert isinstance(told, Seen)
            self._poses.add(told)
            seen = told
        if seen is not None:  # only the newest telemetry counts
            direction = controller.step(seen)
        if direction is None:
            self._beat()
            return
        self._number += 1
        self._say(Directed(self._number, direction))

    def _beat(self) -> None:
        self._say(Beat(self._cameras.taken))

    def _say(self, line: FromController) -> None:
        os.write(self._out, encode_line(line))


def main() -> None:
    """Runs the controller that the first line names."""
    out = os.dup(1)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    Runner(out).run()
