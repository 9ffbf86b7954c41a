"""The radio receiver on an SBUS line, as a flight controller judges it: values, lost frames, failsafe, silence."""

from __future__ import annotations

from simulator.serial_inputs.sbus import SbusDecoder, SbusFrame

SILENT_AFTER_S = 0.5
MAX_LOST_IN_ROW = 20
"""At a frame each 9 ms: 0.18 s of repeated values."""


class SbusRadio:
    def __init__(self) -> None:
        self._decoder = SbusDecoder()
        self._heard_s: float | None = None
        self._lost_in_row = 0
        self.frame: SbusFrame | None = None
        """The last one; its channels stay when the radio is lost."""

    def receive(self, data: bytes, now_s: float) -> None:
        for frame in self._decoder.receive(data):
            self._heard_s = now_s
            self._lost_in_row = self._lost_in_row + 1 if frame.frame_lost else 0
            self.frame = frame

    def ok(self, now_s: float) -> bool:
        """Whether a transmitter is heard."""
        if self.frame is None or self._heard_s is None or self.frame.failsafe:
            return False
        return now_s - self._heard_s <= SILENT_AFTER_S and self._lost_in_row < MAX_LOST_IN_ROW

    def sticks_us(self) -> tuple[int, ...]:
        """Pulse lengths of all channels; empty before the first frame."""
        return self.frame.pwm_us() if self.frame is not None else ()
