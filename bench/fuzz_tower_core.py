"""A receiver of mutated datagrams without a socket: the tower's data channel, from the datagram to a browser's outbox.

It is the real code, so that an exception that would escape there escapes here. The product's own counters show what
happened to a datagram.
"""

from __future__ import annotations

import json
import random
import time
from collections import Counter
from datetime import UTC, datetime
from typing import Final

from bench.fuzz_datagrams import DatagramFuzzer
from server.kernel.fleet import DroneRecord, FleetSnapshot, UserRecord
from server.kernel.people import Principal, Role, UserRef
from server.link.api.data_endpoint import DataEndpoint
from server.link.core.agent_link import AgentLink
from server.link.core.flood_gate import FloodLimits
from server.live.browser import Browser
from server.live.hub import Hub
from wire.control_messages import HoldProgress, HoldStep, encode_message
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch, LinkId, UserId
from wire.sealed_link import SealedLink
from wire.tagged import tag

DRONE: Final = DroneId(7)
LINK: Final = LinkId(0x00C0FFEE)
_UP, _DOWN = b"u" * 32, b"d" * 32
_ALICE: Final = UserRef(UserId(1), "alice")
_MAX: Final = 1 << 30
_TICK_EVERY: Final = 64
"""Datagrams between two ticks of the receiver; a real tick comes more often."""

_PROGRESS: Final = HoldProgress(order_id=1, epoch=3, step=HoldStep.CONFIRMED, detail="ALT_HOLD", elapsed_ms=12.5)
_HEARTBEAT: Final = build(
    mavlink.MAVLink_heartbeat_message(2, 3, 0x81, 5, 4, 3), system_id=1, component_id=1, sequence=0
)


def _sealed(*, send: bytes, receive: bytes, now: float) -> SealedLink:
    return SealedLink(link_id=LINK, drone_id=DRONE, send_key=send, receive_key=receive, now=now)


class TowerCore:
    """The tower's UDP endpoint with a hub, one drone of alice's and her browser, which reads now and then."""

    name = "tower"

    def __init__(self, chance: random.Random) -> None:
        now = time.monotonic()
        self._chance = chance
        self.hub = Hub(FloodLimits(agent_per_s=_MAX, agent_burst=_MAX))
        self.hub.apply_fleet(
            FleetSnapshot(
                1,
                (DroneRecord(DRONE, "Kestrel", (_ALICE,), "", _ALICE, Epoch(3), None),),
                {_ALICE.id: UserRecord(_ALICE.name, Role.OPERATOR, False)},
            )
        )
        self._answers: list[bytes] = []
        self._endpoint = DataEndpoint(self.hub)
        self.hub.attach_link(
            AgentLink(
                sealed=_sealed(send=_DOWN, receive=_UP, now=now),
                send_datagram=lambda datagram, address: self._answers.append(datagram),
                post=lambda message: None,
                close=lambda code, why: None,
                call_later=lambda delay_s, call: None,
            ),
            now,
        )
        alice = Principal(_ALICE.id, _ALICE.name, Role.OPERATOR, 1, datetime(2100, 1, 1, tzinfo=UTC))
        self._browser = Browser(1, alice, now, wake=lambda: None, close=lambda code, why: None)
        self.hub.attach_browser(self._browser, "", now)
        self._delivered = 0
        self.fuzzer = DatagramFuzzer(
            chance,
            sender=_sealed(send=_UP, receive=_DOWN, now=now),
            urgent=json.loads(encode_message(_PROGRESS)),
            epoch=lambda: 3,
            fenced=False,
            senders=((1, 1),),  # what others send is dropped before anything else is looked at
        )

    def deliver(self, datagram: bytes) -> tuple[set[str], int]:
        """Returns the counted drop reasons, and the number of bytes answered."""
        before = Counter(self.hub.state.drops)
        address = (f"198.51.100.{self._chance.randrange(256)}", self._chance.randrange(1, 65536))
        self._endpoint.datagram_received(datagram, address, time.monotonic())
        answered = sum(map(len, self._answers))
        if self._answers:
            self.fuzzer.reflected = self._answers[-1]
            self._answers.clear()
        self._delivered += 1
        if self._delivered % _TICK_EVERY == 0:
            self.rest()
        return set(self.hub.state.drops - before), answered

    def from_agent(self, datagram: bytes) -> None:
        """A sealed datagram of the agent arrives."""
        self._endpoint.datagram_received(datagram, ("198.51.100.1", 4000), time.monotonic())

    def from_browser(self, frame: bytes) -> bool:
        """Its pilot sends this frame. Returns whether it went to the agent."""
        self._answers.clear()
        self.hub.frames_from_browser(self._browser, tag(DRONE, frame), time.monotonic())
        return bool(self._answers)

    def rest(self) -> None:
        """Advances time: the hub ticks, the browser reads."""
        self.hub.flood._reports.clear()  # a real agent sends less in an hour than this one in a second
        self.hub.tick(time.monotonic())
        self.hub.each_second(time.monotonic())
        self._browser.take_events()
        self._browser.outbox.take(float("inf"))
        self._answers.clear()

    def counted(self) -> Counter[str]:
        """Returns every drop so far."""
        return Counter({str(reason): count for reason, count in self.hub.state.drops.items()})

    def serves(self) -> bool:
        """Returns whether a frame still reaches the browser from the agent."""
        self.rest()
        content = self.fuzzer.frames_content([_HEARTBEAT])
        self.deliver(self.fuzzer.seal(content))
        return any(_HEARTBEAT in frame for frame in self._browser.outbox.take(float("inf")))

    async def close(self) -> None:
        """Nothing is open."""
