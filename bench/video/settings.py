"""Camera settings, and the lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bench.link_model import Profile
from wire.video import LIMITS, Codec, Quality

CODEC_WORDS: Final = {Codec.MPEG1: "mpeg1", Codec.H264: "h264"}


@dataclass(frozen=True, slots=True)
class Setting:
    """Camera and requested stream: both systems have the same size, rate and bit rate."""

    quality: Quality
    codec: Codec = Codec.MPEG1

    @property
    def width(self) -> int:
        return LIMITS[self.quality].width

    @property
    def height(self) -> int:
        return LIMITS[self.quality].height

    @property
    def rate_hz(self) -> float:
        return LIMITS[self.quality].rate_hz

    @property
    def bits_per_s(self) -> int:
        return LIMITS[self.quality].bits_per_s

    @property
    def size(self) -> str:
        return f"{self.width}x{self.height}"

    @property
    def words(self) -> str:
        return f"{self.size}@{self.rate_hz:g}" + ("" if self.codec is Codec.MPEG1 else ", H.264")


SMALL: Final = Setting(Quality.MEDIUM)
LARGE: Final = Setting(Quality.HIGH)
H264: Final = Setting(Quality.HIGH, Codec.H264)


@dataclass(frozen=True, slots=True)
class Line:
    """An access link, from the view of its host."""

    words: str
    up: Profile
    down: Profile

    @property
    def ways(self) -> dict[str, Profile]:
        return {"up": self.up, "down": self.down}


def _same(words: str, profile: Profile) -> Line:
    return Line(words, profile, profile)


WIFI: Final = _same("Wi-Fi", Profile(delay_s=0.002, jitter_s=0.004, loss=0.001, rate_bps=20e6))
"""2 to 6 ms each way, and the losses that remain after link-layer retries."""
FOUR_G: Final = _same("4G", Profile(delay_s=0.025, loss=0.01))
"""50 ms round trip, 1 % of the packets lost each way."""
THREE_G: Final = Line("3G", Profile(delay_s=0.075, rate_bps=1e6), Profile(delay_s=0.075, rate_bps=2e6))
"""150 ms round trip, 1 Mbit/s up, 2 Mbit/s down."""
UPLINK: Final = Line("2 Mbit/s up", Profile(delay_s=0.01, rate_bps=2e6), Profile(delay_s=0.01))
LINES: Final = (WIFI, FOUR_G, THREE_G)
