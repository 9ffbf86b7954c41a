"""An agent of the release before, from its own wheel, with the tower of today."""

import asyncio
import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from worlds.example_messages import examples
from worlds.pilot import ALT_HOLD, GUIDED, at_the_controls
from worlds.processes import World
from worlds.release_before import TAKES, VERSION, release_before

from wire.control_messages import ToAgent, decode_to_agent
from wire.negotiation import understands

pytestmark = pytest.mark.long("an agent of the release before")

READ_ALL = """
import sys

import onboard_agent
from wire.control_messages import MalformedMessage, decode_to_agent

assert onboard_agent.VERSION == sys.argv[1], onboard_agent.__file__
for line in sys.stdin:
    try:
        decode_to_agent(line)
    except MalformedMessage as error:
        print(error, line, end="")
"""


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return release_before(tmp_path_factory.mktemp("release"))


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    with World(tmp_path / "world") as world:
        yield world


def test_it_reads_every_message_that_the_tower_would_send_it(programs: Path) -> None:
    texts = [json.dumps(one) for one in examples(ToAgent)]
    sent = [text for text in texts if understands(TAKES, decode_to_agent(text))]
    assert 100 < len(sent) < len(texts)
    said = subprocess.run(
        [programs / "python", "-c", READ_ALL, VERSION],
        input="\n".join(sent) + "\n",
        cwd=programs,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (said.returncode, said.stdout, said.stderr) == (0, "", "")


def test_it_links_and_flies_and_its_version_is_shown(programs: Path, world: World) -> None:
    world.start_tower()
    world.add_user("alice")
    world.add_user("root", "admin")
    drone_id = world.add_drone("Kestrel", "alice")
    world.start_simulated("Kestrel", options=("--boot-s", "1"), agent=str(programs / "tower-agent"))
    alice, admin = world.visitor("alice"), world.visitor("root")
    world.wait_until_online(alice, drone_id)
    assert alice.drone(drone_id)["agent_version"] == VERSION

    async def fly() -> None:
        async with at_the_controls(alice, drone_id) as pilot:
            await pilot.take_off(5.0)
            # The id of the request goes along with the work, and the agent ignores it.
            answer = await pilot.ask("POST", "/mission/verify", {"items": []})
            assert answer.status in {200, 202}, answer.body
            await pilot.until(
                lambda: any(one["type"] == "operation" and one["operation"]["state"] == "done" for one in pilot.events),
                "the plan on board to be read",
            )
            taken = await asyncio.to_thread(admin.ask, "POST", f"/drones/{drone_id}/control/take", {})
            assert taken.status == 200, taken.body
            await pilot.until_event("hold", step="confirmed")
            assert pilot.mode not in {GUIDED, ALT_HOLD}, "stage two holds without sticks"

    asyncio.run(fly())
    metrics = admin.fetch("/metrics").body.decode()
    assert f'tower_agent_versions{{version="{VERSION}"}} 1.0' in metrics
    assert not re.search(r'tower_drops_total\{reason="(malformed|not_understood)"\} [1-9]', metrics), metrics
    log = world.log_of("agent-Kestrel")
    assert log.count("link up") == 1, log
    assert "link down" not in log
    assert world.running("agent-Kestrel").poll() is None
    assert alice.drone(drone_id)["online"]
