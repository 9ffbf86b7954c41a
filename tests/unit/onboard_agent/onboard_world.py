"""An agent with a fake autopilot and a fake tower, in simulated time."""

from typing import Any

from onboard_agent.failsafe.hold_memory import HoldStore
from onboard_agent.onboard import Onboard
from wire.content import Frames
from wire.control_messages import (
    HoldCause,
    HoldOrder,
    HoldProgress,
    SafetySettings,
    Welcome,
)
from wire.dialect import build, decode, mavlink
from wire.ids import DroneId, Epoch
from wire.open_holds import OPEN_HOLDS

STEP_S = 0.025

LOITER, RTL, ALT_HOLD, BRAKE, STABILIZE = 5, 6, 2, 17, 0


def frame(message: Any, *, system_id: int = 1, component_id: int = 1) -> bytes:
    return build(message, system_id=system_id, component_id=component_id, sequence=0)


def sticks(x: int) -> bytes:
    return frame(mavlink.MAVLink_manual_control_message(1, x, 0, 500, 0, 0), system_id=255, component_id=190)


def set_mode(mode: int) -> bytes:
    message = mavlink.MAVLink_command_long_message(1, 1, 176, 0, 1, mode, 0, 0, 0, 0, 0)
    return frame(message, system_id=255, component_id=190)


class World:
    """A linked Onboard with an armed copter in LOITER, and a clock that the test advances.

    `receiver`: whether a radio receiver is on board; None if the autopilot does not report it. `vehicle`: MAV_AUTOPILOT
    and MAV_TYPE. `holds`: what an earlier process left. `answers`: it tells the time when it is asked.
    """

    def __init__(
        self,
        *,
        armed: bool = True,
        mode: int = LOITER,
        heard: bool = True,
        receiver: bool | None = None,
        vehicle: tuple[int, int] = (mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_QUADROTOR),
        holds: HoldStore | None = None,
        answers: bool = True,
    ) -> None:
        self.now = 50.0
        self.answers = answers
        self.vehicle = vehicle
        self.onboard = Onboard(now=self.now, speaks_first=False, holds=holds)
        self.armed, self.mode, self.heard = armed, mode, heard
        self.tower_there = True
        self.beats = True
        self.sent: list[bytes] = []
        self.reported: list[Any] = []
        self.link_up()
        self.pass_time(0.2)
        if receiver is not None:
            self.say_receiver(receiver)
        self.sent.clear()

    def say_receiver(self, receiver: bool) -> None:
        values = (1500, 1500, 1000, 1500) if receiver else (0, 0, 0, 0)
        count = 16 if receiver else 0
        message = mavlink.MAVLink_rc_channels_message(0, count, *values, *([0] * 14), 255)
        self.onboard.from_autopilot([frame(message)], self.now)

    def link_up(self, epoch: int = 5) -> None:
        welcome = Welcome(
            drone_id=7,
            name="kestrel",
            link_id=1,
            public_key=b"k" * 32,
            udp_port=1,
            epoch=epoch,
            holder="ada",
            takes=(OPEN_HOLDS,),
        )
        self.onboard.welcomed(welcome, self.now)

    def beat(self) -> None:
        autopilot, kind = self.vehicle
        message = mavlink.MAVLink_heartbeat_message(kind, autopilot, 0x81 if self.armed else 1, self.mode, 4, 3)
        self.onboard.from_autopilot([frame(message)], self.now)

    def pass_time(self, for_s: float) -> None:
        end = self.now + for_s
        while self.now < end:
            if self.heard and self.beats:
                self.beat()
            if self.tower_there:
                self.onboard.tower_heard(self.now)
            self.onboard.tick(self.now)
            self.collect()
            self.now += STEP_S

    def collect(self) -> None:
        frames = self.onboard.frames_to_autopilot()
        self.sent += frames
        for message in map(decode, frames) if self.answers and self.heard else ():
            if message is not None and message.get_type() == "TIMESYNC":
                answer = mavlink.MAVLink_timesync_message(int(self.now * 1e9), message.ts1)
                self.onboard.from_autopilot([frame(answer)], self.now)
        self.reported += self.onboard.messages_to_tower(self.now)

    def tower_sends(self, *frames: bytes, epoch: int = 5) -> None:
        self.onboard.from_tower(Frames(DroneId(7), Epoch(epoch), int(self.now * 1000), list(frames)), self.now)
        self.collect()

    def ack(self, command: int, *, target: tuple[int, int] = (1, 191), result: int = 0) -> None:
        message = mavlink.MAVLink_command_ack_message(command, result, 0, 0, *target)
        self.onboard.from_autopilot([frame(message)], self.now)
        self.collect()

    def stream(self, for_s: float, x: int = 300, *, epoch: int = 5) -> None:
        """Sends sticks at 40 Hz, as a browser does."""
        end = self.now + for_s
        while self.now < end:
            self.tower_sends(sticks(x), epoch=epoch)
            self.pass_time(STEP_S / 2)

    def configure(self, **settings: Any) -> None:
        self.onboard.message(SafetySettings(**settings), self.now)

    def climb_to(self, alt_rel_m: float) -> None:
        alt_rel_mm = int(alt_rel_m * 1000)
        message = mavlink.MAVLink_global_position_int_message(int(self.now * 1000), 0, 0, 0, alt_rel_mm, 0, 0, 0, 0)
        self.onboard.from_autopilot([frame(message)], self.now)

    def modes_asked(self) -> list[int]:
        return [int(m.param2) for m in self.messages("COMMAND_LONG") if m.command == 176]

    def causes(self) -> set[HoldCause]:
        return {message.cause for message in self.reported if isinstance(message, HoldProgress)}

    def steps(self) -> list[str]:
        return [str(message.step) for message in self.reported if isinstance(message, HoldProgress)]

    def messages(self, *kinds: str) -> list[Any]:
        found = [m for m in map(decode, self.sent) if m is not None and m.get_type() in kinds]
        self.sent.clear()
        return found


def order(order_id: int = 1, epoch: int = 6) -> HoldOrder:
    return HoldOrder(order_id=order_id, epoch=epoch, reason="taken")
