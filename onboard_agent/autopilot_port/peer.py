"""Finds the autopilot among the senders to an open UDP port. No I/O.

The peer is learned only from a packet that contains a valid frame. It stays the peer until it has been silent for a
while: a stranger who sends one frame must not receive the drone's commands.
"""

from typing import Final

from wire.frame_stream import FrameStream
from wire.frames import is_known

Address = tuple[str, int]

FAITHFUL_FOR_S: Final = 3.0
"""Silence after which another peer is accepted: three missing heartbeats."""


class PeerChoice:
    """Call `accepts` for each packet; replies go to `address`, which is None before the first valid frame."""

    def __init__(self) -> None:
        self.address: Address | None = None
        self._heard_at = 0.0

    def accepts(self, sender: Address, packet: bytes, now: float) -> bool:
        """Whether the packet is the autopilot's. Learns the peer if there is none, or if the old one is silent."""
        if sender == self.address:
            self._heard_at = now
            return True
        if self.address is not None and now - self._heard_at < FAITHFUL_FOR_S:
            return False
        if not any(is_known(frame) for frame in FrameStream().feed(packet)):
            return False
        self.address = sender
        self._heard_at = now
        return True
