"""A flight of the simulator, by hand and by another pilot: its figures are what was flown."""

import asyncio
import csv
import io
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from worlds.pilot import ALT_HOLD, at_the_controls, fly_by_hand
from worlds.processes import World, wait_for

pytestmark = pytest.mark.long("figures of real flights; test_server_statistics.py has made ones")

HEIGHT_M = 10.0


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    with World(tmp_path) as world:
        for name, role in (("alice", "operator"), ("admin", "admin")):
            world.add_user(name, role)
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1", "--seed", "3"))
        world.wait_until_online(world.visitor("admin"), 1)
        yield world


async def test_figures_of_a_flown_flight(world: World) -> None:
    admin, visitor = world.visitor("admin"), world.visitor("alice")
    armed_at = time.monotonic()
    async with at_the_controls(visitor, 1) as alice:
        await fly_by_hand(alice, HEIGHT_M)
        flying_at = time.monotonic()
        await alice.set_mode(ALT_HOLD)
        for deflection in (400, -400, 500, -500):
            alice.hold_sticks(pitch=deflection)
            await asyncio.sleep(1.0)
            alice.hold_sticks()
            await asyncio.sleep(1.5)
        await alice.centre_sticks()
        landing_at = time.monotonic()
        answer = await alice.ask("POST", "/commands", {"command": "land"})
        assert answer.status == 200, answer.body

        def ready() -> bool:
            flights = admin.ask("GET", "/flights").json["flights"]
            return bool(flights) and flights[0]["state"] == "ready"

        await asyncio.to_thread(wait_for, "the flight to close", ready, timeout_s=90.0)
    ended_at = time.monotonic()
    (flight,) = admin.ask("GET", "/flights").json["flights"]
    figures: dict[str, Any] = visitor.ask("GET", f"/flights/{flight['id']}/figures").json
    print(figures)
    assert landing_at - flying_at < figures["air_s"] < ended_at - armed_at
    assert figures["air_s"] < figures["duration_s"] == pytest.approx(flight["duration_s"], abs=0.01)
    assert figures["max_height_m"] == pytest.approx(HEIGHT_M, abs=5.0)
    assert figures["distance_m"] == pytest.approx(flight["distance_m"], abs=5.0)
    assert figures["distance_m"] > 2
    assert 1 < figures["max_speed_m_s"] < 30
    assert 15 < figures["battery_end_v"] < 16.8, "four cells at rest after a short flight"
    assert 15 < figures["battery_start_v"] <= 16.8
    # The model's copter takes some 10 to 30 A in the air.
    assert figures["used_mah"] == pytest.approx(20_000 * figures["air_s"] / 3600, rel=0.8)
    assert (figures["landings"], figures["hand_overs"], figures["link_losses"]) == (1, 0, 0)
    assert 0 < figures["rtt_mean_ms"] < 1000
    (alices,) = figures["pilots"]
    assert (alices["pilot"]["name"], alices["landings"]) == ("alice", 1)
    assert alices["held_s"] == pytest.approx(figures["duration_s"], abs=0.01)
    axes = {one["axis"]: one for one in visitor.ask("GET", f"/flights/{flight['id']}/identification").json["axes"]}
    print(axes)
    pitch = axes["pitch"]["fit"]
    assert pitch["manoeuvres"] >= 1
    assert -45 < pitch["gain"] < -15, "stick forward is nose down, 30 degrees at most"
    assert pitch["r_squared"] > 0.8
    assert 0.02 < pitch["tau_s"] < 0.6
    assert not pitch["at_bound"]
    assert axes["yaw"]["fit"] is None, "nobody moved that stick"
    book = visitor.ask("GET", "/log-book").json
    assert book["total"]["hours"] == pytest.approx(figures["air_s"] / 3600, abs=1e-3)
    (row,) = csv.DictReader(io.StringIO(visitor.ask("GET", "/statistics/csv?by=flights").body.decode()))
    assert float(row["air_s"]) == figures["air_s"]
