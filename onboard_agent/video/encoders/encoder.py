"""What every encoder is: pictures in, for each at once what a decoder needs to show it."""

from typing import NamedTuple, Protocol

from onboard_agent.video.sources.source import Picture
from wire.video import Codec


class EncoderBroken(Exception):
    """The codec has failed. Close it and make another one. The text is one line for a person."""


class EncodedPicture(NamedTuple):
    """The payload of one unit. `width`, `height`: of the coded picture, in pixels. `key`: decoding can begin here."""

    payload: bytes
    key: bool
    width: int
    height: int
    capture_us: int
    is_break: bool


class Encoder(Protocol):
    """One stream (quality and codec). Blocking; used by one thread. Holds no picture back.

    Its pictures form a chain: what `encode` has given has to be sent, or the next one has to be a key picture. So a
    picture that is not to be sent is better not encoded at all.
    """

    @property
    def codec(self) -> Codec: ...

    @property
    def name(self) -> str:
        """Name of the codec, for log lines: "mpeg1video", "libx264", "h264_v4l2m2m"."""
        ...

    def encode(self, picture: Picture, *, force_key: bool = False) -> list[EncodedPicture]:
        """One entry: this picture. An empty list: a hardware encoder that is still filling.

        A key picture also comes by itself: first of all, at least once a second, after a break and when the shape
        changes. Raises EncoderBroken.
        """
        ...

    def retune(self, *, bits_per_s: int, rate_hz: float, scale: float = 1.0) -> None:
        """The new target. `rate_hz`: pictures a second. `scale`: (0..1] of the quality's width and height. Some of it
        takes effect only at the next key picture, which comes soon by itself."""
        ...

    def close(self) -> None:
        """Lets go of the codec. Safe twice."""
        ...
