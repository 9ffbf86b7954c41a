"""One id leads from a person's request through the tower's log and audit trail to the agent's log and back."""

import asyncio
import json
import re
from pathlib import Path

import pytest
from tower_world import start_tower
from worlds.pilot import at_the_controls
from worlds.processes import Answer, World, wait_for

from server.kernel.people import Role
from server.runtime.request_id import accepted_or_new, trace_id_in

ID = "browser-1.take_off"


@pytest.mark.parametrize("sent", ["12345678", "a" * 64, ID, "0f8fad5b-d9cb-469f-a165-70867728950e"])
def test_a_good_id_is_taken_over(sent: str) -> None:
    assert accepted_or_new(sent) == sent


@pytest.mark.parametrize(
    "sent",
    [None, "", "short", "a" * 65, "-12345678", "1234 5678", "12345678\n", 'x"}{"level"', "ééééééééé", "12345;78"],
)
def test_anything_else_gets_an_id_of_the_towers(sent: str | None) -> None:
    made = accepted_or_new(sent)
    assert re.fullmatch(r"[0-9a-f]{16}", made)
    assert made != accepted_or_new(sent)


@pytest.mark.parametrize(
    ("traceparent", "found"),
    [
        ("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01", "4bf92f3577b34da6a3ce929d0e0e4736"),
        ("00-" + "0" * 32 + "-00f067aa0ba902b7-01", None),
        ("01-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01", None),
        ("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\n", None),
        ("", None),
        (None, None),
    ],
)
def test_the_trace_id_of_other_programs(traceparent: str | None, found: str | None) -> None:
    assert trace_id_in(traceparent) == found


async def test_answers_and_audit_events_name_the_request(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        answer = await root.post("/api/v1/drones", json={"name": "Kestrel"}, headers={"X-Request-Id": ID})
        assert (answer.status_code, answer.headers["x-request-id"]) == (201, ID)
        found = (await root.get("/api/v1/audit", params={"request_id": ID})).json()
        assert [(one["action"], one["request_id"]) for one in found] == [("drone.created", ID)]
        others = (await root.get("/api/v1/audit", params={"action": "session.began"})).json()
        assert re.fullmatch(r"[0-9a-f]{16}", others[0]["request_id"])
        for path in ("/api/v1/nothing", "/", "/api/v1/health"):
            refused = await root.get(path, headers={"X-Request-Id": "bad id"})
            assert re.fullmatch(r"[0-9a-f]{16}", refused.headers["x-request-id"])
        traced = await root.get("/api/v1/health", headers={"traceparent": f"00-{'ab' * 16}-{'cd' * 8}-01"})
        assert traced.headers["x-request-id"] == "ab" * 16
        assert f",{ID}," in (await root.get("/api/v1/audit.csv")).text


async def test_a_command_is_found_by_one_id_from_the_browser_to_the_autopilot_and_back(tmp_path: Path) -> None:
    with World(tmp_path / "world") as world:
        world.add_user("alice")
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        await asyncio.to_thread(world.start_simulated, "Kestrel", options=("--boot-s", "1", "--seed", "3"))
        alice = world.visitor("alice")
        await asyncio.to_thread(world.wait_until_online, alice, 1)
        async with at_the_controls(alice, 1):
            body = {"command": "mode", "mode": "STABILIZE"}

            def given() -> Answer | None:
                answer = alice.ask("POST", "/drones/1/commands", body, **{"X-Request-Id": ID})
                assert answer.status in (200, 409), answer.body  # 409: the tower has not heard the heartbeat yet
                return answer if answer.status == 200 else None

            answer = await asyncio.to_thread(wait_for, "the command", given)
            operation = answer.json["id"]
        agent = wait_for("the agent's lines", lambda: [one for one in _lines(world, "agent-Kestrel") if "ends" in one])
        agent = _lines(world, "agent-Kestrel")
        assert [re.sub(r".*request \S+: ", "", line).split(":")[0] for line in agent][:2] == [
            f"transaction {operation} begins",
            "MAV_CMD 176 goes to the autopilot",
        ]
        assert any("is acknowledged by the autopilot with MAV_RESULT 0" in line for line in agent)
        assert f"transaction {operation} ends: done" in agent[-1]
        tower = [json.loads(line) for line in _lines(world, "tower-1")]
        began, ended = (
            next(one for one in tower if one["event"] == f"operation_{what}") for what in ("began", "ended")
        )
        assert began["operation"] == ended["operation"] == operation
        assert (began["by"], began["drone_id"], ended["state"]) == ("alice", 1, "done")


def _lines(world: World, name: str) -> list[str]:
    return [line for line in world.log_of(name).splitlines() if ID in line]
