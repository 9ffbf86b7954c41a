"""The disarmed state must be proved, not remembered; and arming without a receiver. Flown with a model ArduCopter."""

import pytest
from worlds.held_copter import ARM, HeldCopter, mode_command, sticks, takeoff
from worlds.model_copter import Mode, ModelCopter, Receiver

from wire.open_holds import HoldStage

OFFSETS_MS = range(0, 1001, 50)


def on_the_ground(receiver: Receiver = Receiver.LOW, *, mode: Mode = Mode.GUIDED) -> HeldCopter:
    return HeldCopter(ModelCopter(50.0, receiver=receiver, mode=mode))


def held_after_s(world: HeldCopter, since: float) -> float:
    """Returns the time from `since` to the first mode that the agent began."""
    return next(change.at for change in world.copter.changes if change.by == 191 and change.at >= since) - since


@pytest.mark.parametrize("phase_ms", [0, 300, 900], ids=lambda ms: f"beat {ms} ms ago")
@pytest.mark.parametrize("offset_ms", OFFSETS_MS)
def test_an_arming_after_the_order_is_held_at_once(offset_ms: int, phase_ms: int) -> None:
    world = on_the_ground()
    world.pass_time(1.0 + phase_ms / 1000.0)
    world.take()
    world.pass_time(offset_ms / 1000.0)
    armed_at = world.now
    world.copter.receive([ARM, takeoff(10.0)])
    world.pass_time(3.0)
    assert held_after_s(world, armed_at) <= 0.15
    assert world.copter.mode is Mode.ALT_HOLD
    assert world.copter.height_m == 0.0
    assert world.steps()[-1] == "confirmed"
    assert world.state.open


@pytest.mark.parametrize("offset_ms", OFFSETS_MS)
def test_an_arming_that_was_accepted_before_the_order_counts(offset_ms: int) -> None:
    """The last heartbeat reports a drone as disarmed that is taking off."""
    world = on_the_ground()
    world.pass_time(1.1)
    world.copter.receive([ARM, takeoff(10.0)])
    world.pass_time(offset_ms / 1000.0)
    ordered_at = world.now
    world.take()
    world.pass_time(0.2)
    assert held_after_s(world, ordered_at) <= 0.15
    assert world.copter.mode is Mode.ALT_HOLD
    world.pass_time(5.0)
    assert world.copter.height_m <= 0.1
    assert "not_needed" not in world.steps()


def test_one_that_is_disarmed_is_told_so_by_a_heartbeat_after_the_order() -> None:
    world = on_the_ground()
    world.pass_time(0.5)
    world.take()
    assert world.steps() == []
    world.pass_time(0.1)
    assert world.steps() == ["not_needed"]
    world.sticks.clear()
    world.pass_time(10.0)
    assert world.steps() == ["not_needed"]
    assert (world.sticks, world.modes_asked()) == ([], [])
    assert not world.state.open


def test_the_order_is_open_for_five_seconds() -> None:
    for after_s, held in ((4.8, True), (5.5, False)):
        world = on_the_ground()
        world.take()
        world.pass_time(after_s)
        world.copter.receive([ARM])
        world.pass_time(1.5)
        assert world.state.open is held
        assert (world.copter.mode is Mode.ALT_HOLD) is held


def test_an_autopilot_that_proves_nothing_is_held_as_if_it_flew() -> None:
    world = on_the_ground()
    world.copter.mute = True
    world.take()
    world.pass_time(1.4)
    assert world.sticks == []
    world.pass_time(0.3)
    assert {(one.x, one.z) for one in world.sticks} == {(0, 500)}
    assert world.state.stage is HoldStage.NONE


def test_a_hold_of_a_drone_on_the_ground_is_no_lost_person() -> None:
    world = on_the_ground()
    world.take()
    world.pass_time(0.2)
    world.copter.receive([ARM])
    world.pass_time(40.0)
    assert world.copter.mode is Mode.ALT_HOLD
    assert world.state.lost is None


# Without a receiver


@pytest.mark.parametrize("mode", [Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER, Mode.GUIDED])
def test_without_a_receiver_sticks_rest_at_the_bottom_while_somebody_may_arm(mode: Mode) -> None:
    world = on_the_ground(Receiver.NONE, mode=mode)
    world.pass_time(1.0)
    assert {(one.x, one.z, one.buttons) for one in world.sticks} == {(0, 0, 0)}
    assert world.longest_gap_s(world.now - 1.0) <= 0.3
    world.send(ARM)
    world.pass_time(0.1)
    assert world.copter.armed, world.copter.texts
    world.holder_is(present=False)


def test_they_end_with_the_holder_and_begin_with_them() -> None:
    world = on_the_ground(Receiver.NONE)
    world.holder_is(present=False)
    world.sticks.clear()
    world.pass_time(3.0)
    assert world.sticks == []
    world.holder_is(present=True)
    world.pass_time(0.5)
    assert {one.z for one in world.sticks} == {0}
    world.link_down()
    world.sticks.clear()
    world.pass_time(3.0)
    assert world.sticks == []


@pytest.mark.parametrize("receiver", [Receiver.LOW, Receiver.CENTRED])
def test_with_a_receiver_there_are_none(receiver: Receiver) -> None:
    world = on_the_ground(receiver)
    world.pass_time(5.0)
    assert world.sticks == []


def test_the_holders_sticks_pass_only_once_it_is_armed() -> None:
    world = on_the_ground(Receiver.NONE, mode=Mode.LOITER)
    world.hand = (0, 500)
    world.pass_time(1.0)
    assert {(one.z, one.buttons) for one in world.sticks} == {(0, 0)}
    assert world.agent.counts["sticks while disarmed, without a receiver"] >= 15
    world.send(ARM)
    armed_at = world.now
    world.pass_time(2.0)
    assert world.copter.armed, world.copter.texts
    assert world.longest_gap_s(armed_at) <= 0.3
    assert {(one.z, one.buttons) for one in world.sticks_since(armed_at + 1.1)} == {(500, 1)}


def test_without_a_receiver_and_without_a_pad_it_takes_off_by_command() -> None:
    world = on_the_ground(Receiver.NONE)
    world.pass_time(1.0)
    began_at = world.now
    world.send(ARM)
    world.pass_time(0.3)
    world.send(takeoff(10.0))
    world.pass_time(20.0)
    assert world.copter.armed
    assert world.copter.height_m == pytest.approx(10.0, abs=0.5)
    assert world.copter.changes == []
    assert world.longest_gap_s(began_at) <= 0.3


@pytest.mark.parametrize("commanded", [Mode.BRAKE, Mode.GUIDED, Mode.RTL, Mode.LAND, Mode.AUTO, Mode.ALT_HOLD])
@pytest.mark.parametrize("flown_in", [Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER, Mode.POSHOLD])
def test_sticks_have_no_gap_while_somebody_assists_without_a_receiver(flown_in: Mode, commanded: Mode) -> None:
    world = HeldCopter(ModelCopter(50.0, receiver=Receiver.NONE, height_m=20.0, mode=flown_in), knows_s=0.0)
    world.hand = (400, 500)
    world.pass_time(2.0)
    began_at = world.now
    world.assist(begins=True)
    world.send(mode_command(commanded))
    world.pass_time(1.0)
    assert world.copter.mode is commanded
    world.assist(begins=False)
    world.pass_time(0.2)
    world.hand = (0, 500)
    world.pass_time(1.0)
    assert world.longest_gap_s(began_at) <= 0.3
    changes = [(change.mode, change.why) for change in world.copter.changes]
    assert changes == ([(commanded, "commanded")] if commanded is not flown_in else [])


def test_no_sticks_are_begun_for_what_flies_without_any() -> None:
    world = HeldCopter(ModelCopter(50.0, receiver=Receiver.NONE, height_m=20.0, mode=Mode.AUTO))
    world.pass_time(3.0)
    assert world.sticks == []
    world.send(mode_command(Mode.BRAKE))
    world.pass_time(3.0)
    assert world.sticks == []
    assert world.copter.mode is Mode.BRAKE


def test_a_hold_of_what_flies_without_sticks_is_stage_two_at_once_and_begins_none() -> None:
    for receiver in Receiver:
        world = HeldCopter(ModelCopter(50.0, receiver=receiver, height_m=20.0, mode=Mode.AUTO))
        world.take()
        world.pass_time(0.2)
        assert (world.copter.mode, world.state.stage) == (Mode.BRAKE, HoldStage.STAY)
        world.pass_time(10.0)
        assert world.sticks == []
        assert [change.mode for change in world.copter.changes] == [Mode.BRAKE]


def test_where_stage_two_is_refused_its_sticks_come_with_stage_one() -> None:
    world = HeldCopter(ModelCopter(50.0, height_m=20.0, mode=Mode.AUTO))
    world.copter.refuses = frozenset({Mode.BRAKE, Mode.GUIDED})
    world.take()
    world.pass_time(1.0)
    assert (world.copter.mode, world.state.stage, world.state.sticks) == (Mode.ALT_HOLD, HoldStage.ALTITUDE, True)
    assert world.longest_gap_s(world.copter.changes[0].at) <= 0.3
    world.pass_time(10.0)
    assert "refuses BRAKE" in world.state.waiting_for
    world.copter.refuses = frozenset()
    world.pass_time(6.0)
    assert (world.copter.mode, world.state.stage) == (Mode.BRAKE, HoldStage.STAY)


def test_a_person_who_arms_and_flies_is_not_in_the_way_of_their_own_sticks() -> None:
    world = on_the_ground(Receiver.NONE, mode=Mode.LOITER)
    world.pass_time(1.0)
    world.send(ARM)
    world.pass_time(0.2)
    world.send(sticks(0, 500))
    world.hand = (0, 900)
    world.pass_time(5.0)
    assert world.copter.height_m > 5.0
    assert world.copter.changes == []
