"""Drones near each other: one alert with both names, or one about "another drone", by what a person may see."""

import pytest
from hub_world import FakeBrowser, record
from test_separation_notifier import KNOWN_S, NearWorld

from server.airspace.core.separation.bounds import Level
from server.airspace.core.separation.strangers import Rounded
from server.alerts.core.pair_alerts import stranger_words
from server.alerts.core.refusals import UnknownAlert
from server.alerts.core.views import AlertView
from server.live import live_messages as live


def told(browser: FakeBrowser) -> list[AlertView]:
    return [event.alert for event in browser.events() if isinstance(event, live.AlertChanged)]


def pairs(browser: FakeBrowser) -> list[AlertView]:
    return [alert for alert in told(browser) if alert.rule in {"near", "too-near"}]


def test_who_may_see_both_reads_both_names_and_who_may_see_one_does_not() -> None:
    world = NearWorld()
    alice, bob, admin = world.browser(1), world.browser(2), world.browser(9)
    world.fly(KNOWN_S)
    (both,) = pairs(admin)
    assert (both.rule, both.severity, both.drone_id, both.other_id) == ("too-near", "critical", 1, 2)
    assert both.words == "Drone 1 and Drone 2 are 6 m apart, 3 m in height."
    for browser, own, other in ((alice, 1, 2), (bob, 2, 1)):
        (alert,) = pairs(browser)
        assert (alert.drone_id, alert.other_id, alert.rule) == (own, None, "too-near")
        assert f"Drone {own} and another drone" in alert.words
        assert f"Drone {other}" not in alert.words
    assert len({alert.id for alert in world.hub.alerts.live()} - {both.id}) == len(world.hub.alerts.live()) - 1


def test_an_alert_of_a_pair_ends_for_all_who_were_told() -> None:
    world = NearWorld()
    alice, admin = world.browser(1), world.browser(9)
    world.fly(KNOWN_S)
    opened = [pairs(browser)[0] for browser in (alice, admin)]
    world.places[2] = (0.0, 500.0, 53.0)
    world.fly(8.0)
    for browser, alert in zip((alice, admin), opened, strict=True):
        closed = [one for one in pairs(browser) if one.id == alert.id]
        assert closed[-1].closed_at is not None


def test_nobody_acknowledges_what_is_told_to_others() -> None:
    world = NearWorld()
    alice, bob, admin = world.browser(1), world.browser(2), world.browser(9)
    world.fly(KNOWN_S)
    (hers,), (his,), (both,) = pairs(alice), pairs(bob), pairs(admin)
    service = world.hub.alerts
    for alert_id, who in ((his.id, alice), (both.id, alice), (hers.id, bob), (hers.id, admin)):
        with pytest.raises(UnknownAlert):
            service.acknowledge(alert_id, who.browser.viewer)
    service.acknowledge(hers.id, alice.browser.viewer)
    assert pairs(bob) == [] == pairs(admin)
    service.acknowledge(both.id, admin.browser.viewer)


def test_who_comes_to_see_both_is_told_with_names() -> None:
    world = NearWorld()
    alice = world.browser(1)
    world.fly(KNOWN_S)
    pairs(alice)
    world.apply(record(1, (1,)), record(2, (1, 2)))
    world.fly(2.0)
    assert [alert.other_id for alert in pairs(alice)] == [2]


@pytest.mark.parametrize(
    ("about", "words"),
    [
        (
            Rounded(Level.CAUTION, 15, 90, 120, 5),
            "will be close in about 15 s. Seen from Heron it is about 120 m to the",
        ),
        (Rounded(Level.CAUTION, 15, 90, 120, 5), "to the east (090°), about 5 m higher."),
        (Rounded(Level.WARNING, 0, 30, 120, 0), "are near each other. Seen from Heron"),
        (Rounded(Level.WARNING, 0, 30, 120, 0), "north-east (030°), at about the same height."),
        (Rounded(Level.WARNING, 0, 330, 20, -10), "north-west (330°), about 10 m lower."),
        (Rounded(Level.CAUTION), "Heron and another drone are near each other."),
    ],
)
def test_words_for_strangers(about: Rounded, words: str) -> None:
    assert words in stranger_words(about, "Heron")
