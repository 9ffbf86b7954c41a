"""What the link to the tower reports, and to whom. No I/O."""

from typing import Protocol

from wire.content import Frames
from wire.control_messages import ToAgent, Welcome


class LinkUser(Protocol):
    """Receives the events of the link."""

    def link_up(self, welcome: Welcome) -> None:
        """The agent has signed in and the data channel is open."""

    def link_down(self) -> None:
        """The link has ended."""

    def link_resumed(self) -> None:
        """The link has another control channel, on which everything must be reported again."""

    def message(self, message: ToAgent) -> None:
        """A message arrived on the control channel."""

    def frames(self, frames: Frames) -> None:
        """Frames arrived on the data channel: authentic and fresh, not yet checked for drone and epoch."""

    def tower_heard(self) -> None:
        """Any authentic datagram arrived."""
