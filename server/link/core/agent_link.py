"""One agent's live link as the hub sees it: the sealed data channel, its address, the way to its control channel."""

from collections import Counter, deque
from collections.abc import Callable, Collection, Sequence
from typing import Final

from server.link.core.agent_routes import OVER_CHANNEL, Address, AgentRoutes
from server.live.live_messages import LinkOver, LinkQuality
from wire.content import MAX_URGENT_BYTES
from wire.control_messages import HoldOrder, ToAgent, encode_message
from wire.datagram_lane import STALLED_AFTER_S
from wire.drops import DropCounts, Dropped, DropReason
from wire.ids import DroneId, Epoch, LinkId
from wire.link_quality import LONG_WINDOW_S
from wire.negotiation import understands
from wire.open_holds import OPEN_HOLDS
from wire.sealed_link import Received, SealedLink

SendDatagram = Callable[[bytes, Address], None]
PostMessage = Callable[[ToAgent], None]
Waiting = Callable[[], tuple[int, int]]
"""(messages, datagrams) that wait until the control channel takes them."""
CallLater = Callable[[float, Callable[[float], None]], object]
"""Calls back after this many seconds, with the time at that moment."""

COPIES: Final = 4
COPIES_AT_ONCE: Final = 2
"""Two at once get through 399 of 400 times where one in twenty is lost; the rest are for losses that come in a row."""

MAX_REPEATED: Final = 64
MAX_ORDERS: Final = 8
"""Orders to hold that no step has answered yet. The newest order covers the older ones."""

SILENT_AFTER_S: Final = 3.0
"""A link that has been silent for this long counts as offline: five or six keep-alives in a row are missing."""


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
        resume_key: bytes = b"",
        channel: object = None,
        waiting: Waiting | None = None,
        takes: Collection[str] = (),
        process: int = 0,
        ticket: str = "",
        agent_version: str | None = None,
        drops: DropCounts | None = None,
    ) -> None:
        self.sealed = sealed
        self.ticket = ticket
        """Shown with what the agent does by HTTP; empty: nothing may be done by one."""
        self.takes = frozenset(takes)
        """Groups of messages that the agent understands besides those that all do."""
        self.agent_version = agent_version
        """As the agent reports; None: nothing that looks like one."""
        self.process = process
        """Number of the agent process at the other end; 0: not reported."""
        self.waiting = waiting or _nothing_waits
        self.resume_key = resume_key
        """Proves possession of the link (wire.resuming); empty: it cannot be resumed."""
        self.channel = channel
        """Whose link this is: the newest control channel that it had."""
        self.has_channel = True
        """Whether the control channel is open, as far as is known."""
        self.routes = AgentRoutes()
        self._post = post
        self._drops = Counter() if drops is None else drops
        self.close = close
        """Closes the control channel with a code and a reason."""
        self._muted = False
        """A rehearsal: nothing is sent on the data channel."""
        self._rehearsals = 0
        self._send_datagram = send_datagram
        self._call_later = call_later
        self._alarm_set = False
        self._repeats: list[tuple[bytes, int]] = []
        """Urgent messages and how many more copies of each are to be sent."""
        self._orders: deque[HoldOrder] = deque(maxlen=MAX_ORDERS)
        self._numbered = 0

    @property
    def link_id(self) -> LinkId:
        return self.sealed.link_id

    @property
    def drone_id(self) -> DroneId:
        return self.sealed.drone_id

    @property
    def knows_open_holds(self) -> bool:
        """Whether its agent tells how a hold goes on, and lets a return go on in an order that does not interrupt."""
        return OPEN_HOLDS in self.takes

    def post(self, message: ToAgent) -> None:
        """Puts a message onto the control channel. Never blocks; a channel that cannot take it is closed."""
        if self._understands(message):
            self._post(message)

    def _understands(self, message: ToAgent) -> bool:
        """The last check: an unknown message would end the channel. Whoever sends it has refused before that, in
        words."""
        if understands(self.takes, message):
            return True
        self._drops[DropReason.NOT_UNDERSTOOD] += 1
        return False

    def quality(self, now: float) -> LinkQuality:
        """The link's figures for browsers, once a second."""
        keepalive, quality = self.sealed.keepalive, self.sealed.quality
        return LinkQuality(
            drone_id=self.drone_id,
            rtt_ms=None if keepalive.rtt_s is None else round(keepalive.rtt_s * 1000, 1),
            loss=round(keepalive.loss, 3),
            over_1s=LinkOver.of(quality.over(self.sealed.short_window_s(), now)),
            over_30s=LinkOver.of(quality.over(LONG_WINDOW_S, now)),
            path_mtu=self.sealed.datagram_bytes,
            transport="websocket" if self.routes.newest == OVER_CHANNEL else "udp",
            uplinks=self.routes.count,
        )

    def is_heard(self, now: float) -> bool:
        """Whether the data channel works: something authentic came, and not too long ago."""
        return self.routes.newest is not None and self.sealed.keepalive.silent_for(now) <= SILENT_AFTER_S

    def receive(self, datagram: bytes, address: Address, now: float) -> Received:
        """Opens a datagram that came from `address`, follows it there, and answers. Raises Dropped with the first check
        that it fails."""
        try:
            received = self.sealed.receive(datagram, now)
        except Dropped as dropped:
            if dropped.reason is DropReason.REPLAYED and self.routes.may_be_copy(address):
                raise Dropped(DropReason.DUPLICATE) from None
            raise
        if received.newest and address != self.routes.newest:
            self.routes.follow(address)
        if received.uplink is not None:
            self.routes.uplink(received.uplink, address, now)
        if received.answer is not None and not self._muted:
            self._send_datagram(received.answer, address)
        if self._repeats or self.sealed.has_to_send(now):
            self.send_keepalives(now)
        return received

    def send_frames(self, epoch: Epoch, frames: Sequence[bytes], now: float) -> bool:
        """Seals frames and sends them, at once if they are urgent (wire.batching). False if there is no way to send
        them, or one that has stalled."""
        newest = self.routes.newest
        if newest is None or (newest == OVER_CHANNEL and self.sealed.unproven_s(now) > STALLED_AFTER_S):
            return False
        if self._muted:
            return True
        self._send(self.sealed.batch_frames(epoch, frames, now))
        self._set_alarm(now)
        return True

    def _send(self, datagrams: Sequence[bytes]) -> None:
        for datagram in datagrams:
            for address in self.routes.targets:
                self._send_datagram(datagram, address)

    def _set_alarm(self, now: float) -> None:
        due_at = self.sealed.batch_due_at
        if due_at is not None and not self._alarm_set:
            self._alarm_set = True
            self._call_later(due_at - now, self._send_batch)

    def _send_batch(self, now: float) -> None:
        self._alarm_set = False
        datagrams = self.sealed.batch_due(now)
        if not self._muted:
            self._send(datagrams)
        # An urgent frame may have taken the waiting ones along, and more may have arrived since.
        self._set_alarm(now)

    def next_number(self) -> int:
        """For a message that arrives on two channels, of which only the newest counts."""
        self._numbered += 1
        return self._numbered

    def mute(self, for_s: float) -> None:
        """Rehearses a loss: sends nothing on the data channel for this long. The newest rehearsal counts."""
        self._muted = True
        self._rehearsals += 1
        rehearsal = self._rehearsals

        def over(now: float) -> None:
            if rehearsal == self._rehearsals:
                self._muted = False

        self._call_later(for_s, over)

    # -- without a control channel, and with another one ------------------------------------------------------

    def forget_channel(self) -> None:
        """The control channel is gone and the link continues. Posted messages wait for the next channel."""
        self.has_channel = False
        self._post = _lose
        self.close = _close_nothing
        self.waiting = _nothing_waits

    def adopt(
        self,
        *,
        send_datagram: SendDatagram,
        post: PostMessage,
        close: Callable[[int, str], None],
        channel: object,
        waiting: Waiting,
    ) -> None:
        """Another control channel takes the place of the one that it had. Orders that are open are posted on it."""
        self.has_channel = True
        self._send_datagram = send_datagram
        self._post, self.close, self.channel, self.waiting = post, close, channel, waiting
        for order in self._orders:
            post(order)

    def repeat_orders(self) -> None:
        """Repeats unanswered orders to hold on the data channel."""
        if not self._muted and self.routes.newest is not None:
            self._send([self.sealed.seal_urgent(encode_message(order).encode()) for order in self._orders])

    # -- urgent messages -----------------------------------------------------------------------------------------

    def send_urgent(self, message: ToAgent) -> None:
        """Sends a message on the data channel, several times, beside the control channel: a hold must not wait until
        TCP has noticed a lost packet. The agent counts it once."""
        if not self._understands(message):
            return
        text = encode_message(message).encode()
        self._post(message)
        if isinstance(message, HoldOrder):
            self._orders.append(message)
        if len(text) > MAX_URGENT_BYTES:
            return
        copies = 0
        if self.routes.newest is not None and not self._muted:
            copies = COPIES_AT_ONCE
            self._send([self.sealed.seal_urgent(text) for _ in range(copies)])
        if len(self._repeats) < MAX_REPEATED:
            self._repeats.append((text, COPIES - copies))

    def send_newest(self, message: ToAgent, now: float) -> None:
        """Sends a message once, and on the data channel only: the next one takes its place. Where there is no way, or
        one that has stalled, it is not sent at all."""
        if not self._understands(message):
            return
        newest = self.routes.newest
        if newest is None or self._muted or (newest == OVER_CHANNEL and self.sealed.unproven_s(now) > STALLED_AFTER_S):
            return
        self._send([self.sealed.seal_urgent(encode_message(message).encode())])

    @property
    def interrupts(self) -> bool:
        """Whether an order is open that also interrupts a return or a landing. The next one must not take that back."""
        return any(one.interrupts for one in self._orders)

    def answered(self, order_id: int) -> None:
        """A step arrived for the hold of this order (0: for a hold without an order)."""
        if order_id:
            self._orders = deque((one for one in self._orders if one.order_id > order_id), MAX_ORDERS)

    def wants_time(self, now: float) -> bool:
        """Whether `send_keepalives` has something, or the agent has been silent for too long."""
        sealed = self.sealed  # `is_heard` without its calls: this is asked of each link, ten times a second
        silent_s = now - sealed.keepalive.heard_at
        if silent_s > SILENT_AFTER_S or self._repeats or self.routes.newest is None:
            return True
        return sealed.has_to_send(now)

    def send_keepalives(self, now: float) -> None:
        """Sends a keep-alive and another copy of urgent messages, if the agent's address is known."""
        if not self._repeats and not self.sealed.has_to_send(now):
            return  # nearly always: it is asked for each datagram that comes, and at each tick
        self.routes.forget_silent(now)
        if self.routes.newest is None or self._muted:
            return
        self._send(self.sealed.datagrams_to_send(now))
        repeats, self._repeats = self._repeats, []
        for text, copies in repeats:
            self._send([self.sealed.seal_urgent(text)])
            if copies > 1:
                self._repeats.append((text, copies - 1))


def _lose(message: ToAgent) -> None:
    """Where a control channel was."""


def _close_nothing(code: int, why: str) -> None:
    """There is nothing to close."""


def _nothing_waits() -> tuple[int, int]:
    return 0, 0
