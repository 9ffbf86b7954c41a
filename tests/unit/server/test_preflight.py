"""The preflight checklist: what each line says, how long a reason or a signature counts."""

from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest
from hub_world import HubWorld, record

from server.kernel.people import UserRef
from server.readiness.core.arming_texts import MAX_REASONS, REPEATED_WITHIN_S, ArmingTexts
from server.readiness.core.checks import CheckLine, LineState, PreflightFacts, preflight_lines
from server.readiness.core.facts_of import REMOTE_ID_WITHIN_S, preflight_facts
from server.readiness.core.signature import VALID_FOR, Signature, SignedLine, after_report
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId

NOON = datetime(2026, 5, 1, 12, tzinfo=UTC)
READY = PreflightFacts(
    online=True,
    heard=True,
    hears_agent=True,
    rtt_ms=40.0,
    loss=0.0,
    arming_ok=True,
    battery_percent=97,
    battery_charge=1,
    gps_fix=3,
    satellites=14,
    has_home=True,
    return_height_m=15.0,
    loss_complete=True,
    plan_known=True,
    fence_known=True,
    fence_items=5,
)


def _line(key: str, **changes: object) -> CheckLine:
    facts = PreflightFacts(**{**READY.__dict__, **changes})  # type: ignore[arg-type]
    return next(line for line in preflight_lines(facts) if line.key == key)


def test_a_ready_drone_has_only_good_lines() -> None:
    assert {line.state for line in preflight_lines(READY)} == {LineState.GOOD}


def test_a_drone_without_a_remote_id_transmitter_has_no_line_of_it() -> None:
    assert "remote-id" not in {line.key for line in preflight_lines(READY)}
    there = [line.key for line in preflight_lines(PreflightFacts(**{**READY.__dict__, "remote_id": ""}))]
    assert there[2:4] == ["arming", "remote-id"]


@pytest.mark.parametrize(
    ("status", "error", "problem"),
    [
        (1, b"missing operator location", "missing operator location"),
        (1, b"", "it gives no reason"),
        (0, b"", ""),
        (0, b"late words", ""),
        (1, b"x" * 50, "x" * 50),
        (1, b"caf\xc3\xa9 \xff", "caf\u00e9 \ufffd"),
    ],
)
def test_what_the_transmitter_says_is_read_and_forgotten(status: int, error: bytes, problem: str) -> None:
    world = HubWorld()
    world.apply(record(1, (1,)))
    agent = world.agent(1)
    message = mavlink.MAVLink_open_drone_id_arm_status_message(status, error)
    agent.send(build(message, system_id=1, component_id=236, sequence=0), now=100.0)
    world.hub.reports.receive(agent.link, AutopilotState(heard=True, armed=False, airborne=False), NOON)
    drone = world.hub.state.drones[DroneId(1)]
    loss = SimpleNamespace(complete=True, sentences=(), acknowledged=False)
    assert preflight_facts(drone, loss, 100.0 + REMOTE_ID_WITHIN_S).remote_id == problem
    assert preflight_facts(drone, loss, 100.1 + REMOTE_ID_WITHIN_S).remote_id is None


def test_what_is_not_known_is_never_good() -> None:
    states = {line.key: line.state for line in preflight_lines(PreflightFacts())}
    assert states.pop("link") is LineState.BAD
    assert set(states.values()) == {LineState.UNKNOWN}


@pytest.mark.parametrize(
    ("key", "changes", "state", "words"),
    [
        ("link", {"heard": False}, LineState.BAD, "its autopilot is silent"),
        ("link", {"rtt_ms": 700.0}, LineState.CAUTION, "700 ms"),
        ("answers", {"hears_agent": None}, LineState.UNKNOWN, "not known yet"),
        ("answers", {"hears_agent": True}, LineState.GOOD, "answers its agent"),
        ("answers", {"hears_agent": False}, LineState.BAD, "cannot be held"),
        ("arming", {"arming_ok": False}, LineState.BAD, "has not said why yet"),
        ("arming", {"arming_ok": False, "remote_id": "missing operator location"}, LineState.BAD, "Remote ID: missing"),
        ("arming", {"remote_id": "missing operator location"}, LineState.GOOD, "ready to arm"),
        (
            "remote-id",
            {"remote_id": "missing operator location"},
            LineState.BAD,
            "not ready: missing operator location.",
        ),
        ("remote-id", {"remote_id": ""}, LineState.GOOD, "is ready"),
        ("arming", {"arming_words": ("Compass not calibrated",)}, LineState.BAD, "Compass not calibrated"),
        ("battery", {"battery_percent": 60}, LineState.CAUTION, "60 %"),
        ("battery", {"battery_percent": 20}, LineState.BAD, "20 %"),
        ("battery", {"battery_charge": 3}, LineState.BAD, "low or faulty"),
        ("position", {"gps_fix": 1}, LineState.BAD, "No position fix, 14 satellites"),
        ("position", {"gps_fix": 1, "gps_number": 2}, LineState.BAD, "No position fix of GPS 2, 14 satellites"),
        ("position", {"satellites": 6}, LineState.CAUTION, "6 satellites"),
        ("home", {"has_home": False}, LineState.UNKNOWN, "not reported a home"),
        ("return-height", {"return_height_m": 5.0}, LineState.CAUTION, "5 m"),
        ("return-height", {"return_height_m": 0.0}, LineState.CAUTION, "the height that the drone has then"),
        ("failsafes", {"loss_dangers": 2}, LineState.BAD, "2 dangers on a loss, not acknowledged"),
        ("failsafes", {"loss_warnings": 1}, LineState.CAUTION, "1 warning in"),
        ("plan", {"plan_items": 1}, LineState.GOOD, "a mission of 1 item is on board"),
        ("plan", {"plan_fits": False}, LineState.BAD, "upload it again"),
        ("fence", {"fence_items": 0}, LineState.CAUTION, "No fence"),
    ],
)
def test_each_line(key: str, changes: dict[str, object], state: LineState, words: str) -> None:
    line = _line(key, **changes)
    assert line.state is state
    assert words.lower() in line.words.lower()


def test_a_reason_counts_while_it_is_repeated() -> None:
    texts = ArmingTexts()
    texts.take("PreArm: Compass not calibrated", 0.0)
    texts.take("Preflight Fail: No connection to the GCS", 1.0)
    texts.take("EKF3 IMU0 is using GPS", 2.0)
    texts.take("PreArm: Compass not calibrated", 30.0)
    assert texts.now(31.0) == ("No connection to the GCS", "Compass not calibrated")
    assert texts.now(1.5 + REPEATED_WITHIN_S) == ("Compass not calibrated",)
    for number in range(2 * MAX_REASONS):
        texts.take(f"PreArm: reason {number}", 40.0)
    assert len(texts.now(40.0)) == MAX_REASONS
    texts.forget()
    assert texts.now(40.0) == ()


def test_a_signature_is_for_one_flight_and_an_hour() -> None:
    signed = Signature(UserRef(UserId(7), "Ada"), NOON, (SignedLine("Propellers tight", "confirmed"),))
    assert signed.is_valid(NOON + VALID_FOR - timedelta(seconds=1))
    assert not signed.is_valid(NOON + VALID_FOR)
    assert after_report(signed, armed=False) is signed
    assert after_report(signed, armed=None) is signed
    flying = after_report(signed, armed=True)
    assert flying is not None
    assert flying.is_valid(NOON + 3 * VALID_FOR)  # a long flight keeps its own
    assert after_report(flying, armed=None) is flying
    assert after_report(flying, armed=False) is None
    assert after_report(None, armed=True) is None


def test_reasons_against_arming_reach_the_checklist_while_it_is_disarmed() -> None:
    world = HubWorld()
    agent = world.agent(1)
    drone = world.hub.state.drones[DroneId(1)]
    for armed, words in ((False, "PreArm: Compass not calibrated"), (False, "EKF3 IMU0 is using GPS"), (True, "Crash")):
        drone.armed = armed
        agent.send(
            build(mavlink.MAVLink_statustext_message(4, words.encode()), system_id=1, component_id=1, sequence=0)
        )
    drone.telemetry.decode(0.0)
    assert drone.telemetry.arming_texts.now(0.0) == ("Compass not calibrated",)
    assert [one.text for one in drone.telemetry.texts] == ["Crash"], "only of the armed autopilot there are alerts"
