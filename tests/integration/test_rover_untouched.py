"""A rover that nobody has measured, behind a real agent and a real tower: a TAKE, a release and a dead tower do not
move it, and everybody who looks is told so."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import pytest
from worlds.free_ports import free_udp_ports
from worlds.processes import World, kill_9, wait_for

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT
from wire.dialect import build, decode, mavlink
from wire.frame_stream import FrameStream

ROVER: Final = mavlink.MAVLink_heartbeat_message(
    mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, 0x81, 0, mavlink.MAV_STATE_ACTIVE, 3
)
"""Armed in MANUAL."""
MOVES: Final = ("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "SET_MODE")


class Rover:
    """Says that it is there, and keeps what it is sent."""

    def __init__(self, agent_port: int) -> None:
        self.heard: list[Any] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.connect(("127.0.0.1", agent_port))
        self._socket.settimeout(0.1)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    def _live(self) -> None:
        stream, number = FrameStream(), 0
        while not self._ends.is_set():
            try:
                self._socket.send(build(ROVER, system_id=1, component_id=1, sequence=number % 256))
                number += 1
                self.heard += [decode(frame) for frame in stream.feed(self._socket.recv(4096))]
            except OSError:  # nobody listens yet, or nothing came
                self._ends.wait(0.1)

    def stop(self) -> None:
        self._ends.set()
        self._thread.join()
        self._socket.close()

    @property
    def heartbeats(self) -> int:
        """Of the agent, not of the ground station for which it speaks."""
        agents = [one for one in self.heard if one is not None and one.get_srcComponent() == AGENT_COMPONENT]
        return sum(one.get_type() == "HEARTBEAT" for one in agents)

    @property
    def told_to_move(self) -> list[str]:
        return [
            message.get_type()
            for message in self.heard
            if message is not None and (message.get_type() in MOVES or getattr(message, "command", 0) == 176)
        ]


@contextmanager
def driven(agent_port: int) -> Iterator[Rover]:
    rover = Rover(agent_port)
    yield rover
    rover.stop()


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_user("root", "admin")
        world.add_drone("Beaver", "alice")
        world.start_tower()
        yield world


def test_a_rover_is_watched_only_and_everybody_is_told(world: World) -> None:
    (port,) = free_udp_ports(1)
    world.start_agent("Beaver", f"udpin:127.0.0.1:{port}")
    with driven(port) as rover:
        alice, root = world.visitor("alice"), world.visitor("root")
        soon = {"lost_hold_s": 0.5, "lost_action_s": 2.0}
        assert root.ask("PATCH", "/drones/1/settings", soon).status == 200
        wait_for("the rover to be heard", lambda: alice.drone(1).get("autopilot_heard"))
        assert alice.drone(1)["watched_only"] is True
        assert alice.drone(1)["armed"] is True
        (sentence,) = alice.ask("GET", "/drones/1/loss-check").json["sentences"]
        assert "watched only" in sentence["text"]
        assert sentence["severity"] == "warning"

        assert alice.ask("POST", "/drones/1/control/acquire").status == 200
        assert root.ask("POST", "/drones/1/control/take", {}).status == 200
        alert = wait_for(
            "the alert",
            lambda: next((one for one in root.ask("GET", "/alerts").json if one["rule"] == "hold-unconfirmed"), None),
        )
        assert "Beaver" in alert["words"] and "this vehicle is watched only" in alert["words"]
        assert root.drone(1)["hold"] is None
        refused = root.ask("POST", "/drones/1/rehearsal", {"what": "tower"})
        assert (refused.status, refused.json["type"]) == (409, "/problems/watched-only")
        assert root.ask("POST", "/drones/1/control/release").status == 200

        kill_9(world.tower)
        heard = rover.heartbeats
        # Longer than the agent waits for a lost tower: it sends one a second.
        wait_for("the agent to go on", lambda: rover.heartbeats > heard + 5)
        assert rover.told_to_move == []
