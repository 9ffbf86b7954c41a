"""Random plans through the whole chain and back, byte for byte: REST, tower, agent, autopilot, and the same way home.

Two autopilots, for none keeps everything. One stores as ArduCopter does (home in slot 0, each command packed into a few
bytes) and is sent what fits into that; the other is a PX4, which keeps every bit, NaN too, and is sent anything.
"""

from __future__ import annotations

import contextlib
import http.client
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any
from urllib.parse import urlsplit

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol
from worlds.processes import World, free_udp_ports, wait_for

from simulator.mission_items import COMMANDS, FENCE_COMMANDS, FRAMES, RALLY_COMMANDS
from simulator.mission_plan import Item
from simulator.mission_plan import PlanKind as StoredKind
from simulator.mission_storage import packed
from wire.plans import Plan, PlanItem, PlanKind, plan_hash, plan_to_json

PLANS_OF_EACH = 250
ITEMS_MOST = 8
COPTER, PX4 = "Kestrel", "Merlin"
JUMP = 177
STORED: dict[PlanKind, StoredKind] = {
    PlanKind.MISSION: StoredKind.MISSION,
    PlanKind.FENCE: StoredKind.FENCE,
    PlanKind.RALLY: StoredKind.RALLY,
}
KNOWN = {
    PlanKind.MISSION: sorted(COMMANDS),
    PlanKind.FENCE: sorted(FENCE_COMMANDS),
    PlanKind.RALLY: sorted(RALLY_COMMANDS),
}

anything = st.floats(width=32, allow_nan=False, allow_infinity=False)
numbers = st.one_of(st.none(), anything, st.integers(-300, 70_000).map(float))
heights = st.one_of(st.floats(-50_000, 50_000, width=32), st.integers(-100_00, 1000_00).map(lambda cm: cm / 100))
kinds = st.sampled_from([PlanKind.MISSION, PlanKind.MISSION, PlanKind.FENCE, PlanKind.RALLY])


def items(kind: PlanKind) -> st.SearchStrategy[PlanItem]:
    """Whatever the protocol can say of this kind, and no autopilot refuses."""
    return st.builds(
        PlanItem,
        st.sampled_from(KNOWN[kind]),
        st.sampled_from(sorted(FRAMES)),
        st.tuples(numbers, numbers, numbers, numbers),
        st.integers(-900_000_000, 900_000_000),
        st.integers(-1_800_000_000, 1_800_000_000),
        heights,
        st.integers(0, 255),
    )


def as_copter_keeps(item: PlanItem, kind: PlanKind) -> PlanItem | None:
    """What is left of it in the end, or None where that changes each time. Jumps count home, which is one of the items
    there."""
    moved = 1.0 if item.command == JUMP else 0.0
    first, *others = (0.0 if value is None else value for value in item.params)
    if moved and abs(first) > 60_000:
        return None
    stored = Item(item.command, item.frame, (first + moved, *others), item.x, item.y, item.z, item.autocontinue)  # type: ignore[arg-type]
    kept = packed(packed(stored, STORED[kind]), STORED[kind])
    if kept != packed(kept, STORED[kind]):
        return None
    kept = replace(kept, params=(kept.params[0] - moved, *kept.params[1:]))
    return PlanItem(kept.command, int(kept.frame), kept.params, kept.x, kept.y, kept.z, kept.autocontinue)


@st.composite
def plans(draw: st.DrawFn, *, of_copter: bool) -> tuple[PlanKind, Plan]:
    kind = draw(kinds)
    one = items(kind)
    if of_copter:
        one = one.map(lambda item: as_copter_keeps(item, kind)).filter(lambda item: item is not None)  # type: ignore[arg-type, return-value]
    return kind, tuple(draw(st.lists(one, max_size=ITEMS_MOST)))


class Program:
    """Somebody's program: requests on one connection that stays open, and a live channel, without which the controls
    are not kept."""

    def __init__(self, address: str, cookie: str) -> None:
        self._connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=120)
        self._headers = {"Cookie": cookie, "Content-Type": "application/json"}
        live = address.replace("http", "ws", 1) + "/api/v1/live"
        headers = {"Cookie": cookie, "Origin": address}
        self._open = contextlib.ExitStack()
        # No pings of the client: they take random numbers, which hypothesis does not let pass beside its own.
        self._live = self._open.enter_context(
            connect(
                live,
                subprotocols=[Subprotocol("tower.v1")],
                additional_headers=headers,
                proxy=None,
                ping_interval=None,
            )
        )
        self._listening = threading.Thread(target=self._listen)
        self._listening.start()

    def _listen(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                self._live.recv()

    def ask(self, method: str, path: str, body: bytes | None = None) -> tuple[int, bytes]:
        """Whoever asks for too much in too short a time is told so, and asks again."""
        until = time.monotonic() + 30.0
        while True:
            self._connection.request(method, f"/api/v1{path}", body, self._headers)
            answer = self._connection.getresponse()
            said = answer.read()
            if answer.status != http.HTTPStatus.TOO_MANY_REQUESTS or time.monotonic() > until:
                return answer.status, said
            time.sleep(0.1)

    def close(self) -> None:
        self._connection.close()
        self._open.close()
        self._listening.join()


class PlanAnswer(msgspec.Struct):
    """What GET says, with the items as the bytes that they came in."""

    items: msgspec.Raw
    hash: str
    count: int


@pytest.fixture(scope="module")
def drones(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[int, Program]]]:
    """By name: the id, and the program of whoever has the controls. (One operator holds one drone.)"""
    with World(tmp_path_factory.mktemp("round-trip")) as world:
        people = {COPTER: "alice", PX4: "bob"}
        for name in people.values():
            world.add_user(name)
        ids = {drone: world.add_drone(drone, owner) for drone, owner in people.items()}
        world.start_tower()
        options = {COPTER: ("--fail", "mission-packed"), PX4: ("--flavour", "px4")}
        for drone, port in zip(people, free_udp_ports(2), strict=True):
            world.start_agent(drone, f"udpin:127.0.0.1:{port}")
            home = ("--home", "47.3977,8.5456,488,0", "--out", f"udp:127.0.0.1:{port}")
            world.start(f"simulator-{drone}", "tower-sim", *home, *options[drone])
        programs = {}
        for drone, owner in people.items():
            visitor = world.visitor(owner)
            wait_for(f"{drone} to be heard", lambda v=visitor, i=ids[drone]: v.drone(i)["autopilot_heard"])  # type: ignore[misc]
            programs[drone] = ids[drone], Program(world.address, visitor.cookie)
            assert visitor.ask("POST", f"/drones/{ids[drone]}/control/acquire").status == 200
        yield programs
        for _, program in programs.values():
            program.close()


def goes_up_and_comes_back(drone_id: int, program: Program, kind: PlanKind, plan: Plan) -> None:
    """Put on board, then read from the autopilot anew."""
    sent = plan_to_json(plan)
    status, said = program.ask("PUT", f"/drones/{drone_id}/{kind}", b'{"items":' + sent + b"}")
    assert status == 200, said
    operation: dict[str, Any] = msgspec.json.decode(said)
    assert operation["state"] == "done", operation["words"]
    status, said = program.ask("GET", f"/drones/{drone_id}/{kind}?fresh=true")
    assert status == 200, said
    answer = msgspec.json.decode(said, type=PlanAnswer)
    assert bytes(answer.items) == sent
    assert (answer.hash, answer.count) == (plan_hash(kind, plan), len(plan))


@settings(max_examples=PLANS_OF_EACH, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(kept=plans(of_copter=True), anything_=plans(of_copter=False))
def test_500_plans_come_back_byte_for_byte(
    drones: dict[str, tuple[int, Program]], kept: tuple[PlanKind, Plan], anything_: tuple[PlanKind, Plan]
) -> None:
    """Both drones at the same time: most of it is waiting."""
    with ThreadPoolExecutor(1) as beside:
        going = beside.submit(goes_up_and_comes_back, *drones[COPTER], *kept)
        goes_up_and_comes_back(*drones[PX4], *anything_)
        going.result()


def test_a_plan_of_700_items_comes_back_byte_for_byte(drones: dict[str, tuple[int, Program]]) -> None:
    plan = tuple(
        PlanItem(16, 3, (float(n), 0.0, 0.0, 0.0), 473_977_000 + n, -85_456_000 - n, float(n % 90)) for n in range(700)
    )
    goes_up_and_comes_back(*drones[COPTER], PlanKind.MISSION, plan)
