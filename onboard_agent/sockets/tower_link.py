"""Keeps the link to the tower up while the process runs. The asyncio shell around `wire.sealed_link`."""

import asyncio
import contextlib
import logging
import secrets
import time
from collections import Counter, deque
from collections.abc import Sequence
from typing import Final

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from onboard_agent.link.backoff import STEADY_S, Backoff
from onboard_agent.link.identity import Identity
from onboard_agent.link.tower_file import TowerFile
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.control_channel import CredentialRefused, NoLink, OpenedChannel, open_channel
from onboard_agent.sockets.data_channel import DataChannel
from onboard_agent.sockets.data_socket import ANY_UPLINK
from onboard_agent.sockets.elsewhere import Elsewhere
from onboard_agent.sockets.link_user import LinkUser
from onboard_agent.sockets.replacement_channel import successor
from onboard_agent.sockets.tower_search import HelloTurn
from onboard_agent.telemetry.auto_profile import LOSS_NOW_OVER_S, LOSS_OVER_S, Measured
from wire.content import MAX_URGENT_BYTES
from wire.control_messages import (
    AutopilotState,
    ControlChanged,
    HoldOrder,
    HoldProgress,
    MalformedMessage,
    ToTower,
    decode_to_agent,
    encode_message,
)
from wire.drops import DropReason
from wire.following import FOLLOW, FOLLOW_PERSON, LeaderPosition
from wire.ids import DroneId, Epoch
from wire.open_holds import OPEN_HOLDS, Stay
from wire.parameter_metadata import PARAMETER_METADATA
from wire.tail_probes import PROBES_AFTER_S
from wire.tower_list import TOWERS
from wire.transactions import TRANSACTIONS
from wire.video import ClockAnswer, ClockProbe

_log = logging.getLogger(__name__)

REFUSED_RETRY_S: Final = 30.0
"""Frequent retries do not help a refused key."""

REPLACED_RETRY_S: Final = 5.0
"""Two agents with one key would otherwise replace each other many times a second."""

REPLACED_CODE: Final = 4409

URGENT_COPIES_AFTER_S: Final = (0.005, 0.03, 0.1)
"""Further copies of an urgent message, a little apart because losses occur in bursts."""

STATE_AGAIN_S: Final = 1.0
"""Interval of the autopilot's state over the data channel while there is no control channel."""

PROGRESS_KEPT: Final = 32
"""Steps of holds that are sent again on another control channel of the same link. The tower counts each once."""

OUTBOX: Final = 64
"""Maximum number of messages queued for the control channel. When it is full, the tower counts as dead and the link
ends."""


class TowerLink:
    """Call `run`, and send through it. Frames sent without a link are dropped and counted, never queued."""

    def __init__(
        self,
        url: TowerUrl,
        identity: Identity,
        user: LinkUser,
        uplinks: Sequence[str] = (ANY_UPLINK,),
        takes: Sequence[str] = (),
        towers: TowerFile | None = None,
    ) -> None:
        """`takes`: capabilities for the hello, besides those of every agent. `towers`: keeps the list of towers."""
        self._takes = (TRANSACTIONS, FOLLOW, FOLLOW_PERSON, OPEN_HOLDS, PARAMETER_METADATA, TOWERS, *takes)
        self._identity = identity
        self._elsewhere = Elsewhere(url, identity, towers or TowerFile(None), self._open_at)
        self._user = user
        self._process = secrets.randbelow(0xFFFFFFFF) + 1
        self._backoff = Backoff()
        self._opened: OpenedChannel | None = None
        self._uplinks = uplinks
        self._ways = (*uplinks, ANY_UPLINK) if len(uplinks) > 1 else (ANY_UPLINK,)
        """Uplinks for the control channel: one of several, or as the kernel routes."""
        self._data: DataChannel | None = None
        self._outbox: deque[ToTower] = deque()
        self._progress: deque[HoldProgress] = deque(maxlen=PROGRESS_KEPT)
        """The newest steps of this link."""
        self._pending_state: deque[HoldProgress] = deque(maxlen=PROGRESS_KEPT)
        """Steps sent while there was no control channel. If the link ends without another one, the next link sends
        them."""
        self._state: AutopilotState | None = None
        """The state last reported on this link."""
        self._reading: asyncio.Task[None] | None = None
        """Reads the control channel; done when that has ended."""
        self._something_to_write = asyncio.Event()
        self._loop = asyncio.get_running_loop()
        self._last_reason = ""
        self.closely = True
        """Whether silence of the tower must be detected at once."""
        self.counts: Counter[str] = Counter()
        """Dropped datagrams and frames, by reason."""

    @property
    def drone_id(self) -> DroneId:
        """The drone that the agent runs on."""
        return self._identity.drone_id

    @property
    def tower(self) -> TowerUrl:
        """The tower of the link, or of the last one."""
        return self._elsewhere.tower

    @property
    def ticket(self) -> str:
        """The ticket or credential for HTTP requests; empty while there is no link."""
        if self._opened is None:
            return ""
        credential = self._identity.credential
        return self._opened.welcome.ticket or (str(credential) if credential is not None else "")

    @property
    def up(self) -> bool:
        """Whether there is a link now."""
        return self._opened is not None

    @property
    def over_udp(self) -> bool:
        """Whether the data channel goes over UDP now, and not over the control channel."""
        return self._data is not None and self._data.over_udp

    @property
    def room(self) -> int:
        """How many more messages that can wait may be sent. Half of the outbox is reserved for the others."""
        return max(0, OUTBOX // 2 - len(self._outbox))

    @property
    def rtt_s(self) -> float | None:
        """The smoothed round trip to the tower; None if there is none."""
        return None if self._opened is None else self._opened.sealed.keepalive.rtt_s

    def measured(self, now: float) -> Measured | None:
        """Returns measurements of the link; None without one. If the tower reports no loss (not yet, or because nothing
        gets through), the loss is estimated from unanswered pings."""
        if self._opened is None:
            return None
        sealed = self._opened.sealed
        losses = (sealed.quality.over(window_s, now).loss_sent for window_s in (LOSS_OVER_S, LOSS_NOW_OVER_S))
        loss, loss_now = (sealed.keepalive.loss if loss is None else loss for loss in losses)
        rtt_s = None if sealed.keepalive.rtt_s is None else sealed.keepalive.rtt_now_s(now)
        return Measured(loss, loss_now, rtt_s)

    async def run(self) -> None:
        """Keeps a link up until cancelled."""
        opened: OpenedChannel | None = None
        while True:
            delay_s = self._backoff.next_delay_s()
            try:
                if opened is None:
                    opened = await self._elsewhere.open_anywhere()
            except CredentialRefused as error:
                self._say_once(f"{error}; asking again every {REFUSED_RETRY_S:.0f} s")
                delay_s = REFUSED_RETRY_S
            except NoLink as error:
                self._say_once(f"{error}; trying on")
            else:
                self._last_reason = ""
                up_at = self._loop.time()
                code, opened = await self._live(opened)
                if self._loop.time() - up_at >= STEADY_S:
                    self._backoff.reset()
                delay_s = self._backoff.next_delay_s()
                if code == REPLACED_CODE and opened is None:
                    _log.error("another agent has signed in as this drone; waiting")
                    delay_s = REPLACED_RETRY_S
            if opened is None:
                await asyncio.sleep(delay_s)

    def _say_once(self, reason: str) -> None:
        if reason != self._last_reason:
            _log.warning("no link: %s", reason)
            self._last_reason = reason

    def _data_channel(self, opened: OpenedChannel) -> DataChannel:
        return DataChannel(
            opened.sealed,
            host=opened.host,
            port=opened.welcome.udp_port,
            uplinks=self._uplinks,
            user=self._user,
            urgent=self._urgent,
            wake_writer=self._something_to_write.set,
            counts=self.counts,
            closely=lambda: self.closely or self._has_no_channel,
        )

    async def _live(self, opened: OpenedChannel) -> tuple[int | None, OpenedChannel | None]:
        """Runs from link up to link down. Returns the code with which the tower closed, if it did, and the new link
        that the tower has opened instead, if any."""
        data = self._data_channel(opened)
        running: list[asyncio.Task[None]] = []
        following: OpenedChannel | None = None
        try:
            await data.open()
            self._opened, self._data = opened, data
            self._outbox, self._progress = deque(self._pending_state), deque(self._pending_state, PROGRESS_KEPT)
            self._pending_state.clear()
            self._state = None
            welcome = opened.welcome
            version = welcome.tower_version or "older than 0.3"
            _log.info("link up: drone %d (%s), tower %s", welcome.drone_id, welcome.name, version)
            self._elsewhere.linked(opened)
            self._user.link_up(opened.welcome)
            running = [asyncio.create_task(data.run()), asyncio.create_task(self._resend_state())]
            while (following := await self._serve(opened, data)) is not None and following.sealed is opened.sealed:
                opened.connection.transport.abort()
                opened = self._opened = following
                self._resumed()
        except OSError as error:
            _log.warning("the data channel cannot be opened: %s", error)
        finally:
            for task in running:
                task.cancel()
            data.close()
            if self._data is data:
                self._opened = self._data = None
                self._user.link_down()
            if following is not None:
                opened.connection.transport.abort()
            await opened.connection.close()
            _log.warning("link lost: %s", opened.connection.close_reason or opened.connection.close_code)
        return opened.connection.close_code, following

    def _resumed(self) -> None:
        """Reports everything again, because the last messages may be lost with the old control channel."""
        _log.warning("the link goes on, with another control channel")
        self._outbox = deque(self._progress)
        self._pending_state.clear()
        self._user.link_resumed()

    async def _serve(self, opened: OpenedChannel, data: DataChannel) -> OpenedChannel | None:
        """Serves one control channel until another replaces it. Returns that one, or None if the link has ended."""
        reading = self._reading = asyncio.create_task(self._read(opened.connection, data))
        writing = asyncio.create_task(self._write(opened.connection, data))
        try:
            return await successor(opened, data, reading, self._open_another, self._elsewhere)
        finally:
            reading.cancel()
            writing.cancel()

    async def _open_another(self, opened: OpenedChannel, uplinks: Sequence[str]) -> OpenedChannel:
        return await self._open(opened.url, uplinks or self._ways, resuming=opened)

    async def _open_at(self, url: TowerUrl, turn: HelloTurn) -> OpenedChannel:
        return await self._open(url, self._ways, turn=turn)

    async def _open(
        self,
        url: TowerUrl,
        uplinks: Sequence[str],
        *,
        resuming: OpenedChannel | None = None,
        turn: HelloTurn | None = None,
    ) -> OpenedChannel:
        return await open_channel(
            url,
            self._identity,
            uplinks=uplinks,
            resuming=resuming,
            process=self._process,
            takes=self._takes,
            turn=turn,
        )

    async def _read(self, connection: ClientConnection, data: DataChannel) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for text in connection:
                if isinstance(text, bytes):
                    data.from_websocket(text)
                    continue
                try:
                    message = decode_to_agent(text)
                except MalformedMessage as error:  # costs itself, never the link: the drone may be in the air
                    self.counts[DropReason.MALFORMED] += 1
                    _log.error("a message of the tower is left out, as it cannot be read: %.200s", error)
                    continue
                if self._elsewhere.told(message):
                    continue
                if not isinstance(message, ClockProbe):
                    self._user.message(message)
                elif self.room:  # a late response would be useless
                    self._outbox.appendleft(_clock_answer(message))
                    self._something_to_write.set()

    async def _write(self, connection: ClientConnection, data: DataChannel) -> None:
        """Writes messages first, then the data channel's datagrams for the WebSocket, as fast as it takes them."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                if self._outbox:
                    await connection.send(encode_message(self._outbox.popleft()))
                elif (datagram := data.lane.pop(self._loop.time())) is not None:
                    await connection.send(datagram)
                else:
                    self._something_to_write.clear()
                    await self._wait_with_probes(connection)

    async def _wait_with_probes(self, connection: ClientConnection) -> None:
        for pause_s in PROBES_AFTER_S:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(pause_s):
                    await self._something_to_write.wait()
                return
            await connection.pong()
        await self._something_to_write.wait()

    def _urgent(self, text: bytes) -> None:
        try:
            message = decode_to_agent(text)
        except MalformedMessage:
            self.counts[DropReason.BAD_CONTENT] += 1
            return
        if isinstance(message, ClockProbe):
            if self._data is not None:
                self._data.send_urgent(encode_message(_clock_answer(message)).encode())
        elif isinstance(message, (HoldOrder, ControlChanged, LeaderPosition, Stay)):
            self._user.message(message)

    def _send_urgent(self, message: ToTower) -> None:
        """Sends a message over the data channel too: hold progress must not wait for TCP to detect a lost packet."""
        text = encode_message(message).encode()
        if len(text) > MAX_URGENT_BYTES:
            return
        self._send_copy(self._opened, text)
        for delay_s in URGENT_COPIES_AFTER_S:
            self._loop.call_later(delay_s, self._send_copy, self._opened, text)

    def _send_copy(self, opened: OpenedChannel | None, text: bytes) -> None:
        if opened is not None and self._data is not None and opened.sealed is self._data.sealed:
            self._data.send_urgent(text)

    @property
    def _has_no_channel(self) -> bool:
        return self._reading is not None and self._reading.done()

    def _send_state(self) -> None:
        """Sends the newest state over the data channel, in case the tower has lost the control channel."""
        if self._state is not None:
            self._send_copy(self._opened, encode_message(self._state).encode())

    async def _resend_state(self) -> None:
        """Repeats the state: the tower may detect the loss of the control channel later and miss a change meanwhile."""
        while True:
            await asyncio.sleep(STATE_AGAIN_S)
            if self._has_no_channel:
                self._send_state()

    def send_frames(self, epoch: Epoch, frames: list[bytes]) -> None:
        """Sends frames to the tower: urgent ones now, the others within `wire.batching`'s deadline."""
        if self._data is None:
            self.counts["no link"] += len(frames)
            return
        self._data.send_frames(epoch, frames)

    def send_message(self, message: ToTower) -> None:
        """Queues a message for the control channel. If a stuck channel cannot take it, the link ends."""
        if isinstance(message, HoldProgress):
            self._progress.append(message)
            if self._has_no_channel:
                self._pending_state.append(message)
            self._send_urgent(message)
        elif isinstance(message, AutopilotState):
            self._state = message
            self._send_state()
            for delay_s in URGENT_COPIES_AFTER_S:
                self._loop.call_later(delay_s, self._send_state)
        if len(self._outbox) >= OUTBOX:
            self.counts["message to a stuck control channel"] += 1
            if self._opened is not None:
                self._opened.connection.transport.abort()
            return
        self._outbox.append(message)
        self._something_to_write.set()


def _clock_answer(probe: ClockProbe) -> ClockAnswer:
    """Uses the clock that timestamps pictures; the loop's may stand still for a millisecond."""
    return ClockAnswer(number=probe.number, at_us=time.monotonic_ns() // 1000)
