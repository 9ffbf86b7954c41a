"""The link to the tower: kept up for as long as the process lives. The asyncio shell around `wire.sealed_link`."""

import asyncio
import contextlib
import logging
from collections import Counter
from typing import Final, Protocol

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from onboard_agent.auto_profile import LOSS_NOW_OVER_S, LOSS_OVER_S, Measured
from onboard_agent.backoff import Backoff
from onboard_agent.control_channel import CredentialRefused, NoLink, OpenedChannel, open_channel
from onboard_agent.data_socket import DataSocket
from onboard_agent.tower_url import TowerUrl
from wire.content import LARGEST_URGENT_BYTES, Frames
from wire.control_messages import (
    HoldOrder,
    HoldProgress,
    MalformedMessage,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.credential import Credential
from wire.drops import Dropped, DropReason
from wire.ids import DroneId, Epoch

_log = logging.getLogger(__name__)

REFUSED_RETRY_S: Final = 30.0
"""A refused credential is not cured by asking often."""

REPLACED_RETRY_S: Final = 5.0
"""Two agents with one credential would otherwise throw each other out many times a second."""

REPLACED_CODE: Final = 4409

STEADY_S: Final = 1.0
"""A link that lasts this long was a good one, and is renewed at once; one that ends sooner waits as a failure does."""

UDP_SILENT_S: Final = 3.0
"""Silence after which the data channel tries another source port: a NAT may have forgotten the old one."""

URGENT_COPIES_AFTER_S: Final = (0.005, 0.03, 0.1)
"""Further copies of an urgent message: a little apart, since losses come in a row."""

OUTBOX: Final = 64
"""Messages that wait for the control channel. A tower that cannot take these is dead: the link is given up."""


class LinkUser(Protocol):
    """Who is told what happens on the link."""

    def link_up(self, welcome: Welcome) -> None:
        """Signed in; the data channel is open."""

    def link_down(self) -> None:
        """The link that was up is gone."""

    def message(self, message: ToAgent) -> None:
        """A message of the control channel."""

    def frames(self, frames: Frames) -> None:
        """Frames of the data channel: authentic and fresh, not yet checked for drone and epoch."""

    def tower_heard(self) -> None:
        """Any authentic datagram."""


class TowerLink:
    """Run it; send through it. Whatever is sent while there is no link is dropped and counted, never queued."""

    def __init__(self, url: TowerUrl, credential: Credential, user: LinkUser) -> None:
        self._url = url
        self._credential = credential
        self._user = user
        self._backoff = Backoff()
        self._opened: OpenedChannel | None = None
        self._data: DataSocket | None = None
        self._outbox: asyncio.Queue[ToTower] = asyncio.Queue(OUTBOX)
        self._loop = asyncio.get_running_loop()
        self._last_reason = ""
        self._alarm_set = False
        self.counts: Counter[str] = Counter()
        """Datagrams and frames not passed on, by reason."""

    @property
    def drone_id(self) -> DroneId:
        """The drone that the credential is of."""
        return self._credential.drone_id

    @property
    def up(self) -> bool:
        """Whether there is a link now."""
        return self._opened is not None

    def measured(self, now: float) -> Measured | None:
        """How the link is; None while there is none. What the tower does not tell (yet, or because nothing comes
        through) is judged by the pings that nobody answered."""
        if self._opened is None:
            return None
        sealed = self._opened.sealed
        losses = (sealed.quality.over(window_s, now).loss_sent for window_s in (LOSS_OVER_S, LOSS_NOW_OVER_S))
        loss, loss_now = (sealed.keepalive.loss if loss is None else loss for loss in losses)
        rtt_s = None if sealed.keepalive.rtt_s is None else sealed.keepalive.rtt_now_s(now)
        return Measured(loss, loss_now, rtt_s)

    async def run(self) -> None:
        """Keeps a link up until cancelled."""
        while True:
            delay_s = self._backoff.next_delay_s()
            try:
                opened = await open_channel(self._url, self._credential)
            except CredentialRefused as error:
                self._say_once(f"{error}; asking again every {REFUSED_RETRY_S:.0f} s")
                delay_s = REFUSED_RETRY_S
            except NoLink as error:
                self._say_once(f"{error}; trying on")
            else:
                self._last_reason = ""
                up_at = self._loop.time()
                code = await self._live(opened)
                if self._loop.time() - up_at >= STEADY_S:
                    self._backoff.reset()
                delay_s = self._backoff.next_delay_s()
                if code == REPLACED_CODE:
                    _log.error("another agent has signed in with this drone's credential; waiting")
                    delay_s = REPLACED_RETRY_S
            await asyncio.sleep(delay_s)

    def _say_once(self, reason: str) -> None:
        if reason != self._last_reason:
            _log.warning("no link: %s", reason)
            self._last_reason = reason

    async def _live(self, opened: OpenedChannel) -> int | None:
        """From link up to link down; returns the code with which the tower closed, if it did."""
        connection = opened.connection
        data = DataSocket(lambda datagram: self._datagram(opened, datagram))
        writer: asyncio.Task[None] | None = None
        try:
            await data.open(opened.host, opened.welcome.udp_port)
            self._opened, self._data = opened, data
            self._outbox = asyncio.Queue(OUTBOX)
            _log.info("link up: drone %d (%s)", opened.welcome.drone_id, opened.welcome.name)
            self._user.link_up(opened.welcome)
            writer = asyncio.create_task(self._write(connection))
            pinger = asyncio.create_task(self._keep_alive(opened, data))
            try:
                await self._read(connection)
            finally:
                pinger.cancel()
        except OSError as error:
            _log.warning("the data channel cannot be opened: %s", error)
        finally:
            if writer is not None:
                writer.cancel()
            data.close()
            if self._opened is opened:
                self._opened = self._data = None
                self._user.link_down()
            await connection.close()
            _log.warning("link lost: %s", connection.close_reason or connection.close_code)
        return connection.close_code

    async def _read(self, connection: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for text in connection:
                try:
                    if isinstance(text, bytes):
                        raise MalformedMessage("bytes on a channel that has none yet")
                    message = decode_to_agent(text)
                except MalformedMessage as error:
                    _log.error("the tower sent a message that is none: %s", error)
                    await connection.close(1008, "malformed message")
                    return
                self._user.message(message)

    async def _write(self, connection: ClientConnection) -> None:
        outbox = self._outbox
        with contextlib.suppress(ConnectionClosed):
            while True:
                await connection.send(encode_message(await outbox.get()))

    async def _keep_alive(self, opened: OpenedChannel, data: DataSocket) -> None:
        """Pings the tower, and opens the data channel anew while it alone is silent."""
        keepalive = opened.sealed.keepalive
        reopened_at = self._loop.time()
        told = False
        while True:
            now = self._loop.time()
            for datagram in opened.sealed.datagrams_to_send(now):
                data.send(datagram)
            silent_s = keepalive.silent_for(now)
            if silent_s < UDP_SILENT_S:
                told = False
            elif now - reopened_at >= UDP_SILENT_S:
                if not told:
                    _log.warning("the tower is silent on UDP port %d; trying other ports", opened.welcome.udp_port)
                    told = True
                reopened_at = now
                with contextlib.suppress(OSError):
                    await data.open(opened.host, opened.welcome.udp_port)
            await asyncio.sleep(max(0.0, keepalive.next_ping_at() - self._loop.time()))

    def _datagram(self, opened: OpenedChannel, datagram: bytes) -> None:
        now = self._loop.time()
        try:
            received = opened.sealed.receive(datagram, now)
        except Dropped as dropped:
            self.counts[dropped.reason] += 1
            return
        self._user.tower_heard()
        if received.frames is not None:
            self._user.frames(received.frames)
        elif received.urgent is not None:
            self._urgent(received.urgent)
        elif self._data is not None:
            for answer in opened.sealed.datagrams_to_send(now):
                self._data.send(answer)

    def _urgent(self, text: bytes) -> None:
        try:
            message = decode_to_agent(text)
        except MalformedMessage:
            self.counts[DropReason.BAD_CONTENT] += 1
            return
        if isinstance(message, HoldOrder):
            self._user.message(message)

    def _send_urgent(self, message: ToTower) -> None:
        """How a hold goes must not wait until TCP has noticed a lost packet: it goes over the data channel as well."""
        text = encode_message(message).encode()
        if len(text) > LARGEST_URGENT_BYTES:
            return
        self._send_copy(self._opened, text)
        for delay_s in URGENT_COPIES_AFTER_S:
            self._loop.call_later(delay_s, self._send_copy, self._opened, text)

    def _send_copy(self, opened: OpenedChannel | None, text: bytes) -> None:
        if opened is not None and opened is self._opened and self._data is not None:
            self._data.send(opened.sealed.seal_urgent(text))

    def send_frames(self, epoch: Epoch, frames: list[bytes]) -> None:
        """Frames for the tower, sealed and sent: the urgent ones now, the others within `wire.batching`'s deadline."""
        if self._opened is None or self._data is None:
            self.counts["no link"] += len(frames)
            return
        sealed = self._opened.sealed
        for datagram in sealed.batch_frames(epoch, frames, self._loop.time()):
            self._data.send(datagram)
        if sealed.batch_due_at is not None and not self._alarm_set:
            self._alarm_set = True
            self._loop.call_at(sealed.batch_due_at, self._send_batch)

    def _send_batch(self) -> None:
        self._alarm_set = False
        if self._opened is None or self._data is None:
            return
        sealed = self._opened.sealed
        for datagram in sealed.batch_due(self._loop.time()):
            self._data.send(datagram)
        if sealed.batch_due_at is not None:
            # An urgent frame has taken along what the alarm was set for, and more has come since.
            self._alarm_set = True
            self._loop.call_at(sealed.batch_due_at, self._send_batch)

    def send_message(self, message: ToTower) -> None:
        """A message for the control channel. One that a stuck channel cannot take ends the link."""
        if isinstance(message, HoldProgress):
            self._send_urgent(message)
        try:
            self._outbox.put_nowait(message)
        except asyncio.QueueFull:
            self.counts["message to a stuck control channel"] += 1
            if self._opened is not None:
                self._opened.connection.transport.abort()
