"""Which texts of an autopilot are alerts, how long they last, and how their chunks come together."""

import pytest

from server.alerts.core.status_texts import CHUNK_WAIT_S, StatusText, StatusTexts
from server.alerts.core.text_alerts import (
    BURST,
    ERROR_LASTS_S,
    EVERY_S,
    LASTS_AT_LEAST_S,
    MANY,
    MAX_LASTING,
    TextAlerts,
)
from wire.dialect import build, mavlink


def said(*texts: tuple[int, str], at: float = 0.0) -> dict[tuple[str, str], str]:
    alerts = TextAlerts()
    for severity, text in texts:
        alerts.take("Merlin", StatusText(severity, text), at)
    return alerts.found(at)


@pytest.mark.parametrize(
    ("severity", "text", "rule"),
    [
        (4, "Radio Failsafe - RTL", "failsafe"),
        (4, "GCS Failsafe", "failsafe"),
        (2, "Crash: Disarming: AngErr=80>30, Accel=2.4<3.0", "failsafe"),
        (2, "EKF variance: compass", "failsafe"),
        (1, "Potential Thrust Loss (3)", "failsafe"),
        (4, "Failsafe activated", "failsafe"),
        (3, "Mission: bad item", "autopilot-error"),
        (4, "Mode change failed", None),
        (6, "Failsafe settings loaded", None),
        (2, "PreArm: Radio failsafe on", None),
        (2, "Arm: RTL mode not armable", None),
    ],
)
def test_the_kind_of_a_text(severity: int, text: str, rule: str | None) -> None:
    assert [name for name, _ in said((severity, text))] == ([rule] if rule else [])


def test_a_failsafe_lasts_until_the_same_one_is_cleared() -> None:
    both = ((4, "Radio Failsafe - RTL"), (4, "GCS Failsafe"))
    assert len(said(*both)) == 2
    assert said(*both, (4, "Radio Failsafe Cleared")) == {
        ("failsafe", "gcs failsafe"): "The autopilot of Merlin says: GCS Failsafe"
    }
    assert said(*both, (5, "Radio Failsafe Cleared"), (5, "GCS Failsafe Cleared")) == {}


def test_disarming_ends_everything() -> None:
    alerts = TextAlerts()
    alerts.take("Merlin", StatusText(4, "Radio Failsafe - RTL"), 0.0)
    alerts.take("Merlin", StatusText(3, "Compass 2 missing"), 5.0)
    alerts.disarmed(40.0)
    assert alerts.found(40.0) == {}


def test_a_crash_that_disarms_at_once_is_told() -> None:
    alerts = TextAlerts()
    alerts.take("Merlin", StatusText(2, "Crash: Disarming"), 10.0)
    for at in (10.0, 10.0 + LASTS_AT_LEAST_S - 0.1):
        alerts.disarmed(at)
        assert [name for name, _ in alerts.found(at)] == ["failsafe"]
    alerts.disarmed(10.0 + LASTS_AT_LEAST_S)
    assert alerts.found(10.0 + LASTS_AT_LEAST_S) == {}


def test_an_error_ends_some_time_after_its_last_repetition() -> None:
    alerts = TextAlerts()
    for at in (0.0, 50.0):
        alerts.take("Merlin", StatusText(3, "Compass 2 missing"), at)
    assert len(alerts.found(50.0 + ERROR_LASTS_S - 1)) == 1
    assert alerts.found(50.0 + ERROR_LASTS_S) == {}


def test_many_texts_are_bounded() -> None:
    many = [(3, f"fault {word}") for word in ("a", "b", "c", "d", "e", "f", "g", "h", "i")]
    found = said(*many)
    assert len(found) == MAX_LASTING
    assert ("autopilot-error", "fault i") in found


def test_a_flood_becomes_one_alert() -> None:
    """A hostile vehicle sent 12 a second, each about something new: 9,594 messages to others found no room."""
    alerts, opened, before = TextAlerts(), 0, set[tuple[str, str]]()
    for number in range(720):
        now = number / 12
        letters = "".join(chr(97 + int(digit)) for digit in str(number))
        alerts.take("Merlin", StatusText(2, f"failsafe {letters}"), now)
        found = alerts.found(now)
        opened += len(found.keys() - before)
        before = set(found)
    assert opened <= BURST + 60 / EVERY_S + 1
    words = found["failsafe", MANY]
    assert words == "The autopilot of Merlin reports more than can be told one by one: read its messages."
    assert ("failsafe", MANY) not in alerts.found(now + ERROR_LASTS_S)
    alerts.take("Merlin", StatusText(2, "Radio failsafe"), now + 60)
    assert ("failsafe", "radio failsafe") in alerts.found(now + 60), "later it is told by name again"


def chunk(text: str, number: int, sequence: int, severity: int = 4) -> bytes:
    message = mavlink.MAVLink_statustext_message(severity, text.encode(), number, sequence)
    return build(message, system_id=1, component_id=1, sequence=0)


def test_a_text_in_one_piece() -> None:
    assert StatusTexts().take(chunk("Radio Failsafe", 0, 0), 0.0) == [StatusText(4, "Radio Failsafe")]


def test_chunks_come_together() -> None:
    texts = StatusTexts()
    first, last = "Radio Failsafe - continuing with the mission, as t", "he parameter says"
    assert len(first) == 50
    assert texts.take(chunk(first, 7, 0), 0.0) == []
    assert texts.take(chunk(last, 7, 1), 0.1) == [StatusText(4, first + last)]
    assert texts.overdue(99.0) == []


def test_what_came_of_a_text_is_read_when_the_rest_is_lost() -> None:
    texts = StatusTexts()
    first = "x" * 50
    assert texts.take(chunk(first, 7, 0), 0.0) == []
    assert texts.overdue(CHUNK_WAIT_S) == []
    assert texts.overdue(CHUNK_WAIT_S + 0.1) == [StatusText(4, first)]
    texts.take(chunk(first, 8, 0), 0.0)
    assert texts.take(chunk("another", 9, 0), 0.1) == [StatusText(4, first), StatusText(4, "another")]


RETURNS, LANDS = "its failsafe returns: no sticks arrive", "its failsafe lands: the battery is nearly empty"


def test_a_failsafe_that_the_state_shows_ends_with_it_and_the_next_one_is_another_alert() -> None:
    alerts = TextAlerts()
    alerts.acts("Merlin", RETURNS, "manual_control_loss", 0.0)
    (first,) = alerts.found(0.0)
    alerts.acts("Merlin", LANDS, "emergency_battery", 1.0)
    ((second, words),) = alerts.found(1.0).items()
    assert (first != second, words) == (True, f"The autopilot of Merlin: {LANDS}.")
    alerts.acts("Merlin", "", "", 2.0)
    assert alerts.found(2.0) == {}


def test_its_texts_do_not_count_where_the_state_shows_it() -> None:
    """PX4 says so in each return that a pilot commands without a receiver."""
    alerts = TextAlerts()
    for text in ("Failsafe activated", "Failsafe activated: entering Hold for 5 seconds"):
        alerts.take("Merlin", StatusText(2, text), 0.0, shows_failsafe=True)
    alerts.acts("Merlin", "", "", 0.0)
    assert alerts.found(0.0) == {}
    alerts.take("Merlin", StatusText(2, "Flight termination active"), 0.0, shows_failsafe=True)
    assert len(alerts.found(0.0)) == 1
