"""Alerts from frames and reports to the people concerned: one for each lasting condition, for those who may know."""

from datetime import UTC, datetime

import pytest
from hub_world import NAMES, NOW, OLGA, FakeAgent, FakeBrowser, HubWorld, command_long, heartbeat, record

from server.alerts.core.alert import Alert
from server.alerts.core.refusals import MayNotAcknowledge, UnknownAlert
from server.alerts.core.rules import BY_NAME
from server.alerts.core.service import LOOK_S, PARTS
from server.alerts.core.views import AlertView
from server.kernel.fleet import TeamRecord
from server.kernel.people import Principal, UserRef
from server.kernel.relations import TeamRole
from server.live import live_messages as live
from server.live.live_drone import LeaseView
from server.towers.core.place import Place
from wire.control_messages import AutopilotState, HoldProgress, HoldStep
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch, UserId

ONE = DroneId(1)


class Scene:
    """alice holds drone 1, which flies. `stored` has each change, as the store is told of it."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.world.apply(record(1, (1,), holder=1, epoch=1), record(2, (2,)))
        self.stored: list[tuple[str, bool]] = []
        self.hub.alerts.listeners.append(lambda alert: self.stored.append((alert.rule.name, alert.closed_at is None)))
        self.now = 0.0
        self.agent: FakeAgent = self.world.agent(1)
        self.alice = self.world.browser(1)
        self.fly()

    def fly(self, *, armed: bool = True, airborne: bool = True) -> None:
        self.hub.reports.receive(self.agent.link, AutopilotState(heard=True, armed=armed, airborne=airborne), NOW)

    def send(self, message: object) -> None:
        self.agent.send(build(message, system_id=1, component_id=1, sequence=0), now=self.now)

    def wait(self, for_s: float, *, heard: bool = True) -> None:
        """Time passes, at the pace of the hub."""
        end = self.now + for_s
        while self.now < end:
            self.now += LOOK_S / PARTS
            if heard:
                self.agent.send(heartbeat(), now=self.now)
            self.hub.tick(self.now)

    def open(self) -> list[str]:
        return sorted(alert.rule.name for alert in self.hub.alerts.live() if alert.closed_at is None)


def told(browser: FakeBrowser) -> list[AlertView]:
    return [event.alert for event in browser.events() if isinstance(event, live.AlertChanged)]


def principal(user_id: int) -> Principal:
    return FakeBrowser(HubWorld().hub, user_id).browser.viewer


def battery(charge: int) -> object:
    return mavlink.MAVLink_battery_status_message(
        0, 0, 0, 0, [0] * 10, 0, 0, 0, 12 if charge > 1 else 80, charge_state=charge
    )


def text(words: str, severity: int = 4) -> object:
    return mavlink.MAVLink_statustext_message(severity, words.encode(), 0, 0)


def test_a_frame_becomes_one_alert_with_a_beginning_and_an_end() -> None:
    scene = Scene()
    scene.wait(2.0)
    assert scene.open() == []
    scene.send(battery(3))
    scene.wait(30.0)
    (alert,) = told(scene.alice)
    assert (alert.rule, alert.severity, alert.closed_at) == ("battery-critical", "critical", None)
    assert alert.words == "The battery of Drone 1 is critical by its autopilot's threshold: 12 %."
    scene.send(battery(1))
    scene.wait(15.0)
    (over,) = told(scene.alice)
    assert (over.id, over.closed_at) == (alert.id, NOW)
    assert scene.stored == [("battery-critical", True), ("battery-critical", False)]


@pytest.mark.parametrize(
    ("message", "rule"),
    [
        (mavlink.MAVLink_gps_raw_int_message(1, 1, 0, 0, 0, 80, 80, 0, 0, 3), "gps"),
        (mavlink.MAVLink_ekf_status_report_message(31, 0.1, 0.9, 0.1, 0.1, 0.0), "estimator"),
        (mavlink.MAVLink_vibration_message(1, 70.0, 1.0, 1.0, 0, 0, 0), "vibration"),
        (mavlink.MAVLink_fence_status_message(1, 1, 3, 0), "fence-breached"),
        (mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 12000, 0, 25, 0, 0, 0, 0, 0, 0), "battery-low"),
        (text("Radio Failsafe - RTL"), "failsafe"),
        (text("Compass 2 missing", 3), "autopilot-error"),
    ],
)
def test_messages_of_the_autopilot(message: object, rule: str) -> None:
    scene = Scene()
    scene.send(message)
    scene.wait(8.0)
    assert scene.open() == [rule]


def test_another_component_is_not_the_autopilot() -> None:
    scene = Scene()
    gimbal = build(battery(3), system_id=1, component_id=154, sequence=0)
    scene.agent.send(gimbal, now=0.0)
    scene.wait(5.0)
    assert scene.open() == []


def test_a_link_lost_in_the_air_and_back() -> None:
    scene = Scene()
    scene.wait(2.0)
    scene.wait(20.0, heard=False)
    (alert,) = told(scene.alice)
    assert alert.rule == "link-lost"
    assert "Drone 1 lost its link in the air" in alert.words
    scene.wait(5.0)
    (over,) = told(scene.alice)
    assert over.closed_at is not None
    assert over.acknowledged_at is None
    assert len(scene.hub.alerts.live()) == 1, "critical: it waits for a person"
    scene.hub.alerts.acknowledge(alert.id, scene.alice.browser.viewer)
    assert scene.hub.alerts.live() == []


def test_a_link_lost_on_the_ground() -> None:
    scene = Scene()
    scene.fly(armed=True, airborne=False)
    scene.wait(2.0)
    scene.wait(20.0, heard=False)
    assert scene.open() == ["link-lost-on-ground"]
    scene = Scene()
    scene.fly(armed=False, airborne=False)
    scene.wait(2.0)
    scene.wait(20.0, heard=False)
    assert scene.open() == []


def test_a_low_battery_stays_known_while_the_link_is_lost() -> None:
    scene = Scene()
    scene.send(battery(2))
    scene.wait(5.0)
    scene.wait(60.0, heard=False)
    assert scene.open() == ["battery-low", "link-lost"]


def test_a_drone_that_nobody_holds() -> None:
    scene = Scene()
    scene.hub.apply_lease(ONE, LeaseView(None, None, Epoch(2)), event="released", by=None, reason="", now=0.0)
    scene.wait(3.0)
    assert scene.open() == ["unattended"]
    scene.fly(armed=False, airborne=False)
    scene.wait(3.0)
    assert scene.open() == []


def test_a_hold_that_is_not_confirmed() -> None:
    scene = Scene()
    progress = HoldProgress(
        number=1, order_id=7, epoch=Epoch(1), step=HoldStep.UNCONFIRMED, detail="no answer", elapsed_ms=4000.0
    )
    scene.hub.reports.receive(scene.agent.link, progress, NOW)
    scene.wait(1.0)
    assert scene.open() == ["hold-unconfirmed"]
    confirmed = HoldProgress(number=2, order_id=8, epoch=Epoch(1), step=HoldStep.CONFIRMED, detail="", elapsed_ms=9.0)
    scene.hub.reports.receive(scene.agent.link, confirmed, NOW)
    scene.wait(1.0)
    assert scene.open() == []


def test_a_text_of_a_disarmed_autopilot_is_no_alert() -> None:
    scene = Scene()
    scene.fly(armed=False, airborne=False)
    scene.send(text("PreArm: Radio failsafe on", 2))
    scene.send(text("Radio Failsafe - RTL"))
    scene.wait(5.0)
    assert scene.open() == []


def test_a_crash_that_disarms_the_autopilot_waits_for_a_person() -> None:
    scene = Scene()
    scene.send(text("Crash: Disarming: AngErr=80>30", 2))
    scene.fly(armed=False, airborne=False)
    scene.wait(30.0)
    (alert,) = scene.hub.alerts.live()
    assert (alert.rule.name, alert.closed_at) == ("failsafe", NOW)
    assert "Crash: Disarming" in alert.words


def test_acknowledged_once_for_everybody() -> None:
    scene = Scene()
    admin = scene.world.browser(9)
    scene.send(battery(3))
    scene.wait(5.0)
    (alert,) = told(admin)
    scene.hub.alerts.acknowledge(alert.id, scene.alice.browser.viewer)
    (seen,) = told(admin)
    assert (seen.acknowledged_at, seen.acknowledged_by and seen.acknowledged_by.name) == (NOW, "alice")
    scene.hub.alerts.acknowledge(alert.id, admin.browser.viewer)
    assert told(admin) == [], "the first one counts"
    scene.wait(60.0)
    assert scene.stored == [("battery-critical", True), ("battery-critical", True)]


def test_a_stranger_sees_and_may_nothing() -> None:
    scene = Scene()
    bob = scene.world.browser(2)
    scene.send(battery(3))
    scene.wait(5.0)
    (alert,) = scene.hub.alerts.live()
    assert told(bob) == []
    with pytest.raises(UnknownAlert):
        scene.hub.alerts.acknowledge(alert.id, bob.browser.viewer)
    with pytest.raises(UnknownAlert):
        scene.hub.alerts.acknowledge(12345, scene.alice.browser.viewer)
    late = FakeBrowser(scene.hub, 2)
    (welcome,) = [event for event in late.events() if isinstance(event, live.WelcomeBrowser)]
    assert welcome.alerts == []


def test_the_welcome_has_what_is_open() -> None:
    scene = Scene()
    scene.send(battery(3))
    scene.wait(5.0)
    late = FakeBrowser(scene.hub, 1)
    (welcome,) = [event for event in late.events() if isinstance(event, live.WelcomeBrowser)]
    assert [alert.rule for alert in welcome.alerts] == ["battery-critical"]
    scene.wait(5.0)
    assert told(late) == [], "not a second time"


def test_an_observer_sees_and_may_not_acknowledge() -> None:
    scene = Scene()
    team = TeamRecord(id=1, name="team", crew={UserId(OLGA): TeamRole.OBSERVER}, since=datetime(2020, 1, 1, tzinfo=UTC))
    olga = scene.world.browser(OLGA)
    scene.send(battery(3))
    scene.wait(5.0)
    assert told(olga) == []
    one = record(1, (1,), holder=1, epoch=1)
    scene.world.apply(one.__class__(**{**one.__dict__, "team": team}), record(2, (2,)))
    scene.wait(1.0)
    (alert,) = told(olga)
    with pytest.raises(MayNotAcknowledge):
        scene.hub.alerts.acknowledge(alert.id, olga.browser.viewer)


def test_a_person_whose_view_was_taken_is_told_nothing() -> None:
    scene = Scene()
    admin, alice = UserRef(UserId(9), NAMES[9]), UserRef(UserId(1), NAMES[1])
    lease = LeaseView(admin, alice, Epoch(2), view_taken=True)
    scene.hub.apply_lease(ONE, lease, event="taken", by=admin, reason="", now=0.0)
    scene.send(battery(3))
    scene.wait(5.0)
    assert told(scene.alice) == []
    back = LeaseView(alice, None, Epoch(3))
    scene.hub.apply_lease(ONE, back, event="accepted", by=alice, reason="", now=scene.now)
    scene.wait(1.0)
    assert [alert.rule for alert in told(scene.alice)] == ["battery-critical"]


def test_a_removed_drone_ends_its_alerts() -> None:
    scene = Scene()
    scene.send(battery(3))
    scene.wait(5.0)
    scene.world.apply(record(2, (2,)))
    for step in range(10):
        scene.hub.tick(scene.now + step / 10)
    assert scene.hub.alerts.live() == []
    assert scene.stored[-1] == ("battery-critical", False)


def test_a_drone_of_another_tower_is_watched_there() -> None:
    scene = Scene()
    scene.send(battery(2))
    scene.wait(30.0)
    assert scene.open() == ["battery-low"]
    scene.hub.state.drones[ONE].place = Place.ELSEWHERE
    scene.wait(2.0)
    assert scene.open() == []
    scene.hub.state.drones[ONE].place = Place.HERE
    scene.send(battery(2))
    scene.wait(30.0)
    assert scene.open() == ["battery-low"]


def stored_alert(rule: str, number: int = 77, subject: str = "") -> Alert:
    return Alert(id=number, rule=BY_NAME[rule], subject=subject, drone_id=ONE, words="as stored", opened_at=NOW)


def test_what_was_open_before_a_restart_stays_until_the_drone_is_heard() -> None:
    world = HubWorld()
    world.hub.alerts.restore([stored_alert("link-lost"), stored_alert("battery-low", 78)], 0.0)
    world.hub.alerts.restore([stored_alert("failsafe", 79, "radio failsafe")], 0.0)
    for step in range(100):
        world.hub.tick(step / 10)
    assert {alert.id for alert in world.hub.alerts.live()} == {77, 78, 79}
    agent = world.agent(1)
    world.hub.reports.receive(agent.link, AutopilotState(heard=True, armed=True, airborne=True), NOW)
    for step in range(100, 200):
        agent.send(heartbeat(), now=step / 10)
        world.hub.tick(step / 10)
    left = {alert.id: alert.closed_at is None for alert in world.hub.alerts.live()}
    assert left.pop(77) is False, "it is heard again"
    assert left.pop(78), "nothing was said of its battery yet"
    assert left.pop(79), "nobody said that it is cleared"
    opened = {alert.rule.name for alert in world.hub.alerts.live() if alert.id in left}
    assert opened == {"unattended"}


def test_pairs_of_before_a_restart_are_over() -> None:
    world = HubWorld()
    changes: list[Alert] = []
    world.hub.alerts.listeners.append(changes.append)
    near = stored_alert("near", subject="1/2")
    near.other_id = DroneId(2)
    world.hub.alerts.restore([near], 0.0)
    assert world.hub.alerts.live() == []
    assert [alert.closed_at for alert in changes] == [NOW]


def test_alerts_that_wait_for_a_person_are_bounded() -> None:
    scene = Scene()
    for number in range(24):
        scene.send(text(f"{'abcdefgh'[number % 8]}{'klm'[number // 8]} failsafe"))
        scene.wait(1.0)
        scene.send(text(f"{'abcdefgh'[number % 8]}{'klm'[number // 8]} failsafe cleared"))
        scene.wait(15.0)
    assert len(scene.hub.alerts.live()) == 20
    assert scene.hub.alerts.opened["critical"] == 24


def test_commands_to_a_drone_are_no_alerts() -> None:
    scene = Scene()
    scene.agent.send(command_long(), now=0.0)
    scene.wait(2.0)
    assert scene.open() == []
