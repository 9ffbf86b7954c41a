"""One agent's live link as the hub sees it: the sealed data channel, its address, the way to its control channel."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

from server.relay.live_messages import LinkOver, LinkQuality
from wire.content import LARGEST_URGENT_BYTES
from wire.control_messages import HoldProgress, ToAgent, encode_message
from wire.ids import DroneId, Epoch, LinkId
from wire.link_quality import LONG_WINDOW_S, SHORT_WINDOW_S
from wire.sealed_link import SealedLink

Address = tuple[str, int]
SendDatagram = Callable[[bytes, Address], None]
PostMessage = Callable[[ToAgent], None]
CallLater = Callable[[float, Callable[[float], None]], object]
"""Calls back after so many seconds, with the time that it is then."""

NEVER: Final = float("-inf")

COPIES: Final = 4
COPIES_AT_ONCE: Final = 2
"""Two at once get through 399 of 400 times where one in twenty is lost; the rest are for losses that come in a row."""

MOST_REMEMBERED: Final = 64

SILENT_AFTER_S: Final = 3.0
"""A link that sent nothing for so long counts as offline: six keep-alives in a row are missing."""


class AgentLink:
    """Created by the control channel at sign-in, owned by the hub until it is detached."""

    def __init__(
        self,
        *,
        sealed: SealedLink,
        send_datagram: SendDatagram,
        post: PostMessage,
        close: Callable[[int, str], None],
        call_later: CallLater,
    ) -> None:
        self.sealed = sealed
        self.address: Address | None = None
        """Where the newest authentic datagram came from; None until the first one."""
        self.post = post
        """Puts a message onto the control channel. Never blocks; a channel that cannot take it is closed."""
        self.close = close
        """Closes the control channel with a code and a reason."""
        self.mute_until = NEVER
        """A rehearsal: nothing is sent on the data channel until then."""
        self._send_datagram = send_datagram
        self._call_later = call_later
        self._alarm_set = False
        self._repeats: list[tuple[bytes, int]] = []
        """Urgent messages and how many more copies of each are to be sent."""
        self._told: deque[HoldProgress] = deque(maxlen=MOST_REMEMBERED)
        self._newest_step = 0

    @property
    def link_id(self) -> LinkId:
        return self.sealed.link_id

    @property
    def drone_id(self) -> DroneId:
        return self.sealed.drone_id

    def quality(self, now: float) -> LinkQuality:
        """As the browsers are told, once a second."""
        keepalive, quality = self.sealed.keepalive, self.sealed.quality
        return LinkQuality(
            drone_id=self.drone_id,
            rtt_ms=None if keepalive.rtt_s is None else round(keepalive.rtt_s * 1000, 1),
            loss=round(keepalive.loss, 3),
            over_1s=LinkOver.of(quality.over(SHORT_WINDOW_S, now)),
            over_30s=LinkOver.of(quality.over(LONG_WINDOW_S, now)),
            path_mtu=self.sealed.datagram_bytes,
            transport="udp",
            uplinks=1,
        )

    def is_heard(self, now: float) -> bool:
        """Whether the data channel works: something authentic came, and not too long ago."""
        return self.address is not None and self.sealed.keepalive.silent_for(now) <= SILENT_AFTER_S

    def send_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> bool:
        """Seals frames and sends them, at once if they are urgent (wire.batching). False if there is no address to
        send them to."""
        if self.address is None:
            return False
        if now < self.mute_until:
            return True
        for datagram in self.sealed.batch_frames(epoch, frames, now):
            self._send_datagram(datagram, self.address)
        due_at = self.sealed.batch_due_at
        if due_at is not None and not self._alarm_set:
            self._alarm_set = True
            self._call_later(due_at - now, self._send_batch)
        return True

    def _send_batch(self, now: float) -> None:
        self._alarm_set = False
        for datagram in self.sealed.batch_due(now):
            if self.address is not None and now >= self.mute_until:
                self._send_datagram(datagram, self.address)
        due_at = self.sealed.batch_due_at
        if due_at is not None:
            # An urgent frame has taken the batch along for which the alarm was set, and another has begun since.
            self._alarm_set = True
            self._call_later(due_at - now, self._send_batch)

    def send_urgent(self, message: ToAgent) -> None:
        """Sends a message on the data channel, several times, beside the control channel: a hold must not wait until
        TCP has noticed a lost packet. The agent counts it once."""
        text = encode_message(message).encode()
        self.post(message)
        if len(text) > LARGEST_URGENT_BYTES:
            return
        copies = 0
        if self.address is not None and self.mute_until == NEVER:
            copies = COPIES_AT_ONCE
            for _ in range(copies):
                self._send_datagram(self.sealed.seal_urgent(text), self.address)
        if len(self._repeats) < MOST_REMEMBERED:
            self._repeats.append((text, COPIES - copies))

    def is_news(self, progress: HoldProgress) -> bool:
        """Whether this step of a hold was not told before: it comes on two channels, and more than once.

        Copies are equal in everything; two holds of one epoch that went alike still differ in `number`. A step between
        that was overtaken by a later one is no news any more; how a hold ended always is.
        """
        overtaken = 0 < progress.number < self._newest_step and not progress.step.final
        if overtaken or progress in self._told:
            return False
        self._told.append(progress)
        self._newest_step = max(self._newest_step, progress.number)
        return True

    def send_keepalives(self, now: float) -> None:
        """Sends what the keep-alive has to say and another copy of what is urgent, if there is somewhere to send it."""
        if self.address is None or now < self.mute_until:
            return
        for datagram in self.sealed.datagrams_to_send(now):
            self._send_datagram(datagram, self.address)
        repeats, self._repeats = self._repeats, []
        for text, copies in repeats:
            self._send_datagram(self.sealed.seal_urgent(text), self.address)
            if copies > 1:
                self._repeats.append((text, copies - 1))
