"""A real agent core with a model ArduCopter, a tower and a person that come and go. One clock, no I/O."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, Final, NamedTuple

from worlds.model_copter import ModelCopter

from onboard_agent.onboard import Onboard
from wire.content import Frames
from wire.control_messages import (
    ControlChanged,
    HoldOrder,
    HoldProgress,
    SafetySettings,
    ToAgent,
    Welcome,
)
from wire.dialect import build, decode, mavlink
from wire.ids import DroneId, Epoch
from wire.open_holds import OPEN_HOLDS, HoldState, Stay

GROUND_STATION: Final = (255, 190)
AGENT_COMPONENT: Final = 191
HAND_EVERY_S: Final = 0.05


class MemoryHolds:
    """The agent's disk. It survives the agent's process."""

    def __init__(self) -> None:
        self.record: bytes | None = None

    def load(self) -> bytes | None:
        return self.record

    def save(self, record: bytes) -> None:
        self.record = record

    def remove(self) -> None:
        self.record = None

    def close(self) -> None:
        pass


class StickFrame(NamedTuple):
    """Sticks that the agent passed to the autopilot. `buttons` tells the person's sticks from the agent's own."""

    at: float
    x: int
    z: int
    buttons: int


def ground_station(message: Any) -> bytes:
    return build(message, system_id=GROUND_STATION[0], component_id=GROUND_STATION[1], sequence=0)


def sticks(x: int, z: int = 500) -> bytes:
    """Returns a frame of the person's sticks: a button is pressed."""
    return ground_station(mavlink.MAVLink_manual_control_message(1, x, 0, z, 0, 1))


def command(number: int, *parameters: float) -> bytes:
    padded = [*parameters, *([0.0] * (7 - len(parameters)))]
    return ground_station(mavlink.MAVLink_command_long_message(1, 1, number, 0, *padded))


def mode_command(mode: int) -> bytes:
    return command(mavlink.MAV_CMD_DO_SET_MODE, 1, mode)


def go_to() -> bytes:
    return ground_station(mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 1, 0, 0, 1, 2, 3.0))


ARM: Final = command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)


def takeoff(height_m: float) -> bytes:
    return command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height_m)


class HeldCopter:
    """The world that a test drives with `pass_time`, and changes between the calls."""

    def __init__(self, copter: ModelCopter, *, step_s: float = 0.025, knows_s: float = 2.0, **settings: Any) -> None:
        self.copter = copter
        self.step_s = step_s
        self.now = copter.now
        self.settings = SafetySettings(**settings)
        self.store = MemoryHolds()
        self.onboard: Onboard | None = None
        self.linked = False
        """Whether there is a link to the tower. Datagrams arrive only while it lasts."""
        self.stalled_until = self.now
        """Until then the agent gets no processor time, and what the autopilot sends to it waits."""
        self._unread: list[bytes] = []
        self.slow_tower_s = 0.0
        """Delay of the tower's datagrams."""
        self.epoch = 5
        self.hand: tuple[int, int] | None = None
        """Pitch and throttle of the person's sticks, sent at 20 Hz. None: no sticks are sent."""
        self.sticks: list[StickFrame] = []
        self.beats: list[float] = []
        """When the agent sent a ground station's heartbeat."""
        """All stick frames that reached the autopilot, whether from the person or the agent."""
        self.agent_sent: list[Any] = []
        """Messages that the agent sent under its own ids, decoded."""
        self.reported: list[tuple[float, Any]] = []
        """Reports to the tower, with their times."""
        self._orders = self._links = 0
        self._next_hand_at = self.now
        self.begin_agent()
        self.link_up()
        self.pass_time(knows_s)

    # The agent

    def begin_agent(self) -> None:
        """Starts the agent's process with the state that the previous one left."""
        self.onboard = Onboard(now=self.now, speaks_first=False, holds=self.store)

    def kill_agent(self) -> None:
        """Kills the agent at once, and its link."""
        self.onboard = None
        self.linked = False

    def restart_agent(self, *, after_s: float = 1.0) -> None:
        self.kill_agent()
        self.pass_time(after_s)
        self.begin_agent()

    @property
    def agent(self) -> Onboard:
        assert self.onboard is not None
        return self.onboard

    # The tower

    def link_up(
        self, *, holder: str | None = "ada", present: bool = True, takes: tuple[str, ...] = (OPEN_HOLDS,)
    ) -> None:
        self._links += 1
        self.linked = True
        welcome = Welcome(
            drone_id=7,
            name="kestrel",
            link_id=self._links,
            public_key=b"k" * 32,
            udp_port=1,
            epoch=self.epoch,
            holder=holder,
            holder_present=present,
            takes=takes,
        )
        self.agent.welcomed(welcome, self.now)
        self.agent.message(self.settings, self.now)

    def link_down(self) -> None:
        self.linked = False
        if self.onboard is not None:
            self.onboard.link_broken(self.now)

    def message(self, message: ToAgent) -> None:
        if self.linked:
            self.agent.message(message, self.now)
            self._exchange()

    def configure(self, **settings: Any) -> None:
        self.settings = SafetySettings(**settings)
        self.message(self.settings)

    def take(self, *, interrupts: bool = True) -> int:
        """An admin takes control and does nothing. Returns the order's number."""
        self._orders += 1
        self.epoch += 1
        self.hand = None
        self.message(ControlChanged(epoch=self.epoch, holder="root", holder_present=True))
        self.message(HoldOrder(order_id=self._orders, epoch=self.epoch, reason="taken", interrupts=interrupts))
        return self._orders

    def order_again(self) -> int:
        """Repeats the tower's earlier order on a new link."""
        self._orders += 1
        self.message(HoldOrder(order_id=self._orders, epoch=self.epoch, reason="still open", interrupts=False))
        return self._orders

    def stay(self) -> None:
        self.message(Stay(order_id=1, by="ada"))

    def holder_is(self, *, present: bool) -> None:
        self.message(ControlChanged(epoch=self.epoch, holder="ada", holder_present=present))

    def assist(self, *, begins: bool) -> None:
        """Starts or ends an assist: an admin's frames pass and the holder's sticks are refused meanwhile."""
        self.epoch += 1
        self.hand = None
        self.message(ControlChanged(epoch=self.epoch, holder="ada", holder_present=True, assistant_flies=begins))

    def send(self, *frames: bytes, late_s: float = 0.0) -> None:
        """Sends frames from the person who has the controls."""
        if self.linked and self.onboard is not None:
            sent_ms = int((self.now - late_s) * 1000)
            self.onboard.from_tower(Frames(DroneId(7), Epoch(self.epoch), sent_ms, list(frames)), self.now)
            self._exchange()

    # Time

    def pass_time(self, for_s: float) -> None:
        end = self.now + for_s - self.step_s / 2
        while self.now < end:
            self.now += self.step_s
            self.step()

    def pass_until(self, seen: Callable[[], bool], *, within_s: float = 30.0) -> None:
        deadline = self.now + within_s
        while not seen():
            assert self.now < deadline, "it did not come to that"
            self.pass_time(self.step_s)

    def step(self) -> None:
        said = self.copter.step(self.now)
        agent = self.onboard
        if agent is None:
            self._unread.clear()
            return
        if self.now < self.stalled_until:
            self._unread += said
            return
        if self._unread:
            agent.tick(self.now)  # its clock may be ahead of what it has read
            self._exchange()
            said, self._unread = [*self._unread, *said], []
        if said:
            agent.from_autopilot(said, self.now)
        if self.linked:
            agent.tower_heard(self.now)
            agent.round_trip(0.02)
            if self.hand is not None and self.now >= self._next_hand_at:
                self._next_hand_at = self.now + HAND_EVERY_S
                self.send(sticks(*self.hand), late_s=self.slow_tower_s)
        agent.tick(self.now)
        self._exchange()

    def _exchange(self) -> None:
        agent = self.onboard
        if agent is None:
            return
        frames = agent.frames_to_autopilot()
        for frame in frames:
            message = decode(frame)
            if message is None:
                continue
            if message.get_type() == "MANUAL_CONTROL":
                self.sticks.append(StickFrame(self.now, message.x, message.z, message.buttons))
            elif message.get_type() == "HEARTBEAT" and message.type == mavlink.MAV_TYPE_GCS:
                self.beats.append(self.now)
            elif message.get_srcComponent() == AGENT_COMPONENT:
                self.agent_sent.append(message)
        self.copter.receive(frames)
        self.reported += [(self.now, message) for message in agent.messages_to_tower(self.now)]

    # Observations

    @property
    def state(self) -> HoldState:
        """The newest state reported to the tower."""
        return self.states()[-1][1]

    def states(self) -> list[tuple[float, HoldState]]:
        return [(at, one) for at, one in self.reported if isinstance(one, HoldState)]

    def steps(self) -> list[str]:
        return [str(one.step) for _, one in self.reported if isinstance(one, HoldProgress)]

    def progress(self) -> list[HoldProgress]:
        return [one for _, one in self.reported if isinstance(one, HoldProgress)]

    def modes_asked(self) -> list[int]:
        """Returns the modes that the agent has commanded since the last call."""
        asked = [int(one.param2) for one in self.agent_sent if getattr(one, "command", 0) == 176]
        self.agent_sent.clear()
        return asked

    def sticks_since(self, at: float) -> list[StickFrame]:
        return [one for one in self.sticks if one.at >= at]

    def longest_gap_s(self, since: float, until: float | None = None) -> float:
        """Returns the longest gap between two stick frames, from the person or the agent."""
        end = self.now if until is None else until
        times = [since, *(one.at for one in self.sticks if since <= one.at <= end), end]
        return max(later - earlier for earlier, later in pairwise(times))
