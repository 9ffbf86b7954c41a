"""SIGKILL during an upload, to the tower and to the agent: in the end one whole plan is on board, and the tower knows
which. Real processes; `tests/model/test_plans_model.py` does it at every step.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from worlds.processes import Visitor, World, free_udp_ports, kill_9, wait_for

ITEMS = 200
PLAN = "/drones/1/mission"


def plan(height_m: int) -> list[Any]:
    return [[16, 3, [0, 0, 0, 0], 473_977_000 + 100 * n, 85_456_000, height_m, 1] for n in range(ITEMS)]


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """alice's Kestrel, whose autopilot overwrites the old items as the new ones arrive."""
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        (port,) = free_udp_ports(1)
        world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}")
        home = ("--home", "47.3977,8.5456,488,0", "--out", f"udp:127.0.0.1:{port}")
        world.start("simulator", "tower-sim", *home, "--fail", "mission-written-in-place")
        yield world


def known(alice: Visitor) -> Any:
    """Returns the plan on board, once the tower knows it."""

    def look() -> Any:
        answer = alice.ask("GET", PLAN)
        return answer.json if answer.status == 200 and answer.json["state"] == "known" else None

    return wait_for("the plan on board to be known", look)


def reread(alice: Visitor) -> Any:
    """Rereads the plan from the autopilot as soon as the agent is not busy: it continues to write without its tower,
    and first repairs the plan after a kill."""

    def look() -> Any:
        answer = alice.ask("GET", f"{PLAN}?fresh=true")
        return answer.json if answer.status == 200 else None

    return wait_for("the plan to be read", look)


def until_half_is_written(alice: Visitor, operation: Any) -> None:
    def half() -> bool:
        now = alice.ask("GET", f"/operations/{operation['id']}").json
        assert now["state"] == "running", now
        return bool(now["phase"] == "writing" and now["done"] >= ITEMS // 4)

    wait_for("half of the plan to be written", half)


def test_the_tower_and_the_agent_are_killed_in_the_middle_of_an_upload(world: World) -> None:
    alice = world.visitor("alice")
    known(alice)
    alice.ask("POST", "/drones/1/control/acquire")
    assert alice.ask("PUT", PLAN, {"items": plan(30)}).json["state"] == "done"
    old, new = plan(30), plan(60)
    for victim in ("tower", "agent"):
        alice.ask("POST", "/drones/1/control/acquire")
        operation = alice.ask("PUT", PLAN, {"items": new}, Prefer="respond-async").json
        until_half_is_written(alice, operation)
        if victim == "tower":
            kill_9(world.tower)
            world.start_tower()
        else:
            kill_9(world.running("agent-Kestrel"))
            world.restart("agent-Kestrel")
        alice = world.visitor("alice")
        world.wait_until_online(alice, 1)
        there = reread(alice)
        assert there["items"] in (old, new)
        assert there["fit_to_fly"]
        assert known(alice)["hash"] == there["hash"]
        if victim == "agent":
            ended = alice.ask("GET", f"/operations/{operation['id']}").json
            assert (ended["state"], "check what is on board" in ended["words"]) == ("failed", True)
        old, new = there["items"], plan(90)
    alice.ask("POST", "/drones/1/control/acquire")
    assert alice.ask("PUT", PLAN, {"items": new}).json["state"] == "done"
