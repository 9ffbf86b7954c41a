"""The whole path on real parts: autopilot's socket, agent process, sealed UDP, tower process, WebSocket, and back."""

import asyncio
import contextlib
import json
import os
import shutil
import socket
import struct
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol
from worlds.processes import Visitor, World, free_udp_ports, kill_9, wait_for

from wire.dialect import build, mavlink
from wire.drone_key import DroneKey
from wire.tagged import split_tagged, tag


class Autopilot:
    """A UDP socket that plays an autopilot: sends what the test gives it, and keeps what it receives."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.05)
        self._agent = ("127.0.0.1", port)
        self.heard = b""

    def say(self, frame: bytes) -> None:
        self._socket.sendto(frame, self._agent)

    def listen(self) -> bytes:
        with contextlib.suppress(TimeoutError):
            self.heard += self._socket.recv(2048)
        return self.heard

    def close(self) -> None:
        self._socket.close()


def heartbeat(sysid: int = 1) -> bytes:
    return build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=sysid, component_id=1, sequence=0)


def statustext(text: str) -> bytes:
    message = mavlink.MAVLink_statustext_message(6, text.encode())
    return build(message, system_id=1, component_id=1, sequence=1)


def signed(message: Any) -> bytes:
    """The same message signed with MAVLink 2 signing."""
    packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    packer.signing.secret_key = b"k" * 32
    packer.signing.link_id = 3
    packer.signing.timestamp = 123456789
    packer.signing.sign_outgoing = True
    return bytes(message.pack(packer))


def version_1(message: Any) -> bytes:
    """The same message as MAVLink 1."""
    packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    return bytes(message.pack(packer, force_mavlink1=True))


@contextlib.asynccontextmanager
async def live(visitor: Visitor) -> AsyncIterator[ClientConnection]:
    url = visitor.address.replace("http", "ws") + "/api/v1/live"
    headers = {"Cookie": visitor.cookie, "Origin": visitor.address}
    async with connect(url, subprotocols=[Subprotocol("tower.v1")], additional_headers=headers) as socket_:
        yield socket_


async def next_event(socket_: ClientConnection, kind: str, *, timeout_s: float = 20.0) -> Any:
    async with asyncio.timeout(timeout_s):
        while True:
            message = await socket_.recv()
            if isinstance(message, str) and (event := json.loads(message))["type"] == kind:
                return event


async def frames_until(socket_: ClientConnection, wanted: bytes, *, timeout_s: float = 20.0) -> list[tuple[int, bytes]]:
    """Returns all (drone, frame) pairs up to and including the wanted frame."""
    seen: list[tuple[int, bytes]] = []
    async with asyncio.timeout(timeout_s):
        while True:
            message = await socket_.recv()
            if isinstance(message, bytes):
                seen += split_tagged(message)
                if any(frame == wanted for _, frame in seen):
                    return seen


@pytest.fixture(scope="module")
def accounts_and_drones(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder made once by the `tower` command. Each test gets its own copy."""
    folder = tmp_path_factory.mktemp("template")
    with World(folder) as world:
        world.add_user("alice")
        world.add_user("bob")
        world.add_user("admin", "admin")
        assert world.add_drone("Kestrel", "alice") == 1
        assert world.add_drone("Merlin", "bob") == 2
    return folder


@pytest.fixture
def world(tmp_path: Path, accounts_and_drones: Path) -> Iterator[World]:
    shutil.copytree(accounts_and_drones, tmp_path, dirs_exist_ok=True)
    with World(tmp_path, prepared=True) as world:
        yield world


@pytest.fixture
def two_drones(world: World) -> Iterator[tuple[World, Autopilot, Autopilot]]:
    """Kestrel of alice (1) and Merlin of bob (2), both sysid 1, online."""
    world.start_tower()
    ports = free_udp_ports(2)
    autopilots = [Autopilot(port) for port in ports]
    for drone, port in zip(("Kestrel", "Merlin"), ports, strict=True):
        world.start_agent(drone, f"udpin:127.0.0.1:{port}")
    admin = world.visitor("admin")

    def heard() -> bool:
        for autopilot in autopilots:
            autopilot.say(heartbeat())
        return all(admin.drone(drone_id)["autopilot_heard"] and admin.drone(drone_id)["online"] for drone_id in (1, 2))

    wait_for("both autopilots to be heard", heard)
    yield world, autopilots[0], autopilots[1]
    for autopilot in autopilots:
        autopilot.close()


SPECIAL = {
    "MAVLink 2": build(mavlink.MAVLink_command_ack_message(401, 4, 1), system_id=1, component_id=1, sequence=9),
    "MAVLink 2, signed": signed(mavlink.MAVLink_command_ack_message(402, 4, 1)),
    "MAVLink 1": version_1(mavlink.MAVLink_command_ack_message(403, 4)),
    "trailing zeros kept by the sender": mavlink.MAVLink_command_ack_message(400, 0).pack(
        mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    ),
    "unknown to the dialect": b"\xfd\x03\x00\x00\x07\x01\x01\xf0\xff\x7f" + b"abc" + b"\x12\x34",
}


async def test_frames_arrive_byte_for_byte_both_ways(two_drones: tuple[World, Autopilot, Autopilot]) -> None:
    world, kestrel, _ = two_drones
    alice = world.visitor("alice")
    assert alice.ask("POST", "/drones/1/control/acquire").status == 200
    async with live(alice) as browser:
        await next_event(browser, "welcome")
        for name, frame in SPECIAL.items():
            kestrel.say(frame)
            seen = await frames_until(browser, bytes(frame))
            assert (1, bytes(frame)) in seen, name
            await browser.send(tag(1, bytes(frame)))
            wait_for(f"{name} at the autopilot", lambda frame=frame: bytes(frame) in kestrel.listen())


async def test_no_frame_crosses_between_owners(two_drones: tuple[World, Autopilot, Autopilot]) -> None:
    world, kestrel, merlin = two_drones
    alice, bob, admin = (world.visitor(name) for name in ("alice", "bob", "admin"))
    async with live(alice) as one, live(bob) as two, live(admin) as all_:
        for socket_, squad in ((one, [1]), (two, [2]), (all_, [1, 2])):
            welcome = await next_event(socket_, "welcome")
            assert [drone["id"] for drone in welcome["drones"]] == squad
        for round_ in range(20):
            kestrel.say(statustext(f"kestrel {round_}"))
            merlin.say(statustext(f"merlin {round_}"))
        last_one, last_two = statustext("kestrel 19"), statustext("merlin 19")
        for_alice = await frames_until(one, last_one)
        for_bob = await frames_until(two, last_two)
        assert {drone_id for drone_id, _ in for_alice} == {1}
        assert {drone_id for drone_id, _ in for_bob} == {2}
        assert not any(b"merlin" in frame for _, frame in for_alice)
        assert not any(b"kestrel" in frame for _, frame in for_bob)

        # And downwards: a frame for another user's drone gets the same response as one for a missing drone.
        frame = build(
            mavlink.MAVLink_command_long_message(1, 1, 400, 0, *[0.0] * 7), system_id=255, component_id=190, sequence=0
        )
        answers = []
        for drone_id in (2, 4711):
            await one.send(tag(drone_id, frame))
            notice = await next_event(one, "notice")
            answers.append({**notice, "drone_id": None})
        assert answers[0] == answers[1]
        assert answers[0]["code"] == "unknown-drone"
        assert frame not in merlin.listen()


async def test_strangers_drones_and_no_drones_get_the_same_rest_answer(
    two_drones: tuple[World, Autopilot, Autopilot],
) -> None:
    world, _, _ = two_drones
    alice = world.visitor("alice")
    for method, path in (("GET", ""), ("POST", "/control/acquire"), ("POST", "/control/release")):
        theirs = alice.ask(method, f"/drones/2{path}")
        nobodys = alice.ask(method, f"/drones/4711{path}")
        assert theirs.status == nobodys.status == 404
        assert {**theirs.json, "instance": ""} == {**nobodys.json, "instance": ""}


async def test_bad_messages_are_answered_and_the_channel_stays(two_drones: tuple[World, Autopilot, Autopilot]) -> None:
    world, kestrel, _ = two_drones
    alice = world.visitor("alice")
    async with live(alice) as browser:
        await next_event(browser, "welcome")
        await browser.send(os.urandom(300))
        assert (await next_event(browser, "notice"))["code"] == "malformed"
        await browser.send('{"type": "watch", "rate_hz": 9999}')
        assert "rate_hz" in (await next_event(browser, "notice"))["text"]
        await browser.send("not json")
        assert (await next_event(browser, "notice"))["code"] == "malformed"
        kestrel.say(statustext("still here"))
        await frames_until(browser, statustext("still here"))


async def test_a_flood_of_nonsense_is_ended(two_drones: tuple[World, Autopilot, Autopilot]) -> None:
    world, _, _ = two_drones
    async with live(world.visitor("alice")) as browser:
        with pytest.raises(ConnectionClosed) as closed:
            async with asyncio.timeout(20):
                while True:
                    await browser.send("nonsense")
                    await browser.recv()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4400


async def test_without_a_session_the_live_channel_says_so(world: World) -> None:
    world.start_tower()
    for headers, code in (
        ({}, 4401),
        ({"Cookie": "tower_session=forged"}, 4401),
        ({"Origin": "https://evil.example"}, 4403),
    ):
        url = world.address.replace("http", "ws") + "/api/v1/live"
        async with connect(url, additional_headers=headers) as socket_:
            with pytest.raises(ConnectionClosed) as closed:
                await asyncio.wait_for(socket_.recv(), 30)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == code


async def test_signing_out_ends_the_live_channel(world: World) -> None:
    world.start_tower()
    alice = world.visitor("alice")
    async with live(alice) as browser:
        await next_event(browser, "welcome")
        assert alice.ask("DELETE", "/session").status == 204
        with pytest.raises(ConnectionClosed) as closed:
            await next_event(browser, "never")
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4401


async def test_take_shuts_the_operator_out_and_give_lets_them_back(
    two_drones: tuple[World, Autopilot, Autopilot],
) -> None:
    world, kestrel, _ = two_drones
    alice, admin = world.visitor("alice"), world.visitor("admin")
    assert alice.ask("POST", "/drones/1/control/acquire").json["epoch"] == 1
    frame = build(
        mavlink.MAVLink_manual_control_message(1, 111, 0, 500, 0, 0), system_id=255, component_id=190, sequence=0
    )
    async with live(alice) as browser:
        await next_event(browser, "welcome")
        taken = admin.ask("POST", "/drones/1/control/take", {"reason": "gusts"})
        assert (taken.json["holder"]["name"], taken.json["epoch"]) == ("admin", 2)
        reported = await next_event(browser, "control")
        assert (reported["event"], reported["by"]["name"], reported["reason"]) == ("taken", "admin", "gusts")
        await browser.send(tag(1, frame))
        assert (await next_event(browser, "notice"))["code"] == "not-in-control"
        assert alice.ask("POST", "/drones/1/control/acquire").status == 409
        offered = admin.ask("POST", "/drones/1/control/give").json
        assert (offered["holder"]["name"], offered["offered"]) == ("admin", True)
        accepted = alice.ask("POST", "/drones/1/control/accept", {"sticks_centred": True})
        assert accepted.json["holder"]["name"] == "alice"
        # The agent lets sticks through again once they were centred; a command needs no centring.
        command = build(
            mavlink.MAVLink_command_long_message(1, 1, 512, 0, *[0.0] * 7), system_id=255, component_id=190, sequence=0
        )
        assert (await next_event(browser, "control"))["event"] == "given"
        assert (await next_event(browser, "control"))["event"] == "accepted"
        await browser.send(tag(1, command))
        wait_for("alice's command at the autopilot", lambda: command in kestrel.listen())
    assert frame not in kestrel.listen()


async def test_datagrams_from_strangers_change_nothing(two_drones: tuple[World, Autopilot, Autopilot]) -> None:
    world, kestrel, _ = two_drones
    found = [line for line in world.log_of("tower-1").splitlines() if "data_channel_open" in line]
    udp_port = json.loads(found[0])["port"]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.settimeout(0.3)
        for length in (0, 1, 13, 14, 30, 31, 64, 1452, 1453, 4000):
            stranger.sendto(os.urandom(length), ("127.0.0.1", udp_port))
            stranger.sendto(struct.pack("<BBIQ", 1, 0, 7, 0) + bytes(length), ("127.0.0.1", udp_port))
        with pytest.raises(TimeoutError):
            stranger.recv(2048)
    async with live(world.visitor("alice")) as browser:
        await next_event(browser, "welcome")
        kestrel.say(statustext("unmoved"))
        await frames_until(browser, statustext("unmoved"))


async def test_a_wrong_key_is_refused(world: World) -> None:
    world.start_tower()
    key = world.enrolled("Kestrel")
    wrong = DroneKey(key.drone_id, bytes(byte ^ 1 for byte in key.seed))
    world.token_file("Kestrel").write_text(f"{wrong}\n")
    world.start_agent("Kestrel", f"udpin:127.0.0.1:{free_udp_ports(1)[0]}")
    wait_for("the agent to say so", lambda: "unknown drone key" in world.log_of("agent-Kestrel"))
    assert not world.visitor("alice").drone(1)["online"]
    assert str(wrong)[-20:] not in world.log_of("agent-Kestrel")


async def test_a_drone_added_while_the_tower_runs_can_sign_in(world: World) -> None:
    world.start_tower()
    drone_id = world.add_drone("Late", "alice")
    world.start_agent("Late", f"udpin:127.0.0.1:{free_udp_ports(1)[0]}")
    world.wait_until_online(world.visitor("alice"), drone_id)


def wait_for_vain_tries(port: int, count: int) -> None:
    """Closes connections from agents until their back-off has reached its maximum."""
    with socket.socket() as door:
        door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        door.settimeout(30)
        door.bind(("127.0.0.1", port))
        door.listen()
        for _ in range(count):
            door.accept()[0].close()


def test_the_agents_are_back_after_a_killed_towers_restart(
    two_drones: tuple[World, Autopilot, Autopilot],
) -> None:
    world, _, _ = two_drones
    alice = world.visitor("alice")
    before = alice.ask("POST", "/drones/1/control/acquire").json
    kill_9(world.tower)
    wait_for_vain_tries(world.port, 10)
    world.start_tower()
    world.wait_until_online(world.visitor("admin"), 1, 2)
    # The earlier session is still valid, and ownership, holder and epoch are unchanged.
    after = alice.drone(1)
    assert {key: after[key] for key in ("owners", "holder", "epoch")} == {
        key: before[key] for key in ("owners", "holder", "epoch")
    }
    assert alice.ask("GET", "/drones/2").status == 404
