"""Following a leader: where a follower is sent, when it holds instead, and what takes precedence."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, radians
from typing import Any

import pytest
from drone_world import BRAKE, GUIDED, HOME, LOITER, RTL, SET_MODE, DroneWorld, mavlink
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.transactions.follow_course import STALE_S, Motion, gap, place, why_stop
from simulator.px4.flavour import PX4
from wire.control_messages import HoldOrder
from wire.dialect import build
from wire.following import APART_M, NEAR_M, PERSON_PATIENCE_S, FollowWork, LeaderPosition, is_apart
from wire.lateness import stamp_ms
from wire.transactions import CancelTransaction, CommandWork, Outcome, TransactionProgress, TransactionResult

offsets = st.floats(-100, 100, allow_nan=False)
speeds = st.floats(-30, 30, allow_nan=False)
SET_TARGET = "SET_POSITION_TARGET_GLOBAL_INT"


@given(
    lat=st.integers(-850_000_000, 850_000_000),
    lon=st.integers(-1_800_000_000, 1_800_000_000),
    speed=st.tuples(speeds, speeds, speeds),
    offset=st.tuples(offsets, offsets, offsets).filter(lambda one: is_apart(*one)),
    age_s=st.floats(0, 10),
)
def test_no_place_is_within_the_bound_of_the_leader(
    lat: int, lon: int, speed: tuple[float, float, float], offset: tuple[float, float, float], age_s: float
) -> None:
    leader = Motion(lat, lon, 500.0, *speed, 100.0)
    now = 100.0 + age_s
    there = place(leader, FollowWork("falcon", *offset), now)
    apart = gap(leader.later(now), there)
    assert not apart.near
    assert max(apart) >= APART_M - 0.5
    assert max(gap(leader, leader.later(now))) <= 30 * 1.5 * STALE_S + 1, "an old position is not moved on for ever"
    assert -1_800_000_000 <= there.lon_e7 <= 1_800_000_000


@pytest.mark.parametrize("metres", [1.0, 4.9])
def test_too_near_is_too_near_where_meridians_meet(metres: float) -> None:
    leader = Motion(600_000_000, 1_799_999_999, 500.0, 0, 0, 0, 10.0)
    own = leader.shifted(0.0, metres, 0.0)
    assert own.lon_e7 < 0
    why = why_stop(own, leader, FollowWork("falcon", 20, 0, 0), 10.0, home_alt_m=400.0)
    assert why is not None
    assert "too near to falcon" in why
    assert why_stop(own.shifted(0, 0, 6), leader, FollowWork("falcon", 20, 0, 0), 10.0, home_alt_m=400.0) is None


def test_who_comes_near_within_a_second_is_stopped_before() -> None:
    leader = Motion(470_000_000, 80_000_000, 500.0, 0, 0, 0, 10.0)
    away = leader.shifted(12.0, 0.0, 0.0)
    work = FollowWork("falcon", 10, 0, 0)
    assert why_stop(away, leader, work, 10.0, home_alt_m=400.0) is None
    assert why_stop(away._replace(north_m_s=-9.0), leader, work, 10.0, home_alt_m=400.0) is not None


class FollowWorld(DroneWorld):
    """A drone in the air, and a leader that the test flies. Its position is reported five times a second."""

    def __init__(self, **options: Any) -> None:
        super().__init__(takes=("transactions",), **options)
        self.north_m, self.east_m, self.alt_m = 60.0, 0.0, 20.0
        self.speed_north = 0.0
        self.leader_flies = True
        self.leader_heard = True
        self.following = 0
        self._number = 0
        self._report_at = 0.0
        self.reports_every_s = 0.2
        self._heard_at = 0.0

    def step(self) -> None:
        super().step()
        self.north_m += self.speed_north * 0.005
        if self.following and self.now >= self._report_at:
            self._report_at = self.now + self.reports_every_s
            self.announce()

    def announce(self, *, number: int | None = None, **other: Any) -> None:
        if self.leader_heard:
            self._heard_at = self.now
        if number is None:
            self._number += 1
        where = self.where()
        fields = {
            "lat_e7": round(where[0] * 1e7),
            "lon_e7": round(where[1] * 1e7),
            "alt_amsl_mm": round((HOME.alt_amsl_m + self.alt_m) * 1000),
            "north_cm_s": round(self.speed_north * 100),
            "east_cm_s": 0,
            "down_cm_s": 0,
            "age_ms": round((self.now - self._heard_at) * 1000),
            "airborne": self.leader_flies,
        }
        reported = {"id": self.following, "number": self._number if number is None else number}
        message = LeaderPosition(**(reported | {"sent_ms": stamp_ms(self.now)} | fields | other))
        self.onboard.message(message, self.now)
        self._collect()

    def where(self, north_m: float = 0.0, east_m: float = 0.0) -> tuple[float, float]:
        lat = HOME.lat_deg + (self.north_m + north_m) / 111_319.5
        lon = HOME.lon_deg + (self.east_m + east_m) / (111_319.5 * cos(radians(HOME.lat_deg)))
        return lat, lon

    def follow(self, north_m: float = -15.0, east_m: float = 0.0, up_m: float = 0.0, **options: Any) -> int:
        number = self.begin(FollowWork("falcon", north_m, east_m, up_m), **({"deadline_s": 600.0} | options))
        self.following = self.following or number
        return number

    def follows_person(self) -> FollowWorld:
        """Follows a person whose position arrives once a second, at the follower's height."""
        self.ready().flies()
        self.alt_m = self.vehicle.flight.alt_over_home_m()
        self.reports_every_s = 1.0
        self.following = self.begin(FollowWork("falcon", -15.0, 0.0, 0.0, PERSON_PATIENCE_S), deadline_s=600.0)
        self.until(lambda: self.targets(), what="a target")
        self.run(1.0)
        return self

    def follows(self) -> FollowWorld:
        self.ready().flies()
        self.follow()
        self.until(lambda: self.targets(), what="a target")
        self.run(1.0)
        assert not self.results(self.following)
        return self

    def targets(self) -> list[Any]:
        return [one for one in self.asked_of_autopilot(SET_TARGET) if one.type_mask == 0b1101_1100_0000]

    def off_m(self, north_m: float, east_m: float, up_m: float) -> float:
        """Returns the follower's distance from this position relative to the leader."""
        body = self.vehicle.flight.body
        gaps = (self.north_m + north_m - body.north_m, self.east_m + east_m - body.east_m)
        return max(abs(gaps[0]), abs(gaps[1]), abs(self.alt_m + up_m - self.vehicle.flight.alt_over_home_m()))


def ended(world: FollowWorld, outcome: Outcome, *words: str) -> TransactionResult:
    result = world.result(world.following, limit_s=15.0)
    assert result.outcome is outcome, result
    assert "falcon" in result.words
    assert all(word in result.words for word in words), result.words
    return result


def holds(world: FollowWorld) -> None:
    """Asserts that it stands in BRAKE and receives no more commands."""
    reported = len(world.targets())
    world.run(5.0)
    assert world.vehicle.flight.mode == BRAKE
    body = world.vehicle.flight.body
    assert max(abs(body.vn_mps), abs(body.ve_mps)) < 0.5
    assert len(world.targets()) == reported


def test_it_keeps_its_place_beside_a_leader_that_flies_on() -> None:
    world = FollowWorld().follows()
    world.until(lambda: world.off_m(-15, 0, 0) < 1.0, 40.0, "its place")
    world.speed_north = 3.0
    world.run(15.0)
    assert world.off_m(-15, 0, 0) < 4.0
    newest = world.targets()[-1]
    assert (newest.coordinate_frame, round(newest.vx, 1)) == (5, 3.0), "with the leader's speed, above the sea"
    assert newest.alt == pytest.approx(HOME.alt_amsl_m + 20.0, abs=0.1)
    reported = [one for one in world.reported if isinstance(one, TransactionProgress) and one.id == world.following]
    assert reported[-1].phase.startswith("following falcon: ")
    rate = len(world.targets())
    world.run(2.0)
    assert len(world.targets()) - rate in (9, 10, 11)


def lost(world: FollowWorld) -> None:
    world.leader_heard = False


def tower_lost(world: FollowWorld) -> None:
    world.link_down()
    world._report_at = float("inf")


def landed(world: FollowWorld) -> None:
    world.leader_flies = False


def near(world: FollowWorld) -> None:
    body = world.vehicle.flight.body
    world.north_m, world.alt_m = body.north_m + 3.0, world.vehicle.flight.alt_over_home_m()


def far(world: FollowWorld) -> None:
    world.north_m += 300.0


def low(world: FollowWorld) -> None:
    world.alt_m = 2.0


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (lost, "nothing new was heard of falcon for 2 s"),
        (landed, "falcon is not in the air"),
        (near, "too near to falcon"),
        (far, "falcon is more than 200 m away"),
        (low, "lower than 3 m above its home"),
    ],
    ids=["lost", "landed", "near", "far", "low"],
)
def test_what_makes_it_impossible_ends_it_with_a_hold(what: Callable[[FollowWorld], None], words: str) -> None:
    world = FollowWorld().follows()
    what(world)
    ended(world, Outcome.FAILED, words, "It holds in BRAKE.")
    holds(world)


def test_a_person_may_be_silent_for_longer_and_then_it_holds() -> None:
    world = FollowWorld().follows_person()
    world.speed_north = 1.5
    world.run(10.0)
    assert not world.results(world.following)
    assert world.off_m(-15, 0, 0) < 4.0
    silent_at = world.now
    world._report_at = float("inf")
    ended(world, Outcome.FAILED, "nothing new was heard of falcon for 3 s", "It holds in BRAKE.")
    assert world.now - silent_at > STALE_S
    holds(world)


def test_sticks_that_are_moved_end_it_and_centred_ones_do_not() -> None:
    world = FollowWorld().follows()
    world.tower_sends(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))
    world.run(1.0)
    assert not world.results(world.following)
    world.tower_sends(mavlink.MAVLink_manual_control_message(1, 400, 0, 500, 0, 0))
    ended(world, Outcome.FAILED, "the sticks were moved", "It holds in BRAKE.")
    assert world.vehicle.flight.mode == BRAKE


def test_a_lost_tower_ends_it_with_a_hold_and_is_told_when_it_is_back() -> None:
    world = FollowWorld().follows()
    tower_lost(world)
    world.run(STALE_S + 1.5)
    assert world.vehicle.flight.mode == BRAKE
    world.link_up()
    ended(world, Outcome.FAILED, "nothing new was heard of falcon", "It holds in BRAKE.")


def test_who_wants_it_no_more_gets_a_hold() -> None:
    world = FollowWorld().follows()
    world.onboard.message(CancelTransaction(id=world.following), world.now)
    ended(world, Outcome.CANCELLED, "stop following", "It holds in BRAKE.")
    holds(world)


def test_its_time_ends_in_a_hold() -> None:
    world = FollowWorld().ready().flies()
    world.follow(deadline_s=3.0)
    ended(world, Outcome.TIMED_OUT, "It holds in BRAKE.")
    holds(world)


def test_another_holder_gets_a_drone_that_holds() -> None:
    world = FollowWorld().follows()
    world.change_epoch()
    ended(world, Outcome.STALE_EPOCH, "changed hands", "It holds in BRAKE.")
    holds(world)


def a_mode(world: FollowWorld) -> None:
    assert world.command(SET_MODE, 1, RTL).outcome is Outcome.DONE


def a_frame(world: FollowWorld) -> None:
    world.tower_sends(mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, RTL, 0, 0, 0, 0, 0))


@pytest.mark.parametrize("what", [a_mode, a_frame], ids=["command", "frame"])
def test_who_commands_otherwise_is_not_disturbed(what: Callable[[FollowWorld], None]) -> None:
    world = FollowWorld().follows()
    what(world)
    reported = len(world.targets())
    ended(world, Outcome.FAILED, "another command")
    world.run(3.0)
    assert world.vehicle.flight.mode == RTL
    assert len(world.targets()) == reported


def test_a_hold_wins() -> None:
    world = FollowWorld().follows()
    world.onboard.message(HoldOrder(order_id=1, epoch=world.epoch, reason="a test"), world.now)
    reported = len(world.targets())
    ended(world, Outcome.FAILED, "a hold")
    world.run(3.0)
    assert len(world.targets()) == reported
    assert world.vehicle.flight.mode != GUIDED
    brakes = [one for one in world.commands_sent(SET_MODE) if one.param2 == BRAKE]
    assert {one.get_srcComponent() for one in brakes} <= {191}, "the hold brakes, not the follower"


def test_a_pilot_who_switches_the_mode_has_it() -> None:
    world = FollowWorld().follows()
    world.vehicle.receive(pilot_switches(LOITER), world.now - 1000.0)
    ended(world, Outcome.FAILED, "LOITER")
    sent = len(world.commands_sent(SET_MODE))
    world.run(3.0)
    assert world.vehicle.flight.mode == LOITER
    assert len(world.commands_sent(SET_MODE)) == sent


def pilot_switches(mode: int) -> bytes:
    """A mode switch by the pilot's radio, past the agent."""
    message = mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, mode, 0, 0, 0, 0, 0)
    return build(message, system_id=254, component_id=190, sequence=0)


def test_it_does_not_begin_on_the_ground_or_in_another_mode_or_where_it_would_be_too_near() -> None:
    world = FollowWorld().ready()
    assert "not in the air" in world.do(FollowWork("falcon", -15, 0, 0)).words
    world.flies(LOITER)
    assert "in LOITER, not in GUIDED" in world.do(FollowWork("falcon", -15, 0, 0)).words
    world.command(SET_MODE, 1, GUIDED)
    refused = world.do(FollowWork("falcon", -4, 0, NEAR_M))
    assert (refused.outcome, "too near" in refused.words) == (Outcome.REFUSED, True)
    blind = world.do(FollowWork("falcon", -15, 0, 0))
    assert (blind.outcome, "did not receive where falcon is" in blind.words) == (Outcome.REFUSED, True)
    late = world.do(FollowWork("falcon", -15, 0, 0), late_s=5.0)
    assert late.outcome is Outcome.REFUSED
    stale = world.do(FollowWork("falcon", -15, 0, 0), epoch=world.epoch - 1)
    assert stale.outcome is Outcome.STALE_EPOCH
    assert world.targets() == []


def test_one_leader_at_a_time() -> None:
    world = FollowWorld().follows()
    second = world.follow()
    assert "it follows falcon" in world.result(second).words
    assert not world.results(world.following)


def test_what_is_older_or_held_up_does_not_count() -> None:
    world = FollowWorld().follows()
    world.announce(number=1, lat_e7=0, lon_e7=0)
    world.run(0.5)
    assert not world.results(world.following)
    world._report_at = float("inf")
    for _ in range(20):  # a queue in transit: each arrives, three seconds late
        world.announce(sent_ms=stamp_ms(world.now - 3.0))
        world.run(0.2)
    ended(world, Outcome.FAILED, "nothing new was heard of falcon")


def repositions_answered(world: FollowWorld) -> list[Any]:
    """The answers that the tower sees."""
    return [one for one in world.went_up("COMMAND_ACK") if one.command == 192]


def test_a_px4_is_sent_to_its_place_and_holds_in_loiter() -> None:
    world = FollowWorld(flavour=PX4).ready()
    climb = CommandWork(22, (None, 0.0, 0.0, None, None, None, HOME.alt_amsl_m + 15))
    assert world.do(climb).outcome is Outcome.DONE
    assert world.command(400, 1).outcome is Outcome.DONE
    world.until(lambda: world.vehicle.flight.alt_over_home_m() > 14.0, what="at height")
    world.command(SET_MODE, 1, 4, 3)
    world.run(1.0)  # a stop goes behind it, and is answered
    answered = len(repositions_answered(world))
    world.follow()
    world.until(lambda: world.off_m(-15, 0, 0) < 1.5, 60.0, "its place")
    sent = world.commands_sent(192)
    assert len(repositions_answered(world)) == answered
    world.run(5.0)
    assert len(world.commands_sent(192)) - len(sent) in (4, 5)
    near(world)
    ended(world, Outcome.FAILED, "too near", "It holds in AUTO.LOITER.")
    count = len(world.commands_sent(192))
    world.run(3.0)
    assert len(world.commands_sent(192)) == count
