"""Writes to the PWM pins of Linux. Thin shell around `Servo`; the writes take microseconds and block."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
from pathlib import Path
from typing import Final

from onboard_agent.payload.servo import Servo, Write

_log = logging.getLogger(__name__)

ROOT: Final = Path("/sys/class/pwm")


class SysfsPwm:
    """Opens a servo's pin with its first command, and again after an error: udev gives the files to the agent's group
    only some time after they appear."""

    def __init__(self, root: Path = ROOT) -> None:
        self._root = root
        self._open: set[Servo] = set()

    def move(self, servo: Servo, pulse_us: float) -> None:
        """Raises OSError if the pin cannot be written, ValueError for a pulse beyond the servo's range."""
        writes = servo.move(pulse_us)
        if servo not in self._open:
            try:
                self._write(servo.export())
            except OSError as error:
                if error.errno != errno.EBUSY:
                    raise
            try:
                self._write(servo.period())
            except OSError as error:
                if error.errno != errno.EINVAL:
                    raise
                self._write(servo.no_pulse())
                self._write(servo.period())
            self._open.add(servo)
        try:
            for write in writes:
                self._write(write)
        except OSError:
            self._open.discard(servo)
            raise

    def close(self) -> None:
        """Stops all pulses. A gripper must not be driven by nobody."""
        for servo in self._open:
            with contextlib.suppress(OSError):
                for write in servo.end():
                    self._write(write)
        self._open.clear()

    def _write(self, write: Write) -> None:
        name, data = write
        number = os.open(self._root / name, os.O_WRONLY)  # one write, as the kernel reads it; nothing is created
        try:
            os.write(number, data)
        finally:
            os.close(number)
