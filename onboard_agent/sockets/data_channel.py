"""The data channel of one link: sealed datagrams over every uplink at once, or over the control channel's WebSocket.

The asyncio shell around `wire.sealed_link` and `wire.transport_choice`: sockets and timers, no decisions.
"""

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final, Protocol

from onboard_agent.sockets.data_socket import DataSocket
from wire.content import Frames
from wire.datagram_lane import STALLED_AFTER_S, DatagramLane
from wire.drops import Dropped, DropReason
from wire.ids import Epoch
from wire.path_mtu import PathMtus
from wire.sealed_link import Received, SealedLink
from wire.transport_choice import IN_DOUBT_AFTER_S, Transport, TransportChoice

_log = logging.getLogger(__name__)

UDP_SILENT_S: Final = 3.0
"""Silence after which an uplink tries another source port: a NAT may have forgotten the old one."""

UPLINK_PING_S: Final = 0.5
"""With several uplinks, each one sends its address at this interval."""

UPLINK_LOST_S: Final = 1.0
"""An uplink that receives nothing for this long is lost; normally about six datagrams a second arrive."""

UPLINK_WORKS_S: Final = 0.6
"""An uplink works if it received something within this time: a little more than the keep-alive interval."""

TICK_S: Final = 0.1


class DataUser(Protocol):
    """Receives what arrives on the data channel."""

    def frames(self, frames: Frames) -> None:
        """Frames arrived: authentic and fresh, not yet checked for drone and epoch."""

    def tower_heard(self) -> None:
        """Any authentic datagram arrived."""


class _Uplink:
    """One UDP path to the tower."""

    def __init__(self, number: int, sock: DataSocket, now: float) -> None:
        self.number = number
        self.socket = sock
        self.heard_at = now
        self.opened_at = now
        self.next_ping = now
        self.failure_logged = False


class DataChannel:
    """`wake_writer`: called when `lane` has data for the WebSocket. `urgent`: called with each urgent message.
    `closely`: whether somebody flies. Then a silent tower must be detected at once (wire.keepalive), and frames hardly
    wait for others (wire.batching)."""

    def __init__(
        self,
        sealed: SealedLink,
        *,
        host: str,
        port: int,
        uplinks: Sequence[str],
        user: DataUser,
        urgent: Callable[[bytes], None],
        wake_writer: Callable[[], None],
        counts: Counter[str],
        closely: Callable[[], bool] = lambda: True,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        now = self._loop.time()
        self.sealed = sealed
        self.choice = TransportChoice(now)
        self.lane = DatagramLane()
        self._path_mtu = PathMtus(len(uplinks), now)
        self._host, self._port = host, port
        self._user = user
        self._urgent = urgent
        self._wake_writer = wake_writer
        self._counts = counts
        self._closely = closely
        self._alarm_set = False
        self._websocket_proven_at = now
        self._uplinks = [
            _Uplink(number, DataSocket(partial(self._from_uplink, number), name), now)
            for number, name in enumerate(uplinks)
        ]

    async def open(self) -> None:
        """Opens every available uplink. Raises OSError if none can be opened."""
        failed: OSError | None = None
        for uplink in self._uplinks:
            try:
                await uplink.socket.open(self._host, self._port)
            except OSError as error:
                failed = error
                _log.warning("uplink %s cannot be opened: %s", uplink.socket.uplink, error)
        if failed is not None and not any(uplink.socket.is_open for uplink in self._uplinks):
            raise failed

    # -- for the control channel -------------------------------------------------------------------------------

    def silent_s(self, now: float) -> float:
        """Seconds since the tower was last heard on any path, without the time in which the pings rested."""
        return max(0.0, self.sealed.keepalive.silent_for(now) - self.sealed.keepalive.rests_s)

    @property
    def over_udp(self) -> bool:
        """Whether the datagrams go over UDP, and not over the control channel."""
        return self.choice.transport is Transport.UDP

    def uplinks_that_work(self, now: float) -> list[str]:
        """Returns the uplinks on which the tower was just heard, the most recent first."""
        working = [one for one in self._uplinks if now - one.heard_at <= UPLINK_WORKS_S]
        return [one.socket.uplink for one in sorted(working, key=lambda one: -one.heard_at)]

    def is_cut_off(self, local_address: str, now: float) -> bool:
        """Whether the uplink with this local address is silent while another one is not."""
        lost = any(
            one.socket.local_address == local_address and now - one.heard_at > UPLINK_LOST_S for one in self._uplinks
        )
        return lost and bool(self.uplinks_that_work(now))

    def close(self) -> None:
        for uplink in self._uplinks:
            uplink.socket.close()

    async def run(self) -> None:
        """Keeps the channel alive until cancelled."""
        while True:
            now = self._loop.time()
            before = self.choice.transport
            self.choice.tick(now)
            self._transport_changed(before, now)
            self.sealed.keepalive.at_leisure(self._there_is_time())
            self.sealed.batch_closely(self.over_udp and self._closely())
            self._send_all(self.sealed.datagrams_to_send(now), keepalive=True)
            probing = self.choice.probe_due(now)
            for uplink in self._uplinks:
                await self._renew(uplink, now)
                self._ping_uplink(uplink, now, probing=probing)
            self._probe_mtu(now)
            await asyncio.sleep(TICK_S)

    def _there_is_time(self) -> bool:
        """Whether silence may be detected a little later. With several uplinks, each is judged by what it receives."""
        return self.over_udp and len(self._uplinks) == 1 and not self._closely()

    # -- out ---------------------------------------------------------------------------------------------------

    def send_frames(self, epoch: Epoch, frames: Sequence[bytes]) -> None:
        """Sends urgent frames now, the others within the deadline of `wire.batching`."""
        self._send_all(self.sealed.batch_frames(epoch, frames, self._loop.time()))
        self._set_alarm()

    def send_urgent(self, text: bytes) -> None:
        """Sends a control-channel message over the data channel."""
        self._send_all([self.sealed.seal_urgent(text)])

    def _set_alarm(self) -> None:
        due_at = self.sealed.batch_due_at
        if due_at is not None and not self._alarm_set:
            self._alarm_set = True
            self._loop.call_at(due_at, self._send_batch)

    def _send_batch(self) -> None:
        self._alarm_set = False
        self._send_all(self.sealed.batch_due(self._loop.time()))
        # An urgent frame may have sent the batch that the alarm was set for, and more frames have arrived since.
        self._set_alarm()

    def _send_all(self, datagrams: Sequence[bytes], *, keepalive: bool = False) -> None:
        if not datagrams:
            return
        now = self._loop.time()
        if self.choice.transport is Transport.UDP or self.choice.both(now):
            for datagram in datagrams:
                for uplink in self._uplinks:
                    uplink.socket.send(datagram)
        if self.choice.transport is not Transport.WEBSOCKET:
            return
        if now - self._websocket_proven_at > STALLED_AFTER_S and not keepalive:
            self._counts["stalled"] += len(datagrams)
            return
        for datagram in datagrams:
            self.lane.put(datagram, now)
        self._wake_writer()

    def _ping_uplink(self, uplink: _Uplink, now: float, *, probing: bool) -> None:
        several = len(self._uplinks) > 1
        if several and now >= uplink.next_ping:
            uplink.next_ping = now + UPLINK_PING_S
            uplink.socket.send(self.sealed.seal_probe(now, uplink=uplink.number))
        elif probing:
            uplink.socket.send(self.sealed.seal_probe(now))

    def _probe_mtu(self, now: float) -> None:
        """Probes the MTU of every path that works."""
        if self.choice.transport is not Transport.UDP or self.sealed.unproven_s(now) > IN_DOUBT_AFTER_S:
            return
        several = len(self._uplinks) > 1
        working = [one.number for one in self._uplinks if not several or now - one.heard_at <= UPLINK_LOST_S]
        for number, size in self._path_mtu.probes_due(working, now):
            probe = self.sealed.seal_probe(now, uplink=number if several else None, datagram_bytes=size)
            self._uplinks[number].socket.send_whole(probe)
        self.sealed.fill_datagrams(self._path_mtu.datagram_bytes)

    async def _renew(self, uplink: _Uplink, now: float) -> None:
        """Reopens an uplink that is silent or could not be opened."""
        if now - max(uplink.heard_at, uplink.opened_at) < UDP_SILENT_S:
            return
        if not uplink.failure_logged:
            uplink.failure_logged = True
            _log.warning("the tower is silent on UDP port %d%s", self._port, _by(uplink.socket.uplink))
        uplink.opened_at = uplink.next_ping = now
        with contextlib.suppress(OSError):
            await uplink.socket.open(self._host, self._port)

    # -- in ----------------------------------------------------------------------------------------------------

    def from_websocket(self, datagram: bytes) -> None:
        """Handles a binary message of the control channel."""
        try:
            self._received(datagram, Transport.WEBSOCKET)
        except Dropped as dropped:
            copy = dropped.reason is DropReason.REPLAYED and len(self._uplinks) > 1
            self._counts[DropReason.DUPLICATE if copy else dropped.reason] += 1

    def _from_uplink(self, number: int, datagram: bytes) -> None:
        uplink = self._uplinks[number]
        try:
            received = self._received(datagram, Transport.UDP)
        except Dropped as dropped:
            copy = dropped.reason is DropReason.REPLAYED and len(self._uplinks) > 1
            self._counts[DropReason.DUPLICATE if copy else dropped.reason] += 1
            if copy:  # it is authentic; the first copy arrived on another uplink
                self._heard(uplink)
            return
        self._heard(uplink)
        if received.answer is not None:
            uplink.socket.send(received.answer)

    def _heard(self, uplink: _Uplink) -> None:
        uplink.heard_at = self._loop.time()
        uplink.failure_logged = False

    def _received(self, datagram: bytes, transport: Transport) -> Received:
        """Handles a datagram. Raises Dropped."""
        now = self._loop.time()
        received = self.sealed.receive(datagram, now)
        self._user.tower_heard()
        if received.frames is not None:
            self._user.frames(received.frames)
            if received.frames.ping is None:
                return received
        if received.urgent is not None:
            self._urgent(received.urgent)
            return received
        before = self.choice.transport
        rests_s = self.sealed.keepalive.rests_s
        if received.proof:
            self.choice.proven(transport, now, rests_s=rests_s)
            if transport is Transport.WEBSOCKET:
                self._websocket_proven_at = now
        if received.probed is not None:
            self.choice.probe_answered(now, rests_s=rests_s)
            self._path_mtu.answered(received.probed.uplink or 0, received.probed.datagram_bytes, now)
        self._transport_changed(before, now)
        self._send_all(self.sealed.datagrams_to_send(now), keepalive=True)
        return received

    def _transport_changed(self, before: Transport, now: float) -> None:
        if self.choice.transport is before:
            return
        _log.warning("the data channel now goes over %s", self.choice.transport)
        self.lane.clear()
        self._websocket_proven_at = now
        self.sealed.keepalive.hurry(now)


def _by(uplink: str) -> str:
    return f" by {uplink}" if uplink else ""
