"""Two uplinks: the one with the control channel fails during a flight by hand, without any effect on the flight.

A real agent in its own host, with real interfaces (`--uplink`), behind carriers that fall silent.
"""

import asyncio
import contextlib
import itertools
import json
import os
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from agent_fakes import FakeAutopilot, until
from control_world import Live, ask, live
from tower_world import TowerWorld, start_tower
from two_uplinks import TOWER, UPLINKS, TwoUplinks, two_uplinks

from bench.namespaces import why_not
from bench.tls_front import TlsFront, make_certificate
from server.kernel.people import Role
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from wire.dialect import build, decode, mavlink
from wire.frame_stream import FrameStream
from wire.ids import DroneId, LinkId
from wire.lateness import stamp_ms
from wire.tagged import stamp, tag

STICKS_EACH_S = 0.02
MAX_GAP_S = 0.2
RESUMED_WITHIN_S = 6.0


class Autopilot(FakeAutopilot):
    """Records the arrival of each stick frame, by the pilot's number for it."""

    def __init__(self) -> None:
        super().__init__(armed=True, custom_mode=2)
        self.sticks: list[tuple[float, int]] = []
        self.centred = 0
        """Number of the agent's own stick frames."""
        self._sticks_stream = FrameStream()

    async def start_on(self, opened: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(lambda: self, sock=opened)
        self._beating = asyncio.create_task(self._beat())

    def datagram_received(self, data: bytes, addr: object) -> None:
        for frame in self._sticks_stream.feed(data):
            message = decode(frame)
            if message is not None and message.get_type() == "MANUAL_CONTROL":
                if message.buttons:
                    self.sticks.append((time.monotonic(), message.buttons))
                else:
                    self.centred += 1
        super().datagram_received(data, addr)


@dataclass
class World:
    net: TwoUplinks
    tower: TowerWorld
    autopilot: Autopilot
    pilot: Live
    drone_id: DroneId
    agent_pid: int
    front_port: int
    sent: dict[int, float] = field(default_factory=dict)
    """Time of sending of each stick frame."""

    @property
    def hub(self) -> Hub:
        return self.tower.tower.hub

    @property
    def drone(self) -> LiveDrone:
        drone = self.hub.state.drones.get(self.drone_id)
        assert drone is not None
        return drone

    @property
    def link_id(self) -> LinkId | None:
        return None if self.drone.link is None else self.drone.link.link_id

    @property
    def uplinks(self) -> int:
        return 0 if self.drone.link is None else self.drone.link.routes.count

    def carrying(self) -> list[str]:
        """Returns the uplinks that carry control channels, from the kernel of the drone's host."""
        found = []
        for line in Path(f"/proc/{self.agent_pid}/net/tcp").read_text().splitlines()[1:]:
            _, local, remote, state, *_ = line.split()
            if state == "01" and int(remote.split(":")[1], 16) == self.front_port:
                address = socket.inet_ntoa(int(local.split(":")[0], 16).to_bytes(4, "little"))
                found += [uplink for uplink in UPLINKS if self.net.address(uplink) == address]
        return found

    async def fly(self) -> None:
        """Sends sticks as a gamepad does, each with a number in the field for the buttons."""
        for number in itertools.count(1):
            message = mavlink.MAVLink_manual_control_message(1, 300, 0, 500, 0, number)
            frame = build(message, system_id=255, component_id=190, sequence=number & 0xFF)
            now = time.monotonic()
            self.sent[number] = now
            await self.pilot.socket.send(stamp(stamp_ms(now)) + tag(self.drone_id, frame))
            await asyncio.sleep(STICKS_EACH_S)

    async def listen(self) -> None:
        """Plays the browser, which responds to the tower's pings."""
        while True:
            data = await self.pilot.socket.recv()
            if isinstance(data, str):
                event = json.loads(data)
                if event["type"] == "ping":
                    await self.pilot.socket.send(json.dumps({"type": "pong", "sequence": event["sequence"]}))
                elif event["type"] in ("hold", "drone"):
                    self.pilot.events.append(event)

    async def more_sticks(self, seconds: float) -> None:
        """Waits until as many more have arrived as are sent in that time."""
        wanted = len(self.autopilot.sticks) + int(seconds / STICKS_EACH_S)
        await until(lambda: len(self.autopilot.sticks) >= wanted, 10 * seconds + 5.0, "sticks come")

    def _paused_s(self, low: int, high: int) -> float:
        """Returns the total delay in sending between these stick frames."""
        return sum(max(0.0, self.sent[n + 1] - self.sent[n] - STICKS_EACH_S) for n in range(low, high))

    def longest_gap_s(self) -> float:
        """Returns the longest gap between stick frames at the autopilot, less the pauses of this busy machine in
        sending."""
        return max(
            at - before - STICKS_EACH_S - self._paused_s(low, high)
            for (before, low), (at, high) in itertools.pairwise(self.autopilot.sticks)
            if high > low
        )


@pytest.fixture
def net(missing: Callable[[str], None]) -> TwoUplinks:
    reason = why_not()
    if reason is not None:
        missing(reason)
    with two_uplinks() as network:
        yield network  # type: ignore[misc]


@contextlib.asynccontextmanager
async def flown_over(net: TwoUplinks, tmp_path: Path) -> AsyncIterator[World]:
    """Everything but the agent and its autopilot runs in the tower's host."""
    async with contextlib.AsyncExitStack() as stack:
        stack.enter_context(net.inside("tower"))
        tower = await stack.enter_async_context(start_tower(tmp_path, udp_host=TOWER))
        admin = await tower.add_user("admin", Role.ADMIN)
        drone = await tower.add_drone("Kestrel", admin)
        certificate, key = make_certificate(tmp_path, TOWER)
        front = TlsFront(int(tower.base_url.rsplit(":", 1)[1]))
        stack.push_async_callback(front.close)
        front_port = await front.open(TOWER, certificate, key)
        client = await tower.signed_in(admin)
        pilot = await stack.enter_async_context(live(tower, client))
        with net.inside("drone"):
            at_autopilot, taken = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
            taken.bind(("127.0.0.1", 0))
            agent_port = taken.getsockname()[1]
            taken.close()
            at_autopilot.connect(("127.0.0.1", agent_port))
            at_autopilot.setblocking(False)
        token = tmp_path / "token"
        drone.keep(token)
        agent = await asyncio.create_subprocess_exec(
            *("ip", "netns", "exec", net.namespace("drone"), sys.executable, "-c"),
            "from onboard_agent.cli import main; main()",
            *("run", "--tower", f"https://{TOWER}:{front_port}", "--token", str(token)),
            *("--autopilot", f"udpin:127.0.0.1:{agent_port}", "--uplink", ",".join(UPLINKS)),
            *("--state", str(tmp_path / "state")),
            env={**os.environ, "SSL_CERT_FILE": str(certificate)},
        )
        autopilot = Autopilot()
        try:
            await autopilot.start_on(at_autopilot)
            world = World(net, tower, autopilot, pilot, DroneId(drone.id), agent.pid, front_port)
            await until(lambda: world.drone.armed and world.uplinks == 2, 30.0, "the drone is there, by both uplinks")
            assert (await ask(client, drone.id, "acquire")).status_code == 200
            yield world
        finally:
            autopilot.stop()
            with contextlib.suppress(ProcessLookupError):
                agent.kill()
            await agent.wait()


async def test_either_uplink_is_lost_under_a_hand_and_no_stick_is_missed(net: TwoUplinks, tmp_path: Path) -> None:
    async with flown_over(net, tmp_path) as world, asyncio.TaskGroup() as group:
        flying = [group.create_task(world.fly()), group.create_task(world.listen())]
        await world.more_sticks(0.5)
        link, link_id = world.drone.link, world.link_id
        assert link is not None
        both = {address for address, _ in link.routes.targets}
        assert both == {net.address(uplink) for uplink in UPLINKS}, (
            "each leaves by its own interface, whatever the routes"
        )
        for times in (1, 2):
            (lost,) = world.carrying()
            net.cut(lost)
            await until(
                lambda times=times: world.hub.state.traffic.links_resumed == times,  # type: ignore[misc]
                RESUMED_WITHIN_S,
                f"the control channel has left {lost}",
            )
            await world.more_sticks(1.0)
            assert lost not in world.carrying()
            net.mend(lost)
            await until(lambda: world.uplinks == 2, 10.0, "both are back")
        assert world.link_id == link_id
        assert world.longest_gap_s() < MAX_GAP_S
        missed = len(world.sent) - len({number for _, number in world.autopilot.sticks})
        assert missed <= MAX_GAP_S / STICKS_EACH_S, "but for what is on its way"
        assert world.autopilot.modes_asked() == [] and world.autopilot.centred == 0, "nothing held"
        assert world.hub.state.traffic.holds_ordered == 0
        assert [event for event in world.pilot.events if event["type"] == "hold"] == []
        assert all(event["drone"]["online"] for event in world.pilot.events if event["type"] == "drone")
        # When both fail, the result is as with a single uplink: the drone holds, the link ends, and a new one begins.
        for uplink in UPLINKS:
            net.cut(uplink)
        await until(lambda: world.autopilot.modes_asked(), 5.0, "the agent holds by itself")
        await until(lambda: not world.drone.online, 10.0, "the tower hears nothing")
        await until(lambda: not world.carrying(), 15.0, "the agent has given the control channel up")
        for uplink in UPLINKS:
            net.mend(uplink)
        await until(lambda: world.drone.online and world.link_id != link_id, 20.0, "a new link")
        for task in flying:
            task.cancel()
