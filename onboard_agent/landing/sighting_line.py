"""The lines from the process that looks for the landing pad: one JSON object each. Pure."""

from __future__ import annotations

from typing import Final

import msgspec

from onboard_agent.vision.landing_target import LandingTarget

MAX_LINE_BYTES: Final = 4096


class SightingLine(msgspec.Struct, frozen=True):
    """A picture that shows the pad. `taken_s`: by CLOCK_MONOTONIC."""

    taken_s: float
    target: LandingTarget


_DECODER: Final = msgspec.json.Decoder(SightingLine)


def encode_line(line: SightingLine) -> bytes:
    return msgspec.json.encode(line) + b"\n"


def decode_line(line: bytes) -> SightingLine:
    """Raises msgspec.DecodeError."""
    return _DECODER.decode(line)
