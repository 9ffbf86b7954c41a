"""The decisions together: what happens to frames, orders and heartbeats that meet."""

from typing import Any

from onboard_agent.autopilot.parameters import LOSS_NAMES
from onboard_agent.link.tower_news import PROGRESS_KEPT
from onboard_agent.onboard import Onboard
from wire.content import Frames
from wire.control_messages import (
    AutopilotState,
    ControlChanged,
    HoldCause,
    HoldOrder,
    HoldProgress,
    LossParameters,
    SafetySettings,
    Welcome,
)
from wire.dialect import build, decode, mavlink
from wire.frames import message_id
from wire.ids import DroneId, Epoch
from wire.open_holds import LostAction

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
    """An Onboard that is linked, with an armed copter in LOITER, and a clock that is wound by hand.

    `receiver`: whether a radio receiver is on board; None where the autopilot does not say.
    """

    def __init__(
        self, *, armed: bool = True, mode: int = LOITER, heard: bool = True, receiver: bool | None = None
    ) -> None:
        self.now = 50.0
        self.onboard = Onboard(now=self.now, speaks_first=False)
        self.armed, self.mode, self.heard = armed, mode, heard
        self.tower_there = True
        self.beats = True
        self.sent: list[bytes] = []
        self.told: list[Any] = []
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
            drone_id=7, name="kestrel", link_id=1, public_key=b"k" * 32, udp_port=1, epoch=epoch, holder="ada"
        )
        self.onboard.welcomed(welcome, self.now)

    def beat(self) -> None:
        message = mavlink.MAVLink_heartbeat_message(2, 3, 0x81 if self.armed else 1, self.mode, 4, 3)
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
        self.sent += self.onboard.take_to_autopilot()
        self.told += self.onboard.take_to_tower(self.now)

    def tower_sends(self, *frames: bytes, epoch: int = 5) -> None:
        self.onboard.from_tower(Frames(DroneId(7), Epoch(epoch), int(self.now * 1000), list(frames)), self.now)
        self.collect()

    def ack(self, command: int, *, target: tuple[int, int] = (1, 191), result: int = 0) -> None:
        message = mavlink.MAVLink_command_ack_message(command, result, 0, 0, *target)
        self.onboard.from_autopilot([frame(message)], self.now)
        self.collect()

    def stream(self, for_s: float, x: int = 300, *, epoch: int = 5) -> None:
        """Sticks at 40 Hz, as a browser sends them."""
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
        return {message.cause for message in self.told if isinstance(message, HoldProgress)}

    def steps(self) -> list[str]:
        return [str(message.step) for message in self.told if isinstance(message, HoldProgress)]

    def messages(self, *kinds: str) -> list[Any]:
        found = [m for m in map(decode, self.sent) if m is not None and m.get_type() in kinds]
        self.sent.clear()
        return found


def order(order_id: int = 1, epoch: int = 6) -> HoldOrder:
    return HoldOrder(order_id=order_id, epoch=epoch, reason="taken")


def test_an_order_fences_centres_and_confirms() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.tower_sends(sticks(900), epoch=5)
    assert sticks(900) not in world.sent
    world.ack(176)
    world.mode = ALT_HOLD
    world.pass_time(0.1)
    assert world.steps() == ["sticks_centred", "mode_requested", "mode_acknowledged", "confirmed"]


def test_the_answer_to_somebody_elses_mode_change_does_not_count() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.ack(176, target=(255, 190))
    assert "mode_acknowledged" not in world.steps()
    world.ack(176, target=(0, 0))
    assert "mode_acknowledged" in world.steps()


def test_a_gimbals_heartbeat_does_not_confirm() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.ack(176)
    gimbal = frame(mavlink.MAVLink_heartbeat_message(26, 3, 0x81, ALT_HOLD, 4, 3), component_id=154)
    world.onboard.from_autopilot([gimbal], world.now)
    world.collect()
    assert "confirmed" not in world.steps()


def test_a_tower_that_was_restarted_may_count_its_orders_from_one_again() -> None:
    world = World()
    world.onboard.message(order(order_id=1, epoch=6), world.now)
    world.pass_time(0.1)
    world.link_up(epoch=6)
    world.onboard.message(order(order_id=1, epoch=7), world.now)
    world.pass_time(0.1)
    assert world.steps() == ["sticks_centred", "mode_requested"] * 2


def test_a_hold_that_a_fence_forbids_says_so() -> None:
    fence = mavlink.MAV_SYS_STATUS_GEOFENCE
    for healthy, said in ((0, True), (fence, False)):
        world = World()
        status = mavlink.MAVLink_sys_status_message(fence, fence, healthy, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
        world.onboard.from_autopilot([frame(status)], world.now)
        world.onboard.message(order(), world.now)
        world.pass_time(0.1)
        world.ack(176, result=mavlink.MAV_RESULT_FAILED)
        world.pass_time(3.2)
        (unconfirmed,) = [one for one in world.told if isinstance(one, HoldProgress) and one.step == "unconfirmed"]
        assert ("outside its fence" in unconfirmed.detail) is said
        assert "refuses ALT_HOLD" in unconfirmed.detail


def test_uncentred_sticks_wait_and_centred_ones_take_over() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.sent.clear()
    world.tower_sends(sticks(700), epoch=6)
    assert world.sent == []
    world.tower_sends(sticks(10), sticks(700), epoch=6)
    assert world.sent == [sticks(10), sticks(700)]
    world.sent.clear()
    world.pass_time(0.5)
    assert not world.messages("MANUAL_CONTROL")
    assert world.onboard.counts["sticks not centred after a hold"] == 1


def test_the_gate_stays_shut_for_as_long_as_it_takes() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(60.0)
    world.sent.clear()
    world.tower_sends(sticks(700), epoch=6)
    assert sticks(700) not in world.sent


def test_a_command_of_the_new_holder_takes_over() -> None:
    world = World(receiver=True)
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.tower_sends(set_mode(RTL), epoch=6)
    assert set_mode(RTL) in world.sent
    world.mode = RTL
    world.sent.clear()
    world.pass_time(1.0)
    assert {message_id(f) for f in world.sent} <= {0, 20, mavlink.MAVLINK_MSG_ID_COMMAND_LONG}
    assert not [m for m in world.messages("COMMAND_LONG") if m.command == 176]


def test_a_command_of_the_old_holder_does_not() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.tower_sends(set_mode(RTL), epoch=5)
    world.sent.clear()
    world.pass_time(0.5)
    assert world.messages("MANUAL_CONTROL")


def test_losing_the_tower_in_the_hand_holds() -> None:
    world = World()
    world.configure(sticks_stale_s=10.0)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.onboard.link_broken(world.now)
    world.tower_there = False
    world.pass_time(1.9)
    assert not world.messages("MANUAL_CONTROL")
    world.pass_time(0.15)
    assert world.messages("MANUAL_CONTROL")
    assert world.steps() == [], "there is nobody to tell yet"
    world.link_up()
    world.pass_time(0.1)
    assert world.steps()[:3] == ["ordered", "sticks_centred", "mode_requested"]
    assert world.causes() == {HoldCause.PILOT_LOST}


def test_losing_the_holder_while_the_tower_lives_holds_too() -> None:
    world = World()
    world.configure(sticks_stale_s=10.0)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=False), world.now)
    world.pass_time(1.9)
    assert not world.messages("MANUAL_CONTROL")
    world.pass_time(0.15)
    assert world.messages("MANUAL_CONTROL")


def test_a_holder_who_is_back_in_time_flies_on() -> None:
    world = World()
    world.configure(sticks_stale_s=10.0)
    world.tower_sends(sticks(300))
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=False), world.now)
    world.pass_time(1.0)
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=True), world.now)
    world.tower_sends(sticks(300))
    world.sent.clear()
    world.pass_time(3.0)
    assert not world.messages("MANUAL_CONTROL")


def test_sticks_that_stop_hold_and_want_to_be_centred_again() -> None:
    world = World()
    world.stream(1.0)
    world.messages("MANUAL_CONTROL")
    world.pass_time(0.45)
    assert not world.messages("MANUAL_CONTROL")
    world.pass_time(0.1)
    assert {m.x for m in world.messages("MANUAL_CONTROL")} == {0}
    assert world.steps() == ["ordered", "sticks_centred", "mode_requested"]
    assert world.causes() == {HoldCause.STICKS_STALE}
    world.tower_sends(sticks(300))
    assert sticks(300) not in world.sent
    world.tower_sends(sticks(0), sticks(300))
    assert sticks(300) in world.sent


def test_sticks_that_stop_in_a_mode_without_sticks_are_nothing() -> None:
    world = World(receiver=True)
    world.stream(1.0)
    world.tower_sends(set_mode(RTL))
    world.mode = RTL
    world.messages("MANUAL_CONTROL")
    world.pass_time(3.0)
    assert not world.messages("MANUAL_CONTROL")


def test_late_sticks_are_discarded_and_are_not_fresh() -> None:
    world = World()
    world.stream(1.0)
    world.sent.clear()
    for n in range(40):
        late_by_a_second = Frames(DroneId(7), Epoch(5), int((world.now - 1.0) * 1000), [sticks(700)])
        world.onboard.from_tower(late_by_a_second, world.now)
        world.pass_time(STEP_S)
        assert sticks(700) not in world.sent, n
    assert world.causes() == {HoldCause.STICKS_STALE}
    assert world.onboard.counts["sticks too late"] == 40


def test_a_late_command_is_never_executed() -> None:
    world = World()
    world.tower_sends(sticks(0))
    late = Frames(DroneId(7), Epoch(5), int((world.now - 2.5) * 1000), [set_mode(RTL)])
    world.onboard.from_tower(late, world.now)
    world.collect()
    assert set_mode(RTL) not in world.sent
    assert world.onboard.counts["command too late"] == 1
    world.link_up()
    world.onboard.from_tower(late, world.now)
    world.collect()
    assert set_mode(RTL) in world.sent, "another link, another clock"


def test_the_ladder_is_the_towers_and_outlives_the_link() -> None:
    world = World(mode=0)
    world.configure(hold_ladder=("BRAKE", "AUTO.LOITER"))
    world.onboard.link_broken(world.now)
    world.link_up()
    world.onboard.message(order(), world.now)
    world.onboard.tick(world.now)
    world.collect()
    assert world.modes_asked() == [17]
    refused = mavlink.MAVLink_command_ack_message(176, mavlink.MAV_RESULT_FAILED, 0, 0, 1, 191)
    world.onboard.from_autopilot([frame(refused)], world.now)
    world.collect()
    assert world.modes_asked() == [ALT_HOLD], "in the call that brought the refusal"


def test_an_epoch_without_an_order_fences_and_leaves_the_gate_as_it_is() -> None:
    world = World()
    world.stream(0.2)
    world.onboard.message(ControlChanged(epoch=6, holder="ada", holder_present=True), world.now)
    world.sent.clear()
    world.tower_sends(sticks(301), epoch=5)
    world.tower_sends(sticks(302), epoch=6)
    assert world.sent == [sticks(302)]
    assert world.steps() == []


def flown_in_the_air(mode: int = LOITER) -> World:
    world = World(mode=mode)
    world.climb_to(20.0)
    world.stream(1.0)
    return world


def lose_the_tower(world: World) -> None:
    world.onboard.link_broken(world.now)
    world.tower_there = False


def test_a_tower_that_stays_lost_brings_the_drone_home() -> None:
    world = flown_in_the_air()
    lose_the_tower(world)
    world.pass_time(1.0)
    world.ack(176)
    world.mode = ALT_HOLD
    world.pass_time(28.5)
    assert RTL not in world.modes_asked()
    world.pass_time(1.0)
    assert world.modes_asked()[0] == RTL
    world.ack(176)
    world.mode = RTL
    world.pass_time(5.0)
    world.sent.clear()
    world.pass_time(5.0)
    assert world.modes_asked() == []
    assert not world.messages("MANUAL_CONTROL"), "the centred sticks have ended"
    world.tower_there = True
    world.link_up()
    world.pass_time(5.0)
    assert world.modes_asked() == [], "the mode is not changed when the tower is back"
    world.mode = LOITER
    world.sent.clear()
    world.tower_sends(sticks(500))
    assert sticks(500) not in world.sent, "not before they were centred"


def test_a_guided_flight_is_brought_home_too() -> None:
    world = World(mode=4)
    world.climb_to(20.0)
    lose_the_tower(world)
    world.pass_time(30.5)
    assert world.modes_asked()[0] == RTL


def test_who_flies_by_radio_alone_is_left_alone() -> None:
    world = World()
    world.climb_to(20.0)
    lose_the_tower(world)
    world.pass_time(60.0)
    assert world.modes_asked() == []


def test_a_drone_on_the_ground_is_left_alone() -> None:
    world = World()
    world.stream(1.0)
    lose_the_tower(world)
    world.pass_time(40.0)
    assert RTL not in world.modes_asked()


def test_a_mission_that_a_trigger_stopped_goes_on_where_that_is_wanted() -> None:
    auto = 3
    for epoch, resumed in ((5, True), (6, False)):
        world = World(mode=auto)
        world.climb_to(20.0)
        world.configure(lost_action=LostAction.CONTINUE)
        world.onboard.message(order(epoch=epoch), world.now)
        world.pass_time(0.1)
        world.ack(176)
        world.mode = ALT_HOLD
        world.pass_time(0.1)
        lose_the_tower(world)
        world.sent.clear()
        world.pass_time(31.0)
        assert (auto in world.modes_asked()) is resumed


def test_an_ordered_hold_keeps_the_sticks_centred_when_the_tower_is_lost_in_it() -> None:
    world = flown_in_the_air()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.ack(176)
    world.mode = ALT_HOLD
    world.pass_time(0.1)
    lose_the_tower(world)
    world.pass_time(10.0)
    world.sent.clear()
    world.pass_time(1.0)
    assert len(world.messages("MANUAL_CONTROL")) >= 19
    world.link_up()
    world.collect()
    assert world.causes() == {HoldCause.ORDER}, "it is the same hold"


def test_an_autopilot_that_is_found_only_after_the_order_is_put_into_the_hold() -> None:
    world = World(heard=False)
    world.onboard.message(order(), world.now)
    world.pass_time(0.5)
    assert world.modes_asked() == []
    world.heard = True
    world.pass_time(0.1)
    assert ALT_HOLD in world.modes_asked()


def test_the_loss_parameters_are_told_when_read_and_to_each_new_link() -> None:
    world = World(armed=False)
    for _ in range(100):
        world.pass_time(STEP_S)
        for request in world.messages("PARAM_REQUEST_READ"):
            if request.param_id != "RC_OPTIONS":
                value = mavlink.MAVLink_param_value_message(request.param_id.encode(), 1.0, 9, 900, 1)
                world.onboard.from_autopilot([frame(value)], world.now)
    assert not [m for m in world.told if isinstance(m, LossParameters)], "one is not answered yet"
    world.pass_time(6.5)  # two that a real ArduPilot may not have are given up
    (told,) = [m for m in world.told if isinstance(m, LossParameters)]
    assert set(told.values) == set(LOSS_NAMES[3]) - {"MAV_GCS_SYSID", "RC_OPTIONS", "SIM_SPEEDUP"}
    assert (told.autopilot, told.complete, told.has_radio) == ("ardupilot", True, None)
    world.told.clear()
    world.link_up()
    world.collect()
    assert told in world.told


def test_losing_the_tower_in_an_autonomous_mode_leaves_the_mission_alone() -> None:
    world = World(mode=RTL, receiver=True)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.tower_there = False
    world.pass_time(5.0)
    assert not world.messages("MANUAL_CONTROL")


def test_losing_the_tower_on_the_ground_does_nothing() -> None:
    world = World(armed=False)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.tower_there = False
    world.pass_time(5.0)
    assert not world.messages("MANUAL_CONTROL")


def test_an_order_for_an_autopilot_that_is_silent_is_tried_and_told() -> None:
    world = World(heard=False)
    world.onboard.message(order(), world.now)
    world.pass_time(3.1)
    assert world.steps()[-1] == "unconfirmed"
    assert world.messages("MANUAL_CONTROL")


def test_progress_waits_for_a_link_within_a_bound() -> None:
    world = World(armed=False)
    world.onboard.link_broken(world.now)
    for n in range(PROGRESS_KEPT + 20):
        world.onboard.message(order(order_id=n + 1), world.now)
        world.beat()
        world.collect()
    assert world.steps() == []
    world.link_up()
    world.collect()
    assert len(world.steps()) == PROGRESS_KEPT


def test_the_state_is_told_on_change_and_to_each_new_link() -> None:
    world = World()
    states = [m for m in world.told if isinstance(m, AutopilotState)]
    assert states[-1] == AutopilotState(heard=True, armed=True, airborne=False)
    world.pass_time(60.0)
    world.told.clear()
    world.pass_time(1.0)
    assert world.told == []
    world.link_up()
    world.collect()
    assert [m for m in world.told if isinstance(m, AutopilotState)] == [
        AutopilotState(heard=True, armed=True, airborne=False)
    ]


def test_a_ground_station_beats_while_the_holder_is_there_and_the_tower_heard() -> None:
    world = World()

    def ground_station_beats(for_s: float) -> int:
        world.sent.clear()
        world.pass_time(for_s)
        return sum(m.type == mavlink.MAV_TYPE_GCS for m in world.messages("HEARTBEAT"))

    assert ground_station_beats(3.0) == 0
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=True), world.now)
    assert ground_station_beats(3.0) == 3
    world.tower_there = False
    assert 1 <= ground_station_beats(10.0) <= 2
    world.tower_there = True
    assert ground_station_beats(3.0) == 3
    world.onboard.link_broken(world.now)
    assert ground_station_beats(3.0) == 0


def test_rates_and_parameters_are_asked_again_after_a_reboot() -> None:
    world = World()
    world.pass_time(60.0)
    world.sent.clear()
    for boot_ms in (50_000, 900):
        position = mavlink.MAVLink_global_position_int_message(boot_ms, 0, 0, 0, 0, 0, 0, 0, 0)
        world.onboard.from_autopilot([frame(position)], world.now)
    world.pass_time(1.0)
    kinds = {message_id(f) for f in world.sent}
    assert mavlink.MAVLINK_MSG_ID_COMMAND_LONG in kinds
    assert mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ in kinds


def test_a_frame_that_cannot_be_read_still_goes_to_the_tower() -> None:
    world = World()
    strange = frame(mavlink.MAVLink_heartbeat_message(2, 3, 1, 5, 4, 3), component_id=77)
    unknown = bytes([0xFD, 1, 0, 0, 1, 1, 1, 0x60, 0xEA, 0, 5, 9, 9])
    assert world.onboard.from_autopilot([strange, unknown], world.now) == [strange, unknown]
