"""Which callers bypass the queue for strangers: agents that prove which drone is theirs, and nobody else."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from server.link.api.agent_sign_in import is_agent
from server.live.hub import Hub
from wire.drone_key import CALLER_HEADER, DroneKey, key_text
from wire.ids import DroneId

KEY = DroneKey(DroneId(7), bytes(range(32)))
NO_KEY = 8


def hub() -> Hub:
    records = {7: SimpleNamespace(public_key=KEY.public, credential_hash="")}
    records[NO_KEY] = SimpleNamespace(public_key=b"", credential_hash="")
    drones = {drone_id: SimpleNamespace(record=record) for drone_id, record in records.items()}
    return cast(Hub, SimpleNamespace(state=SimpleNamespace(drones=drones)))


def scope(caller: str, *, path: str = "/api/v1/agent", kind: str = "websocket") -> dict[str, Any]:
    return {"type": kind, "path": path, "headers": [(CALLER_HEADER.encode(), caller.encode("latin-1"))]}


def test_the_agent_of_a_drone_that_there_is() -> None:
    assert is_agent(hub(), scope(f"7 {key_text(KEY.public)}"))


@pytest.mark.parametrize(
    "caller",
    [
        "",
        "7",
        "7 ",
        f"6 {key_text(KEY.public)}",
        f"7 {key_text(bytes(32))}",
        "7 \xff",
        "\xb2 x",
        f"{NO_KEY} ",
        "9" * 5000 + " x",
    ],
)
def test_nobody_else(caller: str) -> None:
    assert not is_agent(hub(), scope(caller))


def test_nothing_but_a_control_channel() -> None:
    caller = f"7 {key_text(KEY.public)}"
    assert not is_agent(hub(), scope(caller, path="/api/v1/live"))
    assert not is_agent(hub(), scope(caller, kind="http"))
