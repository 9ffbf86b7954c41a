"""Aircraft of a simulated receiver and of a feed reach a browser over the real ports."""

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from worlds.pilot import Pilot, watching
from worlds.processes import World


@pytest.fixture
def feed(tmp_path: Path) -> Path:
    return tmp_path / "aircraft.json"


@pytest.fixture
def world(tmp_path: Path, feed: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[World]:
    monkeypatch.setenv("TOWER_TRAFFIC_FEED", str(feed))
    with World(tmp_path) as world:
        world.add_user("alice", "operator")
        world.add_user("admin", "admin")
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1", "--seed", "3", "--traffic"))
        world.wait_until_online(world.visitor("admin"), 1)
        yield world


def names(pilot: Pilot) -> set[str]:
    told = [one["aircraft"] for one in pilot.events if one["type"] == "aircraft"]
    return {aircraft["name"] for aircraft in told[-1]} if told else set()


async def test_a_receiver_on_board_and_a_feed_are_shown(world: World, feed: Path) -> None:
    async with watching(world.visitor("alice"), 1) as alice:
        await alice.until(lambda: names(alice) == {"HELI1", "GLIDER2", "TWR42"}, "what the receiver hears")
        await alice.until(lambda: alice.has_position, "the drone's position")
        lat, lon = alice.place_deg
        aircraft = {"hex": "3c6444", "flight": "DLH1 ", "lat": lat + 0.1, "lon": lon, "alt_geom": 9000, "seen_pos": 0.5}
        await asyncio.to_thread(feed.write_text, json.dumps({"aircraft": [aircraft]}))
        await alice.until(lambda: "DLH1" in names(alice), "what the feed has")
