"""A pilot on the live channel: a client that reads telemetry and sends commands, and sticks at 50 Hz."""

import asyncio
import contextlib
import json
import time
from collections.abc import AsyncIterator, Callable
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol
from worlds.processes import Visitor

from wire.dialect import build, decode, mavlink
from wire.ids import DroneId
from wire.tagged import split_tagged, stamp, tag

GROUND_STATION: Final = 255
STICKS_EVERY_S: Final = 0.02
ALT_HOLD: Final = 2
GUIDED: Final = 4
LOITER: Final = 5


class Pilot:
    """Watches one drone, and flies it if the tower permits. Use `at_the_controls` or `watching` to get one."""

    def __init__(self, socket: ClientConnection, visitor: Visitor, drone_id: int) -> None:
        self._socket = socket
        self._visitor = visitor
        self._drone_id = DroneId(drone_id)
        self._sequence = 0
        self._sticks: tuple[int, int, int, int] | None = None
        self._sticks_sent = 0
        self.system = 1
        """The MAVLink system that it commands."""
        self.mode = -1
        self.modes: list[int] = []
        """Each mode that the drone has shown, in order: a hold passes its first one within a second."""
        self.armed = False
        self.has_position = False
        self.place_deg = (0.0, 0.0)
        self.altitude_m = 0.0
        self.home_amsl_m = 0.0
        self.climb_mps = 0.0
        self.roll_pitch_rad = (0.0, 0.0)
        self.events: list[dict[str, Any]] = []
        self.acks: list[tuple[int, int]] = []
        self.texts: list[str] = []
        self.heard: set[int] = set()
        """Ids of all messages so far."""
        self.systems: set[int] = set()
        """Ids of all MAVLink systems so far."""
        self.servos: Any = None
        """The newest SERVO_OUTPUT_RAW, which the agent does not ask for."""

    async def ask(self, method: str, path: str, body: Any = None) -> Any:
        """Sends a REST request outside the event loop. Returns the Answer."""
        return await asyncio.to_thread(self._visitor.ask, method, f"/drones/{self._drone_id}{path}", body)

    async def accept_loss_check(self) -> None:
        """Acknowledges what a loss would do, once it is known."""
        await asyncio.to_thread(self._visitor.accept_loss_check, self._drone_id)

    async def say(self, text: str) -> None:
        """Sends a text message over the live channel."""
        await self._socket.send(text)

    async def send(self, message: Any) -> None:
        """Sends one stamped MAVLink message to the drone."""
        self._sequence += 1
        frame = build(message, system_id=GROUND_STATION, component_id=190, sequence=self._sequence)
        await self._socket.send(stamp(int(time.monotonic() * 1000) % 2**32) + tag(self._drone_id, frame))

    async def command(self, number: int, *parameters: float) -> None:
        """Repeats COMMAND_LONG until it is accepted."""
        filled = [*parameters, *[0.0] * (7 - len(parameters))]
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            self.acks.clear()
            await self.send(mavlink.MAVLink_command_long_message(self.system, 1, number, 0, *filled))
            with contextlib.suppress(TimeoutError):
                await self.until(lambda: any(one == number for one, _ in self.acks), f"ACK of {number}", 2.0)
                if (number, mavlink.MAV_RESULT_ACCEPTED) in self.acks:
                    return
            await self._read_loss_check()
            await asyncio.sleep(0.2)
        raise AssertionError(
            f"command {number} was not accepted: {self.acks}, {self.texts[-6:]}, mode {self.mode}, armed {self.armed}, "
            f"{self.altitude_m:.1f} m, {self.events[-8:]}"
        )

    async def _read_loss_check(self) -> None:
        """A drone as it comes is in danger if its computer fails: whoever arms it has read that."""
        check = (await self.ask("GET", "/loss-check")).json
        if check.get("dangerous") and not check["acknowledged"]:
            name = self._visitor.drone(self._drone_id)["name"]
            await self.ask("POST", "/loss-check/acknowledge", {"drone": name})

    async def set_mode(self, mode: int) -> None:
        """Commands a mode and waits until a heartbeat shows it."""
        await self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, mode)
        await self.until(lambda: self.mode == mode, f"mode {mode}")

    async def take_off(self, height_m: float) -> None:
        """Takes off in GUIDED to a height above home. An autopilot is still starting until it knows its position."""
        await self.until(lambda: self.has_position, "a position")
        await self.set_mode(GUIDED)
        await self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        await self.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height_m)
        await self.until(lambda: abs(self.altitude_m - height_m) < 0.5, f"{height_m} m")

    def hold_sticks(self, pitch: int = 0, roll: int = 0, throttle: int = 500, yaw: int = 0) -> None:
        """Sends these sticks at 50 Hz from now on (MANUAL_CONTROL units)."""
        self._sticks = (pitch, roll, throttle, yaw)

    async def centre_sticks(self) -> None:
        """Sends centred sticks from now on. Returns once some were sent, because a mode change could overtake the next
        ones."""
        self.hold_sticks()
        enough = self._sticks_sent + 2
        await self.until(lambda: self._sticks_sent >= enough, "centred sticks to go out")

    def let_go(self) -> None:
        """Stops sending sticks."""
        self._sticks = None

    @property
    def confirmed_holds(self) -> int:
        """Holds that the autopilot has confirmed. Heartbeats show too little: a first stage may end between two."""
        return sum(one["type"] == "hold" and one["step"] == "confirmed" for one in self.events)

    async def until(self, condition: Callable[[], bool], what: str, timeout_s: float = 40.0) -> None:
        """Polls the condition. Raises TimeoutError naming `what`."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline:
                raise TimeoutError(f"{what}: mode {self.mode}, {self.altitude_m:.1f} m, {self.events[-3:]}")
            await asyncio.sleep(0.01)

    async def until_event(self, kind: str, timeout_s: float = 40.0, **fields: Any) -> dict[str, Any]:
        """Returns the first event with these fields, among all received so far."""

        def found() -> dict[str, Any] | None:
            for event in self.events:
                if event["type"] == kind and all(event.get(name) == value for name, value in fields.items()):
                    return event
            return None

        await self.until(lambda: found() is not None, f"{kind} {fields}", timeout_s)
        event = found()
        assert event is not None
        return event

    async def _read(self) -> None:
        async for message in self._socket:
            if isinstance(message, str):
                event = json.loads(message)
                if event["type"] == "ping":
                    await self._socket.send(json.dumps({"type": "pong", "sequence": event["sequence"]}))
                else:
                    self.events.append(event)
                continue
            for drone_id, frame in split_tagged(message):
                if drone_id == self._drone_id:
                    self._see(decode(frame))

    def _see(self, message: Any) -> None:
        kind = message.get_type() if message is not None else ""
        if message is not None:
            self.heard.add(message.get_msgId())
            self.systems.add(message.get_srcSystem())
        if kind == "HEARTBEAT" and message.get_srcComponent() == 1:
            self.mode, self.armed = message.custom_mode, bool(message.base_mode & 128)
            if self.mode not in self.modes[-1:]:
                self.modes.append(self.mode)
        elif kind == "GLOBAL_POSITION_INT":
            self.has_position = message.lat != 0
            self.place_deg = (message.lat / 1e7, message.lon / 1e7)
            self.altitude_m, self.climb_mps = message.relative_alt / 1000, -message.vz / 100
        elif kind == "HOME_POSITION":
            self.home_amsl_m = message.altitude / 1000
        elif kind == "ATTITUDE":
            self.roll_pitch_rad = (message.roll, message.pitch)
        elif kind == "COMMAND_ACK":
            self.acks.append((message.command, message.result))
        elif kind == "SERVO_OUTPUT_RAW":
            self.servos = message
        elif kind == "STATUSTEXT":
            self.texts.append(message.text)

    async def _move_sticks(self) -> None:
        while True:
            if self._sticks is not None:
                await self.send(mavlink.MAVLink_manual_control_message(self.system, *self._sticks, 0))
                self._sticks_sent += 1
            await asyncio.sleep(STICKS_EVERY_S)


@contextlib.asynccontextmanager
async def watching(visitor: Visitor, drone_id: int) -> AsyncIterator[Pilot]:
    """A pilot who is signed in and watches the drone."""
    url = visitor.address.replace("http", "ws") + "/api/v1/live"
    headers = {"Cookie": visitor.cookie, "Origin": visitor.address}
    async with connect(url, subprotocols=[Subprotocol("tower.v1")], additional_headers=headers) as socket:
        pilot = Pilot(socket, visitor, drone_id)
        await socket.send(json.dumps({"type": "focus", "drone_id": drone_id}))
        tasks = [asyncio.create_task(pilot._read()), asyncio.create_task(pilot._move_sticks())]
        try:
            await pilot.until(lambda: bool(pilot.events), "welcome")
            yield pilot
        finally:
            for task in tasks:
                task.cancel()
            for ended in await asyncio.gather(*tasks, return_exceptions=True):
                # A killed tower closes the socket; any other error is a fault of the test.
                if isinstance(ended, Exception) and not isinstance(ended, ConnectionClosed):
                    raise ended


@contextlib.asynccontextmanager
async def at_the_controls(visitor: Visitor, drone_id: int) -> AsyncIterator[Pilot]:
    """As `watching`, and the pilot holds the controls."""
    async with watching(visitor, drone_id) as pilot:
        answer = await pilot.ask("POST", "/control/acquire")
        assert answer.status == 200, answer.body
        yield pilot


async def fly_by_hand(pilot: Pilot, height_m: float = 15.0) -> None:
    """Takes off by command, then flies in LOITER by sticks."""
    await pilot.take_off(height_m)
    pilot.hold_sticks()
    await pilot.set_mode(LOITER)
