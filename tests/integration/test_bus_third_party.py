"""Two towers, and somebody else on their bus who hears all, repeats, reorders and forges: nothing of it is believed."""

import asyncio
import random
import time
from collections.abc import AsyncIterator

import pytest
import shared_bus_world
from control_world import ask, until
from nats.aio.client import Client
from nats.aio.msg import Msg
from shared_bus_world import Two
from worlds.nats import TemporaryNats

from server.kernel.clock import utc_now
from server.towers.core.messages import (
    Attach,
    FramesDown,
    Hello,
    Homes,
    Message,
    SessionsEnded,
    UserEnded,
    encode_bodies,
    encode_packet,
)
from server.towers.io.bus_seal import BusSeal
from wire.lateness import stamp_ms

cluster, nats = shared_bus_world.cluster, shared_bus_world.nats
postgres, two = shared_bus_world.postgres, shared_bus_world.two

SUBJECT = "control-tower"
MANY = 300
"""Of each kind of what is sent."""


class ThirdParty:
    """`heard`: subject and packet of everything on the bus."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.heard: list[tuple[str, bytes]] = []
        self.sent = 0

    async def hear(self, message: Msg) -> None:
        self.heard.append((message.subject, message.data))

    async def send(self, packets: list[tuple[str, bytes]]) -> None:
        for subject, packet in packets:
            await self.client.publish(subject, packet)
            self.sent += 1
        await self.client.flush()


@pytest.fixture
async def third(nats: TemporaryNats) -> AsyncIterator[ThirdParty]:
    client = Client()
    await client.connect(nats.url, no_echo=True)
    third = ThirdParty(client)
    await client.subscribe(f"{SUBJECT}.>", cb=third.hear)
    yield third
    await client.close()


def forged(sender: str, to: str, messages: list[Message], stream: int = 1_000_000) -> list[tuple[str, bytes]]:
    """What a tower of before sealing would send: a new stream, and these messages in it."""
    hello: list[Message] = [Hello(answers=True)]
    now_ms = stamp_ms(time.monotonic())
    bodies = [body for said in (hello, messages) for body in encode_bodies(said)]
    return [
        (f"{SUBJECT}.{to}", encode_packet(sender, stream, sequence, now_ms, body))
        for sequence, body in enumerate(bodies)
    ]


async def test_whoever_else_is_on_the_bus_is_believed_nothing_and_reads_nothing(two: Two, third: ThirdParty) -> None:
    a, b = two.a.tower.several, two.b.tower.several
    assert a is not None and b is not None
    drone_id, cookie = two.drone.id, next(iter(two.alice.cookies.values()))
    assert (await ask(two.alice, drone_id, "acquire")).status_code == 200
    await two.sticks()
    await until("much on the bus", lambda: len(third.heard) > 50)
    heard = b"".join(packet for _, packet in third.heard)
    assert cookie.encode() not in heard
    assert b"Alice" not in heard and b"Kestrel" not in heard

    epoch, owner_id = two.at(two.a).lease.epoch, int(two.owner.id)
    admin = Attach(77, 1, "Root", "admin", 1, False, utc_now(), [], "")
    claimed: list[Message] = [
        admin,
        FramesDown(77, b"\0" * 40),
        UserEnded(owner_id, "forged"),
        SessionsEnded(list(range(1, 50)), [], "forged"),
        Homes([(drone_id, 1_000_000)]),
    ]
    stranger = BusSeal(b.towers.me, lambda: [b"k" * 32], SUBJECT)
    chance = random.Random(7)

    def refused() -> int:
        return sum(one.refused for tower in (a, b) for one in (tower.bus, tower.video.bus))

    before = refused()
    await third.send(forged(b.towers.me, a.towers.me, claimed))
    await third.send(forged(a.towers.me, b.towers.me, claimed))
    await third.send([(subject, stranger.seal(packet, a.towers.me)) for subject, packet in
                      forged(b.towers.me, a.towers.me, claimed)])  # fmt: skip
    known = third.heard[:MANY]
    await third.send(known)
    await third.send(chance.sample(known, len(known)))
    changed = []
    for subject, packet in chance.choices(known, k=MANY):
        at = chance.randrange(len(packet))
        changed.append((subject, packet[:at] + bytes([packet[at] ^ 1 << chance.randrange(8)]) + packet[at + 1 :]))
    await third.send(changed)
    await until("all of it to be refused", lambda: refused() >= before + third.sent)

    await asyncio.sleep(0.5)
    assert two.is_ready(two.a) and two.is_ready(two.b), "the towers hear each other all the time"
    lease = two.at(two.a).lease
    assert (lease.epoch, lease.holder and lease.holder.name) == (epoch, "Alice")
    assert two.at(two.a).place.name == "HERE"
    assert {visitor.viewer.name for visitor in two.at(two.a).watchers.values()} == {"Alice"}
    before = two.a.tower.hub.state.traffic.frames_to_agents
    await two.sticks(100)
    await until("her sticks", lambda: two.a.tower.hub.state.traffic.frames_to_agents > before)
