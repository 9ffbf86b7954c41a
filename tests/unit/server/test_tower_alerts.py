"""Alerts about the tower itself: each rule opens once and clears, and only admins know of it."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import Final

import pytest
from hub_world import NOW, FakeBrowser, HubWorld

from server.alerts.core.alert import Alert
from server.alerts.core.announcer import Announcer, Happening
from server.alerts.core.refusals import UnknownAlert
from server.alerts.core.rules import BY_NAME, OF_TOWER
from server.alerts.core.service import LOOK_S, PARTS
from server.alerts.core.tower_conditions import DISK_FULL_BYTES
from server.alerts.core.tower_facts import Certificate, Disk, PartFails, StoodStill, StoredThere, TowerFacts
from server.alerts.core.views import AlertView
from server.alerts.store.channels.deliverer import message_of
from server.kernel.people import Principal
from server.live import live_messages as live
from server.storage.file_budget import MIN_FREE_BYTES

MB: Final = 1_000_000
WELL: Final = TowerFacts(
    disk=Disk(StoredThere.BOTH, 50_000 * MB),
    disk_low_bytes=2_000 * MB,
    certificate=Certificate("proxy:443", NOW + timedelta(days=60)),
)


def disk(free_bytes: float) -> TowerFacts:
    return replace(WELL, disk=Disk(StoredThere.BOTH, int(free_bytes)))


def certificate(**left: float) -> TowerFacts:
    return replace(WELL, certificate=Certificate("proxy:443", NOW + timedelta(**left)))


SCENES: Final = {
    "tower-disk-full": (
        disk(DISK_FULL_BYTES - 1),
        "The disk with the tower's data and recordings has 268 MB left.",
    ),
    "tower-disk-low": (disk(1_900 * MB), "The disk with the tower's data and recordings has 1900 MB left."),
    "tower-database-damaged": (
        replace(WELL, database_fault="Tree 12 page 80: btreeInitPage() returns error code 11"),
        "The file of the database is damaged: Tree 12 page 80: btreeInitPage() returns error code 11.",
    ),
    "tower-stands-still": (
        replace(WELL, stood_still=StoodStill(0.31, "server.airspace.api.list_zones")),
        "The tower stood still for 310 ms, in server.airspace.api.list_zones. Sticks came late.",
    ),
    "tower-part-fails": (
        replace(WELL, failing=PartFails("alerts", 3)),
        "The tower's part alerts had errors in the last ten minutes: 3. All else goes on.",
    ),
    "tower-certificate-ends": (
        certificate(days=2),
        "The TLS certificate (proxy:443) expires on 2026-01-03 at 00:00 UTC.",
    ),
    "tower-certificate": (
        certificate(days=13.5),
        "The TLS certificate (proxy:443) expires on 2026-01-14 at 12:00 UTC.",
    ),
}


class Scene:
    """An admin and an operator look on; no drone is concerned."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.alerts = self.world.hub.alerts
        self.alerts.tower_facts = WELL
        self.admin, self.alice = self.world.browser(9), self.world.browser(1)
        self.now = 0.0

    def wait(self, for_s: float) -> None:
        end = self.now + for_s
        while self.now < end:
            self.now += LOOK_S / PARTS
            self.world.hub.tick(self.now)

    def open(self) -> list[str]:
        return [alert.rule.name for alert in self.alerts.live() if alert.closed_at is None]


def told(browser: FakeBrowser) -> list[AlertView]:
    return [event.alert for event in browser.events() if isinstance(event, live.AlertChanged)]


def viewer(browser: FakeBrowser) -> Principal:
    return browser.browser.viewer


@pytest.mark.parametrize("rule", [rule.name for rule, _ in OF_TOWER])
def test_it_opens_once_and_clears_and_only_admins_know(rule: str) -> None:
    scene = Scene()
    scene.wait(100.0)
    assert scene.open() == []
    scene.alerts.tower_facts, words = SCENES[rule]
    scene.wait(300.0)
    opened = [alert for alert in told(scene.admin) if alert.rule == rule]
    assert [(alert.words, alert.drone_id, alert.closed_at) for alert in opened] == [(words, None, None)]
    scene.alerts.tower_facts = WELL
    scene.wait(100.0)
    over = [alert for alert in told(scene.admin) if alert.rule == rule]
    assert [(alert.id, alert.closed_at) for alert in over] == [(opened[0].id, NOW)]
    assert scene.open() == []
    assert told(scene.alice) == []


def test_the_limit_of_the_disk_has_a_way_back_and_can_be_turned_off() -> None:
    assert DISK_FULL_BYTES == MIN_FREE_BYTES, "what the store leaves free"
    scene = Scene()
    scene.alerts.tower_facts = disk(1_999 * MB)
    scene.wait(65.0)
    assert scene.open() == ["tower-disk-low"]
    scene.alerts.tower_facts = disk(2_200 * MB - 1)
    scene.wait(300.0)
    assert scene.open() == ["tower-disk-low"]
    scene.alerts.tower_facts = disk(2_200 * MB)
    scene.wait(65.0)
    assert scene.open() == []
    scene.alerts.tower_facts = replace(disk(DISK_FULL_BYTES - 1), disk_low_bytes=0)
    scene.wait(300.0)
    assert scene.open() == ["tower-disk-full"]


def test_a_short_peak_is_no_news() -> None:
    scene = Scene()
    for _ in range(5):
        scene.alerts.tower_facts = disk(1_000 * MB)
        scene.wait(30.0)
        scene.alerts.tower_facts = WELL
        scene.wait(30.0)
    assert told(scene.admin) == []


def test_what_cannot_be_measured_opens_and_closes_nothing() -> None:
    scene = Scene()
    scene.alerts.tower_facts = TowerFacts(disk_low_bytes=2_000 * MB)
    scene.wait(300.0)
    assert scene.open() == []
    scene.alerts.tower_facts = certificate(days=1)
    scene.wait(1.0)
    scene.alerts.tower_facts = TowerFacts()
    scene.wait(300.0)
    assert scene.open() == ["tower-certificate-ends", "tower-certificate"]


def test_a_certificate_that_has_expired() -> None:
    scene = Scene()
    scene.alerts.tower_facts = certificate(days=1)
    scene.wait(1.0)
    scene.alerts.tower_facts = certificate(hours=-1)
    scene.wait(1.0)
    newest = {alert.rule: alert for alert in told(scene.admin)}["tower-certificate-ends"]
    assert newest.words == "The TLS certificate (proxy:443) expired on 2025-12-31 at 23:00 UTC."


def test_an_admin_acknowledges_it_and_an_operator_does_not_know_it() -> None:
    scene = Scene()
    scene.alerts.tower_facts = certificate(days=1)
    scene.wait(1.0)
    alert = next(one for one in scene.alerts.live() if one.rule.name == "tower-certificate-ends")
    with pytest.raises(UnknownAlert):
        scene.alerts.acknowledge(alert.id, viewer(scene.alice))
    told(scene.admin)
    scene.alerts.acknowledge(alert.id, viewer(scene.admin))
    (seen,) = told(scene.admin)
    assert seen.acknowledged_by is not None
    assert (seen.id, seen.acknowledged_by.name) == (alert.id, "admin")


def test_a_browser_that_comes_later_gets_it_with_the_welcome_and_its_end() -> None:
    scene = Scene()
    scene.alerts.tower_facts = certificate(days=13)
    scene.wait(1.0)
    late = scene.world.browser(9)
    assert [alert.rule.name for alert in scene.alerts.visible(viewer(late))] == ["tower-certificate"]
    assert list(scene.alerts.visible(viewer(scene.alice))) == []
    scene.wait(5.0)
    assert told(late) == [], "the welcome had it"
    scene.alerts.tower_facts = WELL
    scene.wait(1.0)
    assert [alert.closed_at for alert in told(late)] == [NOW]


def stored(subject: str) -> Alert:
    return Alert(7, BY_NAME["tower-certificate"], subject, None, "before", NOW - timedelta(hours=1))


def test_after_a_restart_it_goes_on_under_its_number() -> None:
    scene = Scene()
    scene.alerts.restore([stored("")], 0.0)
    scene.alerts.tower_facts = certificate(days=13)
    scene.wait(10.0)
    assert [(alert.id, alert.closed_at) for alert in scene.alerts.live()] == [(7, None)]
    scene.alerts.tower_facts = WELL
    scene.wait(10.0)
    assert scene.alerts.live() == []


def test_that_of_a_tower_that_is_gone_ends() -> None:
    scene = Scene()
    gone = stored("0123456789abcdef")
    scene.alerts.restore([gone], 0.0)
    assert gone.closed_at == NOW
    assert scene.alerts.live() == []


def test_it_is_announced_and_nobody_answers() -> None:
    scene = Scene()
    announcer = Announcer(scene.world.hub.state, unanswered_after_s=120.0)
    scene.alerts.listeners.append(announcer.changed)
    scene.alerts.tower_facts = certificate(days=2)
    scene.wait(1.0)
    announcer.tick(NOW + timedelta(seconds=121))
    said = [(one.happening, one.alert.rule.name, one.drone_name) for one in announcer.taken()]
    assert said == [
        (Happening.OPENED, "tower-certificate-ends", ""),
        (Happening.OPENED, "tower-certificate", ""),
        (Happening.UNANSWERED, "tower-certificate-ends", ""),
    ]


def test_the_message_names_the_tower() -> None:
    content = {
        "id": "7",
        "words": "The disk with the tower's data has 100 MB left.",
        "badge": "Tower's disk full",
        "advice": "Free space on the tower.",
        "drone": None,
        "opened_at": "2026-05-01T12:00:00+00:00",
        "closed_at": None,
        "about_stranger": False,
        "url": "https://tower.example.org/#/admin/system",
    }
    message = message_of("opened", content, "7-opened-3")
    assert message.subject == "Control Tower: Tower's disk full"
    assert "#/admin/system" in message.text
