"""What is announced of alerts: the beginning and the end once each, what nobody answers, and nothing of a bench."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

import pytest
from hub_world import HubWorld, record

from server.alerts.core.alert import Alert
from server.alerts.core.announcer import RECENT, Announcer, Happening
from server.alerts.core.rules import BY_NAME
from server.alerts.core.severity import Severity
from server.alerts.store.channels.deliverer import message_of
from server.alerts.store.channels.outbox import is_wanted
from wire.ids import DroneId

BEGAN = datetime(2026, 5, 1, 12, tzinfo=UTC)


class Scene:
    def __init__(self) -> None:
        self.world = HubWorld()
        self.world.apply(record(1, (1,)))
        self.drone = self.world.hub.state.drones[DroneId(1)]
        self.drone.armed = self.drone.airborne = True
        self.announcer = Announcer(self.world.hub.state, unanswered_after_s=120.0)
        self.ids: Iterator[int] = iter(range(1, 10_000))

    def alert(self, rule: str = "link-lost") -> Alert:
        number = next(self.ids)
        return Alert(number, BY_NAME[rule], str(number), DroneId(1), f"words {number}", BEGAN)

    def said(self) -> list[tuple[Happening, int]]:
        return [(one.happening, one.alert.id) for one in self.announcer.taken()]


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_the_beginning_and_the_end_are_announced_once(scene: Scene) -> None:
    alert = scene.alert()
    for _ in range(3):
        scene.announcer.changed(alert)
    assert scene.said() == [(Happening.OPENED, 1)]
    alert.closed_at = BEGAN + timedelta(seconds=5)
    for _ in range(2):
        scene.announcer.changed(alert)
    assert scene.said() == [(Happening.CLOSED, 1)]


def test_the_end_of_what_was_not_announced_is_no_news(scene: Scene) -> None:
    alert = scene.alert()
    alert.closed_at = BEGAN
    scene.announcer.changed(alert)
    assert scene.said() == []


@pytest.mark.parametrize(
    ("armed", "airborne", "rule", "announced"),
    [
        (False, False, "silent", False),
        (False, None, "silent", False),
        (True, False, "silent", True),
        (None, None, "silent", True),
        (False, True, "silent", True),
        (False, False, "hold-unconfirmed", True),
    ],
)
def test_a_drone_on_the_bench_calls_nobody(
    scene: Scene, armed: bool | None, airborne: bool | None, rule: str, announced: bool
) -> None:
    scene.drone.armed, scene.drone.airborne = armed, airborne
    scene.announcer.changed(scene.alert(rule))
    assert bool(scene.said()) is announced


def test_what_nobody_answers_is_announced_again_once(scene: Scene) -> None:
    alert = scene.alert()
    scene.announcer.changed(alert)
    scene.announcer.changed(scene.alert("unattended"))
    scene.said()
    scene.announcer.tick(BEGAN + timedelta(seconds=119))
    assert scene.said() == []
    for later_s in (120, 125, 900):
        scene.announcer.tick(BEGAN + timedelta(seconds=later_s))
    assert scene.said() == [(Happening.UNANSWERED, alert.id)], "a warning waits for nobody"


@pytest.mark.parametrize("ends", ["acknowledged_at", "closed_at"])
def test_an_answer_or_the_end_stops_it(scene: Scene, ends: str) -> None:
    alert = scene.alert()
    scene.announcer.changed(alert)
    setattr(alert, ends, BEGAN + timedelta(seconds=60))
    scene.announcer.changed(alert)
    scene.said()
    scene.announcer.tick(BEGAN + timedelta(seconds=500))
    assert scene.said() == []


def test_after_a_restart_only_what_is_recent_is_announced(scene: Scene) -> None:
    recent, old, over = scene.alert(), scene.alert(), scene.alert()
    old.opened_at = BEGAN - RECENT
    over.closed_at = BEGAN
    scene.announcer.restored([recent, old, over], BEGAN + timedelta(seconds=1))
    assert scene.said() == [(Happening.OPENED, recent.id)]
    old.closed_at = BEGAN + timedelta(seconds=2)
    scene.announcer.changed(old)
    assert scene.said() == [(Happening.CLOSED, old.id)], "its end is"


def test_what_opened_on_the_bench_is_announced_when_the_drone_is_armed(scene: Scene) -> None:
    scene.drone.armed = scene.drone.airborne = False
    scene.announcer.changed(scene.alert("silent"))
    scene.announcer.tick(BEGAN)
    assert scene.said() == []
    scene.drone.armed = True
    for _ in range(2):
        scene.announcer.tick(BEGAN)
    assert scene.said() == [(Happening.OPENED, 1)]


def test_what_could_not_be_stored_waits_in_order_and_is_bounded(scene: Scene) -> None:
    for _ in range(3):
        scene.announcer.changed(scene.alert())
    taken = scene.announcer.taken()
    scene.announcer.changed(scene.alert())
    scene.announcer.give_back(taken)
    assert [number for _, number in scene.said()] == [1, 2, 3, 4]
    of_the_tower = Alert(0, BY_NAME["tower-disk-full"], "", None, "The disk is full.", BEGAN)
    scene.announcer.changed(of_the_tower)
    for _ in range(100 + 5):
        scene.announcer.changed(scene.alert())
    said = scene.said()
    assert len(said) == 100 + 1
    assert (Happening.OPENED, of_the_tower.id) in said, "a flood of one drone displaces nothing of others"


def test_a_channel_gets_what_is_as_severe_or_more() -> None:
    wanted = [[is_wanted(severity, least) for severity in Severity] for least in Severity]
    assert wanted == [[True, False, False], [True, True, False], [True, True, True]]


def test_the_words_name_the_drone_and_say_what_to_do() -> None:
    content = {
        "id": "7",
        "words": "Merlin lost its link in the air.",
        "badge": "Lost in the air",
        "advice": "Keep its area clear.",
        "drone": {"id": 1, "name": "Merlin"},
        "opened_at": "2026-05-01T12:00:00.123+00:00",
        "closed_at": None,
        "about_stranger": False,
        "url": "https://tower.example.org/#/drone/1",
    }
    message = message_of("opened", content, "7-opened-3")
    assert message.subject == "Merlin: Lost in the air"
    assert message.text == (
        "Merlin lost its link in the air.\n\nKeep its area clear.\n\nSince 2026-05-01 12:00:00 UTC\n\n"
        "https://tower.example.org/#/drone/1\n"
    )
    assert "about_stranger" not in message.content
    over = message_of("closed", content | {"closed_at": "2026-05-01T12:00:09+00:00"}, "7-closed-3")
    assert over.subject == "Over: Merlin: Lost in the air"
    assert over.text.startswith("Over: Merlin lost its link in the air.\n\nSince 2026-05-01 12:00:00 UTC\nOver at")
