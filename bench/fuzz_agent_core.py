"""A receiver of mutated datagrams without a socket: a whole agent, from the datagram to the autopilot's port.

It is the real code, so that an exception that would escape there escapes here. The product's own counters show what
happened to a datagram.
"""

from __future__ import annotations

import json
import random
import time
from collections import Counter
from typing import Any, Final, cast

from bench.fuzz_datagrams import DatagramFuzzer
from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.port import AutopilotPort, OnBytes
from onboard_agent.link.identity import Identity, Kept
from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.sockets.control_channel import OpenedChannel
from onboard_agent.sockets.data_socket import DataSocket
from wire.control_messages import HoldOrder, Welcome, encode_message
from wire.dialect import build, mavlink
from wire.drone_key import DroneKey
from wire.ids import DroneId, LinkId
from wire.sealed_link import SealedLink

DRONE: Final = DroneId(7)
LINK: Final = LinkId(0x00C0FFEE)
_UP, _DOWN = b"u" * 32, b"d" * 32
_IDENTITY: Final = Identity(Kept(DRONE, DroneKey(DRONE, b"k" * 32)))
_ORDER: Final = HoldOrder(order_id=1, epoch=3, reason="the controls were taken")
_TICK_EVERY: Final = 64
"""Datagrams between two ticks; the autopilot sends a message then as well."""

_PING: Final = build(mavlink.MAVLink_ping_message(1, 2, 1, 1), system_id=255, component_id=190, sequence=0)


class _DeafPort(AutopilotPort):
    """An autopilot's port without an autopilot; keeps what was sent last."""

    def __init__(self) -> None:
        super().__init__("nothing")
        self.sent: list[bytes] = []

    async def run(self, received: OnBytes) -> None:
        raise NotImplementedError

    def send(self, data: bytes) -> None:
        self.sent.append(data)


class _DeafSocket(DataSocket):
    """The data channel's socket without a network; keeps what was sent last."""

    def __init__(self) -> None:
        super().__init__(lambda datagram: None)
        self.sent: list[bytes] = []

    def send(self, datagram: bytes) -> None:
        self.sent.append(datagram)


class AgentCore:
    """An agent with an armed copter and an established link. Create it inside a running event loop."""

    name = "agent"

    def __init__(self, chance: random.Random) -> None:
        now = time.monotonic()
        self._chance = chance
        self._port = _DeafPort()
        self._socket = _DeafSocket()
        url = parse_tower_url("http://127.0.0.1:1")
        self._agent = Agent(AgentSettings(tower=url, identity=_IDENTITY, port=self._port))
        self._welcome = Welcome(
            drone_id=DRONE, name="Kestrel", link_id=LINK, public_key=_UP, udp_port=1, epoch=3, holder="alice"
        )
        sealed = SealedLink(link_id=LINK, drone_id=DRONE, send_key=_UP, receive_key=_DOWN, now=now)
        self._opened = OpenedChannel(cast("Any", None), self._welcome, sealed, "127.0.0.1", url)
        self._agent._link._opened = self._opened
        self._data = self._agent._link._data_channel(self._opened)
        self._data._uplinks[0].socket = cast("Any", self._socket)
        self._agent._link._data = self._data
        self._agent.link_up(self._welcome)
        self._delivered = 0
        self.fuzzer = DatagramFuzzer(
            chance,
            sender=SealedLink(link_id=LINK, drone_id=DRONE, send_key=_DOWN, receive_key=_UP, now=now),
            urgent=json.loads(encode_message(_ORDER)),
            epoch=lambda: self._agent._onboard.downlink.epoch,
            fenced=True,
        )

    def deliver(self, datagram: bytes) -> tuple[set[str], int]:
        """Returns the counted drop reasons, and the number of bytes answered."""
        before = self.counted()
        self._socket.sent.clear()  # copies of urgent messages, which are sent by time
        self._data._from_uplink(0, datagram)
        answered = sum(map(len, self._socket.sent))
        if self._socket.sent:
            self.fuzzer.reflected = self._socket.sent[-1]
            self._socket.sent.clear()
        reasons = set(self.counted() - before)
        self._delivered += 1
        if self._delivered % _TICK_EVERY == 0:
            self.rest()
        return reasons, answered

    def rest(self) -> None:
        """Advances time: the agent ticks, its autopilot sends a message, the control channel takes what is queued."""
        beat = mavlink.MAVLink_heartbeat_message(2, 3, 0x81, self._chance.choice((2, 3, 5)), 4, 3)
        self._agent._from_port(build(beat, system_id=1, component_id=1, sequence=0))
        self._agent._tick()
        if self._agent._onboard.downlink.epoch > 1 << 31:
            # A mutation set the agent to a far-away epoch: a new sign-in must correct it.
            self._agent.link_up(self._welcome)
        self._agent._link._outbox.clear()
        self._port.sent.clear()
        self._socket.sent.clear()

    def from_autopilot(self, data: bytes) -> None:
        """Bytes from the autopilot arrive."""
        self._agent._from_port(data)

    def counted(self) -> Counter[str]:
        """Returns every drop of the link so far, and of the fence behind it."""
        counts = self._agent._link.counts + self._agent._onboard.downlink.counts
        return Counter(
            {"not-allowed" if why == "setup_signing" else str(why): number for why, number in counts.items()}
        )

    def serves(self) -> bool:
        """Returns whether a frame still reaches the autopilot from the tower."""
        self.rest()
        self.deliver(self.fuzzer.seal(self.fuzzer.frames_content([_PING])))
        return _PING in self._port.sent

    async def close(self) -> None:
        """Nothing is open."""
