"""The agent's view of the pilot: stale sticks, a lost tower, who flies, and what may not arrive late."""

import pytest

from onboard_agent.failsafe.late_frames import COMMANDS, STICKS, too_late
from onboard_agent.failsafe.pilot_watch import Alarm, PilotWatch
from onboard_agent.failsafe.safety import LIMITS, within_limits
from onboard_agent.failsafe.tower_use import BEFORE_ARMING_S, TowerUse
from wire.control_messages import HoldCause, SafetySettings
from wire.dialect import mavlink
from wire.open_holds import LostAction

STEP_S = 0.025
SETTINGS = SafetySettings()


class Bench:
    """A drone flown by hand through a tower that sends heartbeats, until the test changes this."""

    def __init__(self, settings: SafetySettings = SETTINGS) -> None:
        self.now = 10.0
        self.settings = settings
        self.by_hand, self.tower_there, self.sticks_come, self.ordered = True, True, True, False
        self.watch = PilotWatch(self.now)
        self.alarms: list[tuple[float, Alarm]] = []

    def pass_time(self, for_s: float) -> "Bench":
        begin, end = self.now, self.now + for_s
        while self.now < end:
            if self.tower_there:
                self.watch.loss.tower_heard(self.now)
            if self.sticks_come:
                self.watch.sticks_passed(self.now)
            alarm = self.watch.alarm(
                self.now, settings=self.settings, flown_by_hand=self.by_hand, kept_centred=self.ordered
            )
            if alarm is not None:
                self.alarms.append((round(self.now - begin, 3), alarm))
            self.now += STEP_S
        return self

    def causes(self) -> list[HoldCause]:
        return [alarm.cause for _, alarm in self.alarms]


def test_sticks_that_stop_are_stale_within_a_tick_of_the_limit() -> None:
    bench = Bench().pass_time(1.0)
    bench.sticks_come = False
    bench.pass_time(5.0)
    ((at_s, alarm),) = bench.alarms
    assert alarm.cause is HoldCause.STICKS_STALE
    assert 0.5 - STEP_S <= at_s <= 0.5 + STEP_S
    assert "0.5 s" in alarm.why


def test_the_limit_is_a_setting() -> None:
    bench = Bench(SafetySettings(sticks_stale_s=1.5)).pass_time(1.0)
    bench.sticks_come = False
    assert bench.pass_time(1.4).alarms == []
    assert bench.pass_time(0.2).causes() == [HoldCause.STICKS_STALE]


def test_who_never_sent_sticks_is_never_stale() -> None:
    bench = Bench()
    bench.sticks_come = False
    assert bench.pass_time(10.0).alarms == []


def test_sticks_in_a_mode_that_needs_none_may_stop() -> None:
    bench = Bench().pass_time(1.0)
    bench.sticks_come = bench.by_hand = False
    bench.pass_time(2.0)
    bench.by_hand = True
    assert bench.pass_time(5.0).alarms == [], "the mode changed later, and not by these sticks"


def test_who_commands_a_mode_that_needs_no_sticks_is_not_stale() -> None:
    bench = Bench().pass_time(1.0)
    bench.sticks_come = False
    bench.watch.no_pilot_needed()
    assert bench.pass_time(5.0).alarms == []


def test_a_disarmed_drone_has_no_stale_sticks() -> None:
    bench = Bench().pass_time(1.0)
    bench.sticks_come = False
    bench.watch.heartbeat(armed=False, now=bench.now)
    assert bench.pass_time(5.0).alarms == []


def test_where_sticks_may_be_stale_for_long_the_lost_pilot_is_noticed_first() -> None:
    bench = Bench(SafetySettings(sticks_stale_s=5.0)).pass_time(1.0)
    bench.sticks_come = bench.tower_there = False
    bench.pass_time(3.0)
    ((at_s, alarm),) = bench.alarms
    assert alarm.cause is HoldCause.PILOT_LOST
    assert 2.0 - STEP_S <= at_s <= 2.0 + STEP_S


def test_an_ordered_hold_whose_tower_is_lost_goes_over_into_the_agents_own() -> None:
    bench = Bench()
    bench.sticks_come = bench.tower_there = False
    bench.ordered = True
    assert bench.pass_time(1.9).alarms == []
    assert bench.pass_time(0.2).causes()[0] is HoldCause.PILOT_LOST


def test_the_tower_has_a_part_in_a_flight_that_it_armed_or_steered() -> None:
    use = TowerUse()
    use.heartbeat(armed=False, now=0.0)
    use.used(1.0)
    use.heartbeat(armed=True, now=2.0)
    assert use.in_this_flight, "armed through the tower"
    use.heartbeat(armed=False, now=60.0)
    use.heartbeat(armed=True, now=70.0)
    assert not use.in_this_flight, "armed by radio"
    use.used(80.0)
    use.heartbeat(armed=True, now=81.0)
    assert use.in_this_flight, "steered through the tower"


def test_what_was_sent_long_before_arming_is_of_another_flight() -> None:
    use = TowerUse()
    use.used(1.0)
    use.heartbeat(armed=True, now=1.1 + BEFORE_ARMING_S)
    assert not use.in_this_flight


@pytest.mark.parametrize(
    ("message_id", "late_s", "refused"),
    [
        (mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL, 0.49, None),
        (mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL, 0.51, "sticks too late"),
        (mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE, 0.51, "sticks too late"),
        (mavlink.MAVLINK_MSG_ID_COMMAND_LONG, 1.9, None),
        (mavlink.MAVLINK_MSG_ID_COMMAND_LONG, 2.1, "command too late"),
        (mavlink.MAVLINK_MSG_ID_COMMAND_INT, 2.1, "command too late"),
        (mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT, 2.1, "command too late"),
        (mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT, 2.1, "command too late"),
        (mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL, 2.1, "command too late"),
        (mavlink.MAVLINK_MSG_ID_SET_MODE, 2.1, "command too late"),
        (mavlink.MAVLINK_MSG_ID_HEARTBEAT, 99.0, None),
        (mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ, 99.0, None),
        (mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT, 99.0, None),
    ],
)
def test_what_may_come_late(message_id: int, late_s: float, refused: str | None) -> None:
    assert too_late(message_id, late_s, SETTINGS) == refused


def test_sticks_are_no_commands() -> None:
    assert not STICKS & COMMANDS


def test_settings_that_make_no_sense_are_moved_to_what_does() -> None:
    assert within_limits(SETTINGS) == SETTINGS
    nothing = within_limits(SafetySettings(**dict.fromkeys(LIMITS, 0.0)))
    for name, (least, _) in LIMITS.items():
        assert getattr(nothing, name) == least
    wild = within_limits(SafetySettings(lost_hold_s=1e9, lost_action_s=-5.0, lost_action=LostAction.LAND))
    assert wild.lost_hold_s == LIMITS["lost_hold_s"][1]
    assert wild.lost_action_s == wild.lost_hold_s
    assert wild.lost_action is LostAction.LAND
