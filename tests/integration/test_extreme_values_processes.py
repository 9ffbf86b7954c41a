"""Impossible values in every field of every message, through a real agent and a real tower: `test_extreme_values.py`
over sockets. Then each REST route answers."""

import json
import re
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest
from every_route import ROUTES, path_of
from worlds.extreme_frames import extremes, frame_of, messages_read
from worlds.free_ports import free_udp_ports
from worlds.processes import World, wait_for

from wire.dialect import build, mavlink

pytestmark = pytest.mark.long("through whole programs; test_extreme_values.py does it in one")

BEAT = build(mavlink.MAVLink_heartbeat_message(2, 3, 0xD1, 5, 4, 3), system_id=1, component_id=1, sequence=0)
PAUSE_S = 0.01
"""Between two rounds: the tower limits the frames of a drone."""
ROUND = 4


@contextmanager
def autopilot(agent_port: int) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        opened.connect(("127.0.0.1", agent_port))
        opened.setblocking(False)
        yield opened


def finite(text: str) -> Any:
    def refuse(word: str) -> Any:
        raise AssertionError(f"{word} in {text[:200]}")

    return json.loads(text, parse_constant=refuse)


def test_no_link_is_lost_and_every_route_answers(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.tower_command("migrate")
        world.add_user("alice")
        world.add_user("admin", "admin")
        for name in ("Kestrel", "Falcon"):
            world.add_drone(name, "alice")
        world.start_tower()
        (port,) = free_udp_ports(1)
        world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}")
        alice = world.visitor("alice")
        with autopilot(port) as line:

            def heard() -> bool:
                with suppress(OSError):
                    line.send(BEAT)
                return bool(alice.drone(1)["autopilot_heard"])

            wait_for("the autopilot to be heard", heard)
            numbers = messages_read()
            for at in range(0, len(numbers), ROUND):
                for round_ in zip_longest(*(extremes(number) for number in numbers[at : at + ROUND])):
                    for number, one in zip(numbers[at : at + ROUND], round_, strict=False):
                        if one is not None:
                            with suppress(OSError):
                                line.send(frame_of(number, one[1]))
                    line.send(BEAT)
                    time.sleep(PAUSE_S)
                    with suppress(OSError):
                        while line.recv(2048):
                            pass
                if at % (8 * ROUND) == 0:
                    _every_get(alice)
            wait_for("the autopilot to be heard", heard)
        _every_get(alice)
        _every_get(world.visitor("admin"))
        metrics = world.visitor("admin").fetch("/metrics").body.decode()
        logs = {name: world.log_of(name) for name in ("tower-1", "agent-Kestrel")}
    for name, log in logs.items():
        assert "Traceback" not in log, name
        assert "part_failed" not in log, name
    assert "link lost" not in logs["agent-Kestrel"]
    assert "tower_links_orphaned_total 0" in metrics
    assert not re.findall(r"^tower_faults_total(?:\{.*\})? [1-9].*$", metrics, re.MULTILINE)


def _every_get(visitor: Any) -> None:
    for route in ROUTES:
        if "GET" in (route.methods or ()):
            answer = visitor.ask("GET", path_of(route, 1).removeprefix("/api/v1"))
            assert answer.status < 500 or answer.status == 503, (route.path, answer.status)
            if "json" in answer.headers.get("Content-Type", ""):
                finite(answer.body.decode())
