"""A controller that speaks MSP and a sensor that speaks JSON, through a real agent and a real tower: seen, and flown by
hand."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

from worlds.processes import World

from control_tower import Tower
from simulator.serial_inputs.msp_server import MspServer, Snapshot

STANDING = Snapshot(
    lat_deg=47.3977,
    lon_deg=8.5456,
    alt_amsl_m=488.0,
    yaw_deg=90.0,
    satellites=12,
    fix=True,
    voltage_v=16.2,
    sticks_us=(1500, 1500, 1500, 1000, 1000, 1000, 1000, 1000),
)


ROLLED = (2000, 1500, 1000, 1500, 1000, 1000, 1000, 1000)
CENTRED = (1500, 1500, 1500, 1500, 1000, 1000, 1000, 1000)
"""Once the program says nothing more."""


@contextlib.asynccontextmanager
async def controller(sticks: list[tuple[int, ...]]) -> AsyncIterator[int]:
    """The simulator's MSP server on a port."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        server = MspServer(lambda: STANDING, sticks.append)
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(4096):
                writer.write(server.receive(data))
                await writer.drain()
        writer.close()

    async with await asyncio.start_server(serve, "127.0.0.1", 0) as listening:
        yield listening.sockets[0].getsockname()[1]


@contextlib.asynccontextmanager
async def sensor() -> AsyncIterator[int]:
    """A sensor on a port, with a line each 50 ms."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError):
            while not reader.at_eof():
                writer.write(b'{"co2_ppm": 415.5}\n')
                await writer.drain()
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(reader.read(1), 0.05)
        writer.close()

    async with await asyncio.start_server(serve, "127.0.0.1", 0) as listening:
        yield listening.sockets[0].getsockname()[1]


async def test_it_is_seen_and_flown_by_hand(tmp_path: Path) -> None:
    sticks: list[tuple[int, ...]] = []
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Whoop", "alice")
        scopes = ("--scope", "watch", "--scope", "fly")
        world.tower_command("token", "add", "alice", "sdk", *scopes, "--token-file", str(tmp_path / "token"))
        await asyncio.to_thread(world.start_tower)
        async with controller(sticks) as port, sensor() as sensor_port:
            world.start_agent("Whoop", f"msp:tcp:127.0.0.1:{port}", "--sensor", f"tcp:127.0.0.1:{sensor_port}")
            token = (tmp_path / "token").read_text().strip()
            async with Tower(world.address, token) as tower, asyncio.timeout(30):
                drone = tower.drone("Whoop")
                with drone.watch() as telemetry:
                    async for now in telemetry:
                        if now.place is not None and now.mode is not None and now.battery_v is not None and now.values:
                            break
                assert (now.place, now.mode, now.armed, now.battery_v) == ((47.3977, 8.5456), "UNKNOWN", False, 16.2)
                assert (now.heading_deg, now.values) == (90.0, {"co2_ppm": 415.5})
                async with drone.fly() as flight, flight.sticks() as hand:
                    seen = False
                    while not seen or sticks[-1] != CENTRED:
                        seen = seen or ROLLED in sticks
                        if not seen:
                            hand.set(roll=1.0, throttle=-1.0)
                        await asyncio.sleep(0.05)
            # Nothing is left of the server's connection when the loop ends.
            world.running("agent-Whoop").terminate()
            await asyncio.to_thread(world.running("agent-Whoop").wait, 10)
