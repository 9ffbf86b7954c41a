"""The interface of every encoder: a picture in, and at once all that a decoder needs to show it."""

from typing import NamedTuple, Protocol

from onboard_agent.video.sources.source import Picture
from wire.video import Codec


class EncoderBroken(Exception):
    """The codec has failed. Close it and make a new one. The text is one line for users."""


class EncodedPicture(NamedTuple):
    """The payload of one unit. `width`, `height`: of the encoded picture, in pixels. `key`: decoding can begin here."""

    payload: bytes
    key: bool
    width: int
    height: int
    capture_us: int
    is_break: bool


class Encoder(Protocol):
    """One stream (quality and codec). Blocking; used by one thread. Holds no picture back.

    Its pictures form a chain: a picture returned by `encode` must be sent, or the next one must be a key picture. So do
    not encode a picture that will not be sent.
    """

    @property
    def codec(self) -> Codec: ...

    @property
    def name(self) -> str:
        """Name of the codec for log lines: "mpeg1video", "libx264", "h264_v4l2m2m"."""
        ...

    def encode(self, picture: Picture, *, force_key: bool = False) -> list[EncodedPicture]:
        """Returns this picture as one entry, or an empty list from a hardware encoder that is still filling. Key
        pictures also come without `force_key`: at the start, at least once a second, after a break and when the shape
        changes. Raises EncoderBroken."""
        ...

    def retune(self, *, bits_per_s: int, rate_hz: float, scale: float = 1.0) -> None:
        """Sets the target. `rate_hz`: pictures per second that will be passed in. `scale`: (0..1] of the quality's
        width and height. Some of it takes effect only at the next key picture, which comes soon enough by itself."""
        ...

    def close(self) -> None:
        """Releases the codec. May be called twice."""
        ...
