"""Drones that send more than their share: what is done, what it leaves alone, and when it ends."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest
from hub_world import NOW, FakeAgent, FakeBrowser, HubWorld, command_ack, heartbeat, record, sticks

from server.alerts.core.announcer import Announcer
from server.kernel.fleet import TeamRecord
from server.kernel.people import UserRef
from server.kernel.relations import TeamRole
from server.kernel.restraint import Measure, Restraint
from server.link.core.noise_watch import (
    FRAMES_PER_S,
    LIMITED_PER_S,
    QUIET_S,
    REPORTS_PER_S,
    TEXTS_PER_S,
    WINDOW_S,
    LimitedTelemetry,
    NoiseWatch,
)
from server.link.core.restraint import LosesItsLink, effect_of, needs_confirmation
from server.live import live_messages as live
from server.live.hub_events import HubEvent, NoiseJudged
from server.live.live_drone import LeaseView
from wire.control_messages import AutopilotState, SafetySettings
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch, UserId
from wire.open_holds import LostAction
from wire.tagged import tag

ONE = DroneId(1)
AT = datetime(2026, 1, 1, tzinfo=UTC)


def restrained(measure: Measure) -> Any:
    """Drone 1: alice flies it, bob is an operator of its team, and an admin did this to it."""
    team = TeamRecord(1, "crew", {UserId(2): TeamRole.OPERATOR}, AT)
    restraint = Restraint(measure, "too loud", "admin", by_admin=True, since=AT)
    return replace(record(1, (1,), holder=1, epoch=1), team=team, restraint=restraint)


def text(words: str, severity: int = 4) -> bytes:
    message = mavlink.MAVLink_statustext_message(severity, words.encode(), 0, 0)
    return build(message, system_id=1, component_id=1, sequence=0)


def texts_in(frames: list[bytes]) -> int:
    return sum(b"hello" in one for one in frames)


def alerts_told(browser: FakeBrowser) -> list[str]:
    return [one.alert.rule for one in browser.events() if isinstance(one, live.AlertChanged)]


class TestWatch:
    def windows(self, watch: NoiseWatch, now: float, count: int, **heard: float) -> tuple[float, bool]:
        changed = False
        for _ in range(count):
            for name, per_s in heard.items():
                setattr(watch, name, getattr(watch, name) + round(per_s * WINDOW_S))
            now += WINDOW_S
            changed |= watch.look(now, AT)
        return now, changed

    @pytest.mark.parametrize(
        ("what", "per_s", "measure"),
        [
            ("texts", TEXTS_PER_S, Measure.MUTED),
            ("frames", FRAMES_PER_S, Measure.LIMITED),
            ("reports", REPORTS_PER_S, Measure.LIMITED),
        ],
    )
    def test_begins_beyond_the_rate_and_ends_when_it_is_quiet(self, what: str, per_s: float, measure: Measure) -> None:
        watch = NoiseWatch()
        watch.look(0.0, AT)
        now, changed = self.windows(watch, 0.0, 5, **{what: per_s})
        assert (changed, watch.measures, watch.words) == (False, frozenset(), "")
        now, changed = self.windows(watch, now, 1, **{what: per_s * 1.2})
        assert (changed, watch.measures) == (True, frozenset({measure}))
        assert f"{per_s * 1.2:.0f} {what} a second" in watch.words
        now, changed = self.windows(watch, now, 30, **{what: per_s * 0.6})
        assert (changed, watch.measures) == (False, frozenset({measure})), "less than before, and still not quiet"
        now, changed = self.windows(watch, now, int(QUIET_S / WINDOW_S) - 1)
        assert not changed
        now, changed = self.windows(watch, now, 1)
        assert (changed, watch.measures, watch.words, watch.since) == (True, frozenset(), "", None)

    def test_only_what_is_loud_is_measured(self) -> None:
        watch = NoiseWatch()
        watch.look(0.0, AT)
        self.windows(watch, 0.0, 1, texts=TEXTS_PER_S * 2)
        assert watch.measures == {Measure.MUTED}, "its telemetry is left alone"

    def test_a_looker_who_is_late_counts_the_time_that_it_took(self) -> None:
        watch = NoiseWatch()
        watch.look(0.0, AT)
        watch.texts = round(TEXTS_PER_S * 50)
        assert not watch.look(60.0, AT)


class TestLimited:
    def test_each_kind_of_state_passes_twice_a_second(self) -> None:
        limited, passed = LimitedTelemetry(0.0), 0
        for number in range(1_000):
            passed += len(limited.admitted([heartbeat()], number / 100)[0])
        assert passed == 20

    def test_kinds_without_end_do_not_pass_without_end(self) -> None:
        limited, passed = LimitedTelemetry(0.0), 0
        for number in range(10_000):
            frame = build(
                mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3),
                system_id=1 + number % 250,
                component_id=1 + number // 250 % 250,
                sequence=0,
            )
            passed += len(limited.admitted([frame], number / 1_000)[0])
        assert passed <= 200 + 10 * LIMITED_PER_S

    def test_acknowledgements_pass_and_what_is_dropped_is_counted(self) -> None:
        limited = LimitedTelemetry(0.0)
        passed, lost = limited.admitted([command_ack()] * 700, 0.0)
        assert (len(passed), lost) == (500, 200)


@pytest.fixture
def world() -> HubWorld:
    return HubWorld()


def linked(world: HubWorld, measure: Measure | None) -> tuple[FakeAgent, FakeBrowser, FakeBrowser]:
    """The agent, the pilot's browser and that of another member of the team."""
    world.apply(replace(restrained(Measure.MUTED), restraint=None) if measure is None else restrained(measure))
    agent = world.agent(1)
    world.hub.reports.receive(agent.link, AutopilotState(heard=True, armed=True, airborne=True), NOW)
    return agent, world.browser(1), world.browser(2)


@pytest.mark.parametrize("measure", [None, Measure.MUTED, Measure.LIMITED])
def test_texts_of_a_muted_drone_reach_its_pilot_alone(world: HubWorld, measure: Measure | None) -> None:
    agent, alice, bob = linked(world, measure)
    agent.send(text("hello"), command_ack(), now=1.0)
    assert texts_in(alice.frames()) == 1
    seen = bob.frames()
    assert texts_in(seen) == (0 if measure else 1)
    assert any(command_ack()[4:] in one for one in seen), "what is no text reaches everybody as before"


@pytest.mark.parametrize("measure", [Measure.MUTED, Measure.LIMITED])
def test_sticks_reach_it_as_before(world: HubWorld, measure: Measure) -> None:
    agent, alice, _ = linked(world, measure)
    agent.received()
    passed = 0
    for number in range(500):
        now = number / 50
        if number % 25 == 0:
            agent.answer_pings(now)
        alice.send(tag(ONE, sticks()), now=now)
        passed += len(agent.received(now))
    assert passed == 500


def look(world: HubWorld, agent: FakeAgent, now: float, for_s: float) -> float:
    for _ in range(round(for_s * 10)):
        now += 0.1
        agent.send(heartbeat(), now=now)
        world.hub.tick(now)
    return now


def test_lesser_alerts_reach_the_pilot_alone_and_critical_ones_everybody(world: HubWorld) -> None:
    agent, alice, bob = linked(world, Measure.MUTED)
    announcer = Announcer(world.hub.state, unanswered_after_s=0)
    world.hub.alerts.listeners.append(announcer.changed)
    agent.send(
        build(mavlink.MAVLink_vibration_message(1, 70.0, 1.0, 1.0, 0, 0, 0), system_id=1, component_id=1, sequence=0),
        build(mavlink.MAVLink_fence_status_message(1, 1, 3, 0), system_id=1, component_id=1, sequence=0),
        text("Crash: disarming"),
        now=0.1,
    )
    now = look(world, agent, 0.1, 8.0)
    assert sorted(alerts_told(alice)) == ["failsafe", "fence-breached", "vibration"]
    assert alerts_told(bob) == ["fence-breached"], "found by the tower, critical"
    assert [one.alert.rule.name for one in announcer.taken()] == ["fence-breached"]
    welcome = world.hub.alerts.welcome(FakeBrowser(world.hub, 2).browser)
    assert [one.rule for one in welcome] == ["fence-breached"]
    # Lifted: what is still open is told, and announced.
    world.apply(replace(restrained(Measure.MUTED), restraint=None))
    look(world, agent, now, 1.0)
    announcer.tick(NOW)
    assert sorted(alerts_told(bob)) == ["failsafe", "vibration"]
    assert sorted(one.alert.rule.name for one in announcer.taken()) == ["failsafe", "vibration"]


def test_who_is_not_told_may_still_acknowledge(world: HubWorld) -> None:
    agent, _, bob = linked(world, Measure.MUTED)
    agent.send(text("Crash: disarming"), now=0.1)
    look(world, agent, 0.1, 2.0)
    (alert,) = world.hub.alerts.live()
    assert world.hub.alerts.acknowledge(alert.id, bob.browser.viewer).acknowledged_by is not None


def test_a_quarantine_ends_the_link_at_once_and_keeps_the_drone(world: HubWorld) -> None:
    agent, _, bob = linked(world, None)
    world.apply(restrained(Measure.QUARANTINED))
    drone = world.hub.state.drones[ONE]
    assert agent.closed == [
        (4401, "an admin has quarantined this drone: its key stays good, and it may link when that ends")
    ]
    assert (drone.link, drone.is_quarantined, drone.record.credential_hash) == (None, True, "c")
    assert agent.link.link_id not in world.hub.state.links
    view = [one.drone for one in bob.events() if isinstance(one, live.DroneChanged)][-1]
    assert view.restraint is not None
    assert (view.restraint.measure, view.restraint.by, view.online) == (Measure.QUARANTINED, "admin", False)


def test_the_tower_mutes_by_itself_says_so_and_ends_it(world: HubWorld) -> None:
    events: list[HubEvent] = []
    world.hub.state.on_event = events.append
    agent, alice, bob = linked(world, None)
    alice.events(), bob.events()

    def fly(now: float, for_s: int, texts_a_second: int) -> float:
        for _ in range(for_s):
            for _ in range(texts_a_second):
                agent.send(text("hello", 6), now=now)
            now = look(world, agent, now, 1.0)
            world.hub.each_second(now)
        return now

    now = fly(0.0, 25, 12)
    drone = world.hub.state.drones[ONE]
    assert drone.noise.measures == {Measure.MUTED}
    assert drone.view().restraint is not None
    bob.frames()
    now = fly(now, 2, 12)
    assert texts_in(bob.frames()) == 0
    told = [one.alert for one in bob.events() if isinstance(one, live.AlertChanged) and one.alert.rule == "noisy-drone"]
    assert told[-1].words.startswith("Drone 1 sends 12 texts a second: its texts, and alerts that are not critical, ")
    now = fly(now, round(QUIET_S + 2 * WINDOW_S) + 2, 0)
    assert drone.noise.measures == frozenset()
    assert drone.view().restraint is None
    assert "noisy-drone" in alerts_told(bob)
    fly(now, 1, 1)
    assert texts_in(bob.frames()) == 1
    judged = [one for one in events if isinstance(one, NoiseJudged)]
    assert [one.measures for one in judged] == [frozenset({Measure.MUTED}), frozenset()]


def test_a_flood_of_frames_limits_it_by_itself(world: HubWorld) -> None:
    agent, _, _ = linked(world, None)
    now = 0.0
    for _ in range(12):
        for number in range(30):
            agent.send(*[heartbeat(number)] * 100, now=now)
        now = look(world, agent, now, 1.0)
        world.hub.each_second(now)
    drone = world.hub.state.drones[ONE]
    assert (drone.is_limited, drone.is_muted) == (True, False)


class TestBefore:
    """What is said before a measure is taken."""

    def flying(self, world: HubWorld, *, armed: bool, airborne: bool, action: LostAction = LostAction.LAND) -> Any:
        world.hub.changes.apply_safety(ONE, SafetySettings(lost_action=action, lost_action_s=40.0))
        agent = world.agent(1)
        world.hub.reports.receive(agent.link, AutopilotState(heard=True, armed=armed, airborne=airborne), NOW)
        return world.hub.state.drones[ONE]

    def test_on_the_ground_a_quarantine_costs_no_flight(self, world: HubWorld) -> None:
        drone = self.flying(world, armed=False, airborne=False)
        assert not needs_confirmation(drone, Measure.QUARANTINED)
        assert "Its key stays" in effect_of(drone, Measure.QUARANTINED)

    def test_in_the_air_it_names_the_lost_action(self, world: HubWorld) -> None:
        drone = self.flying(world, armed=True, airborne=True)
        assert needs_confirmation(drone, Measure.QUARANTINED)
        words = str(LosesItsLink(drone))
        assert words.startswith("Drone 1 is in the air. It loses its link at once")
        assert "lands after 40 s" in words

    def test_armed_or_not_known_needs_a_confirmation_too(self, world: HubWorld) -> None:
        drone = self.flying(world, armed=True, airborne=False)
        assert needs_confirmation(drone, Measure.QUARANTINED)
        drone.armed = None
        assert needs_confirmation(drone, Measure.QUARANTINED)

    def test_lost_in_the_air_it_could_not_come_back(self, world: HubWorld) -> None:
        drone = self.flying(world, armed=True, airborne=True)
        drone.forget_link(NOW)
        assert needs_confirmation(drone, Measure.QUARANTINED)

    @pytest.mark.parametrize("measure", [Measure.MUTED, Measure.LIMITED])
    def test_the_others_leave_the_flight_alone(self, world: HubWorld, measure: Measure) -> None:
        drone = self.flying(world, armed=True, airborne=True)
        assert not needs_confirmation(drone, measure)
        assert "Drone 1" in effect_of(drone, measure)

    def test_an_offered_lease_is_no_pilot(self, world: HubWorld) -> None:
        """Only who has the controls, or assists, gets the texts."""
        lease = LeaseView(holder=None, taken_from=UserRef(UserId(1), "alice"), epoch=Epoch(2), offered=True)
        agent, alice, _ = linked(world, Measure.MUTED)
        world.hub.apply_lease(ONE, lease, event="offered", by=None, reason="", now=0.0)
        alice.frames()
        agent.send(text("hello"), now=1.0)
        assert texts_in(alice.frames()) == 0
