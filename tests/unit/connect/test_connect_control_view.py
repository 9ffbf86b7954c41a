"""The terminal's report on who flies, and the selection of drone, address and tower."""

import json
from typing import Any

import pytest

from connect.addresses import endpoints_of
from connect.control_view import MAX_REMEMBERED, REPEATED_AFTER_S, ControlView
from connect.squad import choose
from connect.tower_url import parse_tower_url
from connect.unusable import Unusable
from wire.ids import DroneId

ANNA, ROOT = {"id": 1, "name": "Anna"}, {"id": 9, "name": "Root"}


def drone(**changes: Any) -> dict[str, Any]:
    base = {"id": 3, "name": "Kestrel", "online": True, "holder": None, "taken_from": None, "offered": False}
    return base | changes


def reported(view: ControlView, now: float = 0.0, **event: Any) -> list[str]:
    view.event(json.dumps(event), now)
    return view.pop_sentences()


@pytest.fixture
def view() -> ControlView:
    made = ControlView(DroneId(3), "Kestrel")
    user = ANNA | {"role": "operator"}
    assert reported(made, type="welcome", user=user, drones=[drone()], server_time="") == ["Kestrel is online"]
    return made


def test_a_ping_is_answered_at_once(view: ControlView) -> None:
    assert view.event('{"type": "ping", "sequence": 7}', 0.0) == [{"type": "pong", "sequence": 7}]


def test_the_controls_come_and_are_taken(view: ControlView) -> None:
    assert not view.has_controls
    assert reported(view, type="drone", drone=drone(holder=ANNA)) == ["you have the controls of Kestrel"]
    assert view.has_controls
    taken = reported(view, type="drone", drone=drone(holder=ROOT, taken_from=ANNA))
    assert taken == ["you do NOT have the controls of Kestrel"]
    assert not view.has_controls
    said = reported(view, type="control", drone_id=3, event="taken", epoch=2, holder=ROOT, by=ROOT, reason="gusts")
    assert said == ["Root took control: gusts"]


def test_an_offer_says_what_to_do(view: ControlView) -> None:
    reported(view, type="drone", drone=drone(holder=ROOT, taken_from=ANNA, offered=True))
    said = reported(view, type="control", drone_id=3, event="given", epoch=3, holder=ROOT, by=ROOT, reason="")
    assert said[0] == "Root gives the controls back"
    assert "type accept" in said[1]


def test_refusals_are_said_and_not_repeated_all_the_time(view: ControlView) -> None:
    refused = {
        "type": "notice",
        "severity": "error",
        "code": "not-in-control",
        "drone_id": 3,
        "text": "No.",
        "count": 1,
    }
    assert reported(view, 0.0, **refused) == ["No."]
    for second in range(1, 10):
        assert reported(view, float(second), **refused | {"count": 5}) == []
    assert reported(view, REPEATED_AFTER_S, **refused) == ["No. (46 times)"]
    for number in range(3 * MAX_REMEMBERED):
        reported(view, 20.0, **refused | {"text": f"No {number}."})
    assert len(view._said_at) <= MAX_REMEMBERED


def test_a_loss_check_that_is_asked_for_is_remembered(view: ControlView) -> None:
    reported(view, type="notice", severity="warning", code="loss-check", drone_id=3, text="Read it.", count=1)
    assert view.loss_check_asked


def test_other_drones_and_unknown_events_are_nothing(view: ControlView) -> None:
    assert reported(view, type="drone", drone=drone(id=4, name="Merlin", online=False)) == []
    assert reported(view, type="hold", drone_id=4, step="ordered", detail="x", elapsed_ms=0, cause="order") == []
    assert reported(view, type="something-new", drone_id=3) == []
    view.event("not json", 0.0)
    view.event("[1]", 0.0)
    for half in ({"type": "ping"}, {"type": "turn", "drone_id": 3}, {"type": "drone", "drone": 3}, {"type": "welcome"}):
        assert reported(view, **half) == []
    assert not view.out_of_squad
    reported(view, type="drone_removed", drone_id=3)
    assert view.out_of_squad


SQUAD = [{"id": 1, "name": "Kestrel"}, {"id": 2, "name": "Merlin"}, {"id": 3, "name": "2"}]


def test_a_drone_is_named_or_numbered() -> None:
    assert choose(SQUAD, "kestrel").drone_id == 1
    assert choose(SQUAD, "1").name == "Kestrel"
    with pytest.raises(Unusable, match="there is no drone Osprey in your squad; there is Kestrel"):
        choose(SQUAD, "Osprey")
    with pytest.raises(Unusable, match="name of one drone and the id of another"):
        choose(SQUAD, "2")
    with pytest.raises(Unusable, match="none at all"):
        choose([], "Kestrel")


@pytest.mark.parametrize(
    "text", ["https://tower.example", "http://127.0.0.1:8000/", "http://localhost", "http://[::1]:1"]
)
def test_towers(text: str) -> None:
    url = parse_tower_url(text)
    assert url.live(watch_only=True) == text.rstrip("/").replace("http", "ws", 1) + "/api/v1/live?scopes=watch"


@pytest.mark.parametrize(
    "text",
    ["tower.example", "http://tower.example", "https://a:b@tower", "https://tower/x", "ftp://tower", "https://t:x"],
)
def test_what_is_no_tower(text: str) -> None:
    with pytest.raises(Unusable):
        parse_tower_url(text)


def test_endpoints() -> None:
    (usual,) = endpoints_of(udp=[], udp_listen=[], tcp=[], other_machines=False)
    assert usual.name == "udp 127.0.0.1:14550"
    both = endpoints_of(udp=[], udp_listen=["[::1]:0"], tcp=["localhost:5760"], other_machines=False)
    assert [one.name for one in both] == ["udp ::1:0", "tcp localhost:5760"]
    for bad in ("14550", "127.0.0.1:0", "127.0.0.1:x", "127.0.0.1:65536", ":14550"):
        with pytest.raises(Unusable, match="must be HOST:PORT"):
            endpoints_of(udp=[bad], udp_listen=[], tcp=[], other_machines=False)
    with pytest.raises(Unusable, match="--other-machines"):
        endpoints_of(udp=[], udp_listen=[], tcp=["0.0.0.0:5760"], other_machines=False)
    assert endpoints_of(udp=["192.0.2.1:14550"], udp_listen=[], tcp=[], other_machines=True)
