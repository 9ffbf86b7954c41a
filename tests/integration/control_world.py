"""An agent that obeys every hold, placed straight into the hub of a running tower, and helpers for requests."""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Collection
from contextlib import asynccontextmanager
from typing import Any

import httpx
from tower_world import TowerWorld
from websockets.asyncio.client import ClientConnection, connect

from server.link.api.link_ticket import new_ticket
from server.link.core.agent_link import AgentLink
from server.live.hub import Hub
from wire.control_messages import AutopilotState, HoldOrder, HoldProgress, HoldStep, LossParameters, ToAgent
from wire.ids import DroneId, LinkId
from wire.keepalive import PING_INTERVAL_S
from wire.sealed_link import SealedLink
from wire.sealing import read_link_id

DEADLINE_S = 30.0
UNDECIDED = "the database has not confirmed it yet"


async def ask(client: httpx.AsyncClient, drone_id: int, what: str, **body: Any) -> httpx.Response:
    return await client.post(f"/api/v1/drones/{drone_id}/control/{what}", json=body)


async def audit(admin: httpx.AsyncClient, prefix: str) -> list[dict[str, Any]]:
    """Returns audit rows, newest first."""
    events = (await admin.get("/api/v1/audit?limit=500")).json()
    return [event for event in events if event["action"].startswith(prefix)]


async def until(what: str, condition: Callable[[], Any]) -> None:
    deadline = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline, f"{what} did not come to pass"
        await asyncio.sleep(0.01)


class ObedientAgent:
    """Confirms each hold at once. `posted` holds all messages from the tower."""

    def __init__(
        self, hub: Hub, drone_id: int, *, answer: HoldStep | None = HoldStep.CONFIRMED, takes: Collection[str] = ()
    ) -> None:
        self._hub = hub
        self.answer = answer
        self.posted: list[ToAgent] = []
        now = time.monotonic()
        self.link = AgentLink(
            sealed=_sealed(drone_id, send=b"t" * 32, receive=b"a" * 32, now=now),
            send_datagram=lambda datagram, address: None,
            post=self._post,
            close=lambda code, why: None,
            call_later=lambda delay_s, call: None,
            takes=takes,
            ticket=new_ticket(LinkId(7000 + drone_id)),
        )
        self._sealed = _sealed(drone_id, send=b"a" * 32, receive=b"t" * 32, now=now)
        self._speaking: asyncio.Task[None] | None = None
        hub.attach_link(self.link, now)

    def state(self, *, armed: bool = False, airborne: bool = False) -> None:
        """Reports the drone's state, and keeps the drone online: a link that is silent for 3 s counts as offline."""
        self._speak()
        if self._speaking is None:
            self._speaking = asyncio.create_task(self._go_on_speaking())
        self._hub.reports.receive(self.link, AutopilotState(heard=True, armed=armed, airborne=airborne))

    def fall_silent(self) -> None:
        """From now on nothing is heard of it."""
        if self._speaking is not None:
            self._speaking.cancel()

    def parameters(self, *, has_radio: bool | None = True, complete: bool = True, **values: float) -> None:
        """Of a drone that is set up for a failure of its computer, unless `values` say otherwise."""
        values = {"FS_GCS_ENABLE": 1.0, **values}
        reported = LossParameters(autopilot="ardupilot", values=values, complete=complete, has_radio=has_radio)
        self._hub.reports.receive(self.link, reported)

    def _speak(self) -> None:
        for datagram in self._sealed.datagrams_to_send(time.monotonic()):
            self._hub.datagram(datagram, read_link_id(datagram), ("203.0.113.1", 5), time.monotonic())

    async def _go_on_speaking(self) -> None:
        while (drone := self._hub.state.drones.get(self.link.drone_id)) is not None and drone.link is self.link:
            self._speak()
            await asyncio.sleep(PING_INTERVAL_S)

    @property
    def holds(self) -> list[HoldOrder]:
        return [message for message in self.posted if isinstance(message, HoldOrder)]

    @property
    def decided_holds(self) -> list[HoldOrder]:
        """Without those that a slow database adds: after 0.1 s the tower orders a hold before it has the decision."""
        return [order for order in self.holds if UNDECIDED not in order.reason]

    def _post(self, message: ToAgent) -> None:
        self.posted.append(message)
        if isinstance(message, HoldOrder) and self.answer is not None:
            asyncio.get_running_loop().call_soon(self._report, message, self.answer)

    def _report(self, order: HoldOrder, step: HoldStep) -> None:
        progress = HoldProgress(
            order_id=order.order_id, epoch=order.epoch, step=step, detail="ALT_HOLD", elapsed_ms=4.5
        )
        self._hub.reports.receive(self.link, progress)


def _sealed(drone_id: int, *, send: bytes, receive: bytes, now: float) -> SealedLink:
    return SealedLink(
        link_id=LinkId(7000 + drone_id), drone_id=DroneId(drone_id), send_key=send, receive_key=receive, now=now
    )


class Live:
    """A browser's WebSocket, with the received events and a wait for one."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.events: list[dict[str, Any]] = []

    async def event(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Returns the next event of this kind with these fields, including one that was already received."""
        async with asyncio.timeout(DEADLINE_S):
            while True:
                for number, event in enumerate(self.events):
                    if event["type"] == kind and fields.items() <= event.items():
                        return self.events.pop(number)
                message = await self.socket.recv()
                if isinstance(message, str):
                    self.events.append(json.loads(message))


@asynccontextmanager
async def live(world: TowerWorld, client: httpx.AsyncClient) -> AsyncIterator[Live]:
    headers = world.cookie_header(client) | {"Origin": world.base_url}
    # Unread events must not keep it from closing: with a bounded queue that takes 10 s.
    options: dict[str, Any] = {"additional_headers": headers, "subprotocols": ["tower.v1"], "max_queue": None}
    async with connect(world.live_url, proxy=None, **options) as socket:
        opened = Live(socket)
        await opened.event("welcome")
        yield opened
