"""Roaming and two uplinks at once: address changes are followed, a lost path has no effect, duplicates count once."""

import asyncio
from pathlib import Path

import pytest
from agent_fakes import until
from data_link_world import DataLinkWorld, data_link_world

from server.link.core.agent_routes import Address
from wire.dialect import build, mavlink
from wire.drops import DropReason
from wire.path_mtu import SAFE_DATAGRAM_BYTES
from wire.sealed_link import Received
from wire.tagged import split_tagged

WIFI, CELL = "127.0.0.2", "127.0.0.3"


def text(number: int) -> bytes:
    """A transactional frame: the tower forwards every one, so that a duplicate or a gap is visible."""
    message = mavlink.MAVLink_statustext_message(6, b"%d" % number)
    return build(message, system_id=1, component_id=1, sequence=number & 0xFF)


class Watcher:
    """Reports the numbered texts that the browser received, in order."""

    def __init__(self, world: DataLinkWorld) -> None:
        self._world = world
        self.got: list[int] = []

    async def run(self) -> None:
        texts = {text(number): number for number in range(2000)}
        while True:
            message = await self._world.watcher.socket.recv()
            if isinstance(message, bytes):
                self.got += [texts[frame] for _, frame in split_tagged(message) if frame in texts]


async def say(world: DataLinkWorld, numbers: range) -> None:
    for number in numbers:
        world.autopilot.send(text(number))
        await asyncio.sleep(0.02)  # the rate of an autopilot, not a wait for an event


def arrivals(world: DataLinkWorld, monkeypatch: pytest.MonkeyPatch) -> list[tuple[Address, Address | None]]:
    """Collects each authentic datagram's source address, and the address that the tower sends to from then on.

    Excludes the path-MTU probes, which exceed the size that always passes: the tower does not follow those.
    """
    came: list[tuple[Address, Address | None]] = []
    receive = world.link.receive

    def watched(datagram: bytes, address: Address, now: float) -> Received:
        received = receive(datagram, address, now)
        if len(datagram) <= SAFE_DATAGRAM_BYTES:
            came.append((address, world.link.routes.newest))
        return received

    monkeypatch.setattr(world.link, "receive", watched)
    return came


async def test_a_new_address_is_followed_within_one_datagram(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with data_link_world(tmp_path, monkeypatch) as world:
        await until(lambda: world.link.routes.newest, what="the first datagram")
        watcher = Watcher(world)
        watching = asyncio.create_task(watcher.run())
        came = arrivals(world, monkeypatch)
        for move in range(5):
            before = world.link.routes.newest
            world.proxy.forget()
            await until(lambda before=before: world.link.routes.newest != before)  # type: ignore[misc]
            after = world.link.routes.newest
            assert after is not None
            assert after[1] in world.proxy.ports
            answered = [answered_to for address, answered_to in came if address == after]
            assert answered[0] == after, "the first datagram from there is enough"
            await say(world, range(20 * move, 20 * move + 10))
            await until(lambda move=move: 20 * move + 9 in watcher.got)  # type: ignore[misc]
        assert world.agent._link.up
        assert len([one for one in world.watcher.events if one["type"] == "drone" and not one["drone"]["online"]]) == 0
        watching.cancel()


async def test_two_uplinks_lose_nothing_when_either_is_lost_and_nothing_comes_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with data_link_world(tmp_path, monkeypatch, uplinks=(WIFI, CELL)) as world:
        await until(lambda: world.link.routes.count == 2, what="both uplinks are known")
        watcher = Watcher(world)
        watching = asyncio.create_task(watcher.run())
        await say(world, range(30))
        world.proxy.blocked = {WIFI}
        await say(world, range(30, 150))
        await until(lambda: world.link.routes.count == 1, what="one uplink is silent")
        world.proxy.blocked = set()
        await until(lambda: world.link.routes.count == 2, what="it is back")
        world.proxy.blocked = {CELL}
        await say(world, range(150, 270))
        await until(lambda: 269 in watcher.got)
        assert watcher.got == list(range(270)), "no gap, no copy, no disorder"
        drops = world.hub.state.drops
        assert drops[DropReason.DUPLICATE] > 30
        assert drops[DropReason.REPLAYED] < drops[DropReason.DUPLICATE] / 5, "only before an uplink is known"
        assert world.agent._link.counts[DropReason.DUPLICATE] > 0, "the tower answers to both"
        watching.cancel()


async def test_a_replay_from_elsewhere_moves_nothing_and_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with data_link_world(tmp_path, monkeypatch) as world:
        await until(lambda: world.link.routes.newest, what="the first datagram")
        before = world.link.routes.newest
        world.proxy.replay(0)
        await until(lambda: world.hub.state.drops[DropReason.REPLAYED] == 1)
        assert world.link.routes.newest == before


@pytest.mark.parametrize(("passes", "uplinks"), [(1500, ("",)), (1320, (WIFI, CELL))], ids=["wide", "two narrow"])
async def test_the_path_mtu_is_found_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, passes: int, uplinks: tuple[str, ...]
) -> None:
    async with data_link_world(tmp_path, monkeypatch, largest_bytes=passes, uplinks=uplinks) as world:
        least = min(passes, 1452) - 16
        await until(lambda: world.link.sealed.datagram_bytes >= least, 25.0, "the size is found")
        reported = await world.reported_link(path_mtu=world.link.sealed.datagram_bytes)
        assert reported["path_mtu"] <= passes
        assert world.link.sealed.keepalive.loss == 0.0, "only probes were lost"
