"""An agent updates itself through its tower, with real processes: good, forged, older, broken, and while armed."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from packages.agent_update import public_text
from worlds.agent_releases import write_release
from worlds.pilot import at_the_controls
from worlds.processes import Visitor, World, wait_for

from onboard_agent import VERSION

KEY = Ed25519PrivateKey.generate()
CRASHES = {"onboard_agent/agent.py": "raise SystemExit('this release is broken')\n"}
DEADLINE_S = 90.0


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    # The agent starts again in its own place, which only a program in an interpreter of its own can.
    with World(tmp_path / "world", as_installed=True) as world:
        world.start_tower()
        world.add_user("root", "admin")
        yield world


class Fleet:
    """One drone that trusts KEY, and an admin."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.releases = world.folder / "agent_releases"
        self.drone_id = world.add_drone("Kestrel")
        world.start_simulated("Kestrel", options=("--boot-s", "1"))
        world.running("agent-Kestrel").terminate()
        agent = world._started["agent-Kestrel"][1]
        world.start("agent-Kestrel", *agent, "--release-key", public_text(KEY))
        self.admin: Visitor = world.visitor("root")

    def wait_for_autopilot(self) -> None:
        """An agent that has just started refuses: it has heard nothing yet."""
        wait_for("the autopilot", lambda: self.admin.drone(self.drone_id).get("autopilot_heard"))

    def update(self, version: str, **more: Any) -> Any:
        """Orders an update and returns its end."""
        self.wait_for_autopilot()
        prefer = {"Prefer": "respond-async"}
        begun = self.admin.ask("POST", f"/drones/{self.drone_id}/agent-update", {"version": version, **more}, **prefer)
        assert begun.status == 202, begun.body
        path = f"/operations/{begun.json['id']}"

        def ended() -> Any:
            found = self.admin.ask("GET", path).json
            return found if found["state"] != "running" else None

        return wait_for(f"the end of the update to {version}", ended, timeout_s=DEADLINE_S)

    @property
    def version(self) -> str:
        return str(self.admin.drone(self.drone_id)["agent_version"])


def test_an_agent_is_updated_and_goes_back_when_it_must(world: World) -> None:
    fleet = Fleet(world)
    agent = world.running("agent-Kestrel")
    write_release(fleet.releases, "9.1.0", KEY)
    write_release(fleet.releases, "9.2.0", KEY, CRASHES)
    write_release(fleet.releases, "9.0.0", KEY)
    listed = fleet.admin.ask("GET", "/agent-releases").json
    assert [one["version"] for one in listed] == ["9.2.0", "9.1.0", "9.0.0"]

    good = fleet.update("9.1.0")
    assert (good["state"], good["words"]) == ("done", "The agent 9.1.0 runs, and has linked with the tower.")
    assert fleet.version == "9.1.0"

    older = fleet.update("9.0.0")
    assert older["state"] == "refused" and "nobody asked for an older one" in older["words"]

    broken = fleet.update("9.2.0")
    assert broken["state"] == "failed", broken
    assert "9.2.0 ended with exit status" in broken["words"] and "back at 9.1.0" in broken["words"]
    assert fleet.version == "9.1.0"

    asked_for = fleet.update("9.0.0", older=True)
    assert (asked_for["state"], fleet.version) == ("done", "9.0.0")
    assert agent.poll() is None, "systemd would see one process all the time"
    trail = fleet.admin.ask("GET", "/audit?action=operation.ended").json
    assert any("9.1.0 runs" in one["detail"]["words"] for one in trail)

    # What runs outlives a restart of the agent.
    agent.terminate()
    agent.wait(20)
    world.restart("agent-Kestrel")
    wait_for("the agent to be back", lambda: fleet.admin.drone(fleet.drone_id)["online"])
    assert fleet.version == "9.0.0"


def test_what_an_agent_refuses_stays_outside(world: World) -> None:
    fleet = Fleet(world)
    write_release(fleet.releases, "9.1.0", Ed25519PrivateKey.generate())
    write_release(fleet.releases, "9.2.0", KEY, spoil=True)
    write_release(fleet.releases, "9.3.0", KEY)
    write_release(fleet.releases, "0.0.1", KEY)
    forged = fleet.update("9.1.0")
    assert forged["state"] == "failed" and "not signed by a release key of this agent" in forged["words"]
    spoilt = fleet.update("9.2.0")
    assert spoilt["state"] == "failed" and "not what was signed" in spoilt["words"]
    below = fleet.update("0.0.1", older=True)
    assert below["state"] == "refused" and "only a person can undo it" in below["words"]
    unknown = fleet.admin.ask("POST", f"/drones/{fleet.drone_id}/agent-update", {"version": "9.9.9"})
    assert (unknown.status, unknown.json["type"]) == (404, "/problems/unknown-release")

    async def armed() -> Any:
        async with at_the_controls(fleet.admin, fleet.drone_id) as pilot:
            await pilot.take_off(5.0)
            return await asyncio.to_thread(fleet.update, "9.3.0")

    in_the_air = asyncio.run(armed())
    assert in_the_air["state"] == "refused" and "The drone is in the air" in in_the_air["words"]
    assert fleet.version == VERSION
