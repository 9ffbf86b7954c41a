"""One agent's live link as the hub sees it: the sealed data channel, its address, the way to its control channel."""

from collections.abc import Callable, Sequence
from typing import Final

from wire.control_messages import ToAgent
from wire.ids import DroneId, Epoch, LinkId
from wire.sealed_link import SealedLink

Address = tuple[str, int]
SendDatagram = Callable[[bytes, Address], None]
PostMessage = Callable[[ToAgent], None]

SILENT_AFTER_S: Final = 3.0
"""A link that sent nothing for so long counts as offline: six keep-alives in a row are missing."""


class AgentLink:
    """Created by the control channel at sign-in, owned by the hub until it is detached."""

    def __init__(
        self, *, sealed: SealedLink, send_datagram: SendDatagram, post: PostMessage, close: Callable[[int, str], None]
    ) -> None:
        self.sealed = sealed
        self.address: Address | None = None
        """Where the newest authentic datagram came from; None until the first one."""
        self.post = post
        """Puts a message onto the control channel. Never blocks; a channel that cannot take it is closed."""
        self.close = close
        """Closes the control channel with a code and a reason."""
        self.mute_until = float("-inf")
        """A rehearsal: nothing is sent on the data channel until then."""
        self._send_datagram = send_datagram

    @property
    def link_id(self) -> LinkId:
        return self.sealed.link_id

    @property
    def drone_id(self) -> DroneId:
        return self.sealed.drone_id

    def is_heard(self, now: float) -> bool:
        """Whether the data channel works: something authentic came, and not too long ago."""
        return self.address is not None and self.sealed.keepalive.silent_for(now) <= SILENT_AFTER_S

    def send_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> bool:
        """Seals frames and sends them. False if there is no address to send them to."""
        if self.address is None:
            return False
        if now < self.mute_until:
            return True
        for datagram in self.sealed.seal_frames(epoch, frames, now):
            self._send_datagram(datagram, self.address)
        return True

    def send_keepalives(self, now: float) -> None:
        """Sends what the keep-alive has to say, if there is somewhere to send it."""
        if self.address is None or now < self.mute_until:
            return
        for datagram in self.sealed.datagrams_to_send(now):
            self._send_datagram(datagram, self.address)
