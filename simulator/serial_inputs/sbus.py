"""SBUS: sixteen proportional and two digital channels of a radio receiver, in frames of 25 bytes.

A frame is 0x0F, 22 bytes with sixteen numbers of 11 bits (lowest bit first), flags, and an end byte. The line has no
checksum, so a frame counts only if its first and last byte are right, and the decoder finds its way back after noise.
"""

from __future__ import annotations

from dataclasses import dataclass

HEADER = 0x0F
FRAME_BYTES = 25
CHANNELS = 16
MAX_VALUE = 0x7FF
_ENDS = frozenset({0x00, 0x04, 0x14, 0x24, 0x34})
"""0x00, and the four slots of SBUS2."""
_CHANNEL_17, _CHANNEL_18, _FRAME_LOST, _FAILSAFE = 0x01, 0x02, 0x04, 0x08


@dataclass(frozen=True, slots=True)
class SbusFrame:
    """`channels`: 0..2047, 172 to 1811 from a usual radio."""

    channels: tuple[int, ...]
    channel_17: bool = False
    channel_18: bool = False
    frame_lost: bool = False
    """The receiver missed this frame and repeats the last one."""
    failsafe: bool = False
    """The receiver has lost its transmitter."""

    def pwm_us(self) -> tuple[int, ...]:
        """Pulse lengths: 172 is 988, 1811 is 2012, as flight controllers convert them."""
        return tuple(round(value * 0.625) + 880 for value in self.channels)


def encode(frame: SbusFrame) -> bytes:
    """Raises ValueError for channels that have no room in a frame."""
    if len(frame.channels) != CHANNELS or not all(0 <= value <= MAX_VALUE for value in frame.channels):
        raise ValueError("a frame has 16 channels of 11 bits")
    bits = sum(value << (11 * index) for index, value in enumerate(frame.channels))
    flags = (
        _CHANNEL_17 * frame.channel_17
        | _CHANNEL_18 * frame.channel_18
        | _FRAME_LOST * frame.frame_lost
        | _FAILSAFE * frame.failsafe
    )
    return bytes((HEADER, *bits.to_bytes(22, "little"), flags, 0x00))


class SbusDecoder:
    """Takes bytes in any portions. Holds back less than one frame."""

    def __init__(self) -> None:
        self._waiting = bytearray()
        self.skipped_bytes = 0

    def receive(self, data: bytes) -> list[SbusFrame]:
        frames = []
        waiting = self._waiting
        waiting += data
        at = 0
        while len(waiting) - at >= FRAME_BYTES:
            if waiting[at] == HEADER and waiting[at + FRAME_BYTES - 1] in _ENDS:
                frames.append(_decode(waiting[at : at + FRAME_BYTES]))
                at += FRAME_BYTES
            else:
                at += 1
                self.skipped_bytes += 1
        del waiting[:at]
        return frames


def _decode(frame: bytearray) -> SbusFrame:
    bits, flags = int.from_bytes(frame[1:23], "little"), frame[23]
    return SbusFrame(
        tuple((bits >> (11 * index)) & MAX_VALUE for index in range(CHANNELS)),
        channel_17=bool(flags & _CHANNEL_17),
        channel_18=bool(flags & _CHANNEL_18),
        frame_lost=bool(flags & _FRAME_LOST),
        failsafe=bool(flags & _FAILSAFE),
    )
