"""Random plans through the whole chain and back: REST, tower, agent, autopilot, and the reverse.

Two autopilots, because neither keeps everything: an ArduCopter (home in slot 0, each command packed into a few bytes)
and a PX4. The plans come back as `wire.plan_keeping` predicts; the simulator has its facts from elsewhere.
"""

from __future__ import annotations

import http.client
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from urllib.parse import urlsplit

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from worlds.processes import World, free_udp_ports, wait_for
from worlds.tiers import examples

from simulator.mission_storage import COMMANDS as COPTER_COMMANDS
from simulator.px4.mission_storage import COMMANDS as PX4_COMMANDS
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.autopilots.px4_plans import Px4
from wire.plan_fields import Effect, KeptFields
from wire.plan_keeping import as_kept, changes_ahead, differences
from wire.plans import Plan, PlanItem, PlanKind, plan_from_json, plan_hash, plan_to_json

PLANS_OF_EACH = examples(25, long=250)
MAX_ITEMS_ANY = 8
KEEP_EVERY_S = 2.0
COPTER, PX4 = "Kestrel", "Merlin"
KEEPINGS: dict[str, KeptFields] = {COPTER: ArduPilot(release=(4, 6)), PX4: Px4()}  # 4.6: as tower-sim by default
COMMANDS = {COPTER: COPTER_COMMANDS, PX4: PX4_COMMANDS}
FRAMES = (0, 2, 3, 5, 6, 10, 11)
CORNERS = 4

anything = st.floats(width=32, allow_nan=False, allow_infinity=False)
numbers = st.one_of(st.none(), st.just(0.0), anything, st.integers(-300, 70_000).map(float))
heights = st.one_of(st.floats(-32_000, 32_000, width=32), st.integers(-100_00, 1000_00).map(lambda cm: cm / 100))
latitudes, longitudes = st.integers(-900_000_000, 900_000_000), st.integers(1, 1_800_000_000)
kinds = st.sampled_from([PlanKind.MISSION, PlanKind.MISSION, PlanKind.FENCE, PlanKind.RALLY])


def items(kind: PlanKind, drone: str) -> st.SearchStrategy[PlanItem]:
    """Generates everything that the protocol can express for this kind and this autopilot accepts."""
    command = {PlanKind.MISSION: st.sampled_from(sorted(COMMANDS[drone])), PlanKind.RALLY: st.just(5100)}.get(
        kind, st.sampled_from([5003, 5004])
    )
    params = st.tuples(numbers, numbers, numbers, numbers)
    item = st.builds(
        PlanItem, command, st.sampled_from(FRAMES), params, latitudes, longitudes, heights, st.integers(0, 255)
    )
    return item.map(_jumping_to_the_first).filter(lambda one: _is_taken(kind, one, drone))


def _jumping_to_the_first(item: PlanItem) -> PlanItem:
    """Redirects jumps to the first item: the tower refuses a jump past the end."""
    return item if item.command != 177 else msgspec.structs.replace(item, params=(0.0, *item.params[1:]))


def _is_taken(kind: PlanKind, item: PlanItem, drone: str) -> bool:
    return all(one.effect is not Effect.REFUSED for one in changes_ahead(KEEPINGS[drone], kind, [item]))


@st.composite
def plans(draw: st.DrawFn, *, drone: str) -> tuple[PlanKind, Plan]:
    kind = draw(kinds)
    drawn = draw(st.lists(items(kind, drone), max_size=MAX_ITEMS_ANY))
    if kind is PlanKind.FENCE and draw(st.booleans()):
        ring = PlanItem(draw(st.sampled_from([5001, 5002])), 3, (CORNERS, 0.0, 0.0, 0.0), 473_977_000, 85_456_000)
        drawn += [msgspec.structs.replace(ring, x=ring.x + 900 * n) for n in range(CORNERS)]
    return kind, tuple(drawn)


class Program:
    """A client program: requests on one persistent connection, and REST requests on another that keep the controls."""

    def __init__(self, address: str, cookie: str, drone_id: int) -> None:
        self._netloc = urlsplit(address).netloc
        self._connection = http.client.HTTPConnection(self._netloc, timeout=120)
        self._headers = {"Cookie": cookie, "Content-Type": "application/json"}
        self._over = threading.Event()
        self._keeping = threading.Thread(target=self._keep, args=(f"/drones/{drone_id}/control/keep-alive",))

    def acquire(self, drone_id: int) -> None:
        """Takes control and keeps it from here on."""
        status, said = self._ask(self._connection, "POST", f"/drones/{drone_id}/control/acquire")
        assert status == 200, said
        self._keeping.start()

    def _keep(self, path: str) -> None:
        connection = http.client.HTTPConnection(self._netloc, timeout=120)
        while not self._over.wait(KEEP_EVERY_S):
            self._ask(connection, "POST", path)
        connection.close()

    def ask(self, method: str, path: str, body: bytes | None = None) -> tuple[int, bytes]:
        """Sends a request, and repeats it when the tower limits its rate."""
        until = time.monotonic() + 30.0
        while True:
            status, said = self._ask(self._connection, method, path, body)
            if status != http.HTTPStatus.TOO_MANY_REQUESTS or time.monotonic() > until:
                return status, said
            time.sleep(0.1)

    def _ask(
        self, connection: http.client.HTTPConnection, method: str, path: str, body: bytes | None = None
    ) -> tuple[int, bytes]:
        try:
            connection.request(method, f"/api/v1{path}", body, self._headers)
            answer = connection.getresponse()
        except http.client.RemoteDisconnected:
            # Hypothesis took 5 s to generate a plan, and the tower has just closed the idle connection.
            connection.request(method, f"/api/v1{path}", body, self._headers)
            answer = connection.getresponse()
        return answer.status, answer.read()

    def close(self) -> None:
        self._over.set()
        self._keeping.join()
        self._connection.close()


class PlanAnswer(msgspec.Struct):
    """The response to GET, with the items as raw bytes."""

    items: msgspec.Raw
    hash: str
    count: int


@pytest.fixture(scope="module")
def drones(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[int, Program]]]:
    """Yields by name: the drone's id and the holder's program. (One operator holds one drone.)"""
    with World(tmp_path_factory.mktemp("round-trip")) as world:
        people = {COPTER: "alice", PX4: "bob"}
        for name in people.values():
            world.add_user(name)
        ids = {drone: world.add_drone(drone, owner) for drone, owner in people.items()}
        world.start_tower()
        options = {COPTER: (), PX4: ("--flavour", "px4")}
        for drone, port in zip(people, free_udp_ports(2), strict=True):
            world.start_agent(drone, f"udpin:127.0.0.1:{port}")
            home = ("--home", "47.3977,8.5456,488,0", "--out", f"udp:127.0.0.1:{port}")
            world.start(f"simulator-{drone}", "tower-sim", *home, *options[drone])
        programs = {}
        for drone, owner in people.items():
            visitor = world.visitor(owner)
            wait_for(f"{drone} to be heard", lambda v=visitor, i=ids[drone]: v.drone(i)["autopilot_heard"])  # type: ignore[misc]
            programs[drone] = ids[drone], Program(world.address, visitor.cookie, ids[drone])
            programs[drone][1].acquire(ids[drone])
        yield programs
        for _, program in programs.values():
            program.close()


def goes_up_and_comes_back(drone: str, drone_id: int, program: Program, kind: PlanKind, plan: Plan) -> None:
    """Uploads the plan, then reads it back from the autopilot."""
    status, said = program.ask("PUT", f"/drones/{drone_id}/{kind}", b'{"items":' + plan_to_json(plan) + b"}")
    assert status == 200, said
    operation: dict[str, Any] = msgspec.json.decode(said)
    assert operation["state"] == "done", operation["words"]
    status, said = program.ask("GET", f"/drones/{drone_id}/{kind}?fresh=true")
    assert status == 200, said
    answer = msgspec.json.decode(said, type=PlanAnswer)
    back = plan_from_json(bytes(answer.items))
    assert differences(KEEPINGS[drone], kind, plan, back, exactly=True) == []
    assert (answer.hash, answer.count) == (plan_hash(kind, back), len(plan))
    if drone == COPTER:  # PX4 changes the headings slightly
        assert back == as_kept(KEEPINGS[drone], kind, plan)


@settings(max_examples=PLANS_OF_EACH, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(copters=plans(drone=COPTER), px4s=plans(drone=PX4))
def test_random_plans_come_back_as_their_autopilots_keep_them(
    drones: dict[str, tuple[int, Program]], copters: tuple[PlanKind, Plan], px4s: tuple[PlanKind, Plan]
) -> None:
    """Runs both drones in parallel, because most of the time is waiting."""
    with ThreadPoolExecutor(1) as beside:
        going = beside.submit(goes_up_and_comes_back, COPTER, *drones[COPTER], *copters)
        goes_up_and_comes_back(PX4, *drones[PX4], *px4s)
        going.result()


def test_a_plan_of_649_items_comes_back_byte_for_byte(drones: dict[str, tuple[int, Program]]) -> None:
    plan = tuple(
        PlanItem(16, 3, (float(n), 0.0, 0.0, 0.0), 473_977_000 + n, -85_456_000 - n, float(n % 90)) for n in range(649)
    )
    assert as_kept(ArduPilot(), PlanKind.MISSION, plan) == plan
    goes_up_and_comes_back(COPTER, *drones[COPTER], PlanKind.MISSION, plan)
