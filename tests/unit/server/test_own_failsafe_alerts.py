"""PX4's failsafe as an alert: begun and ended by its state, explained by its event, whatever its texts say."""

from __future__ import annotations

import struct

from hub_world import HubWorld, record

from server.live.live_messages import AlertChanged
from wire.autopilots.px4_events import event_id
from wire.control_messages import AutopilotState
from wire.dialect import EVENT, build, mavlink

ACTIVE, CRITICAL = mavlink.MAV_STATE_ACTIVE, mavlink.MAV_STATE_CRITICAL
LOITER = 4 << 16 | 3 << 24


def event(cause: int, action: int) -> bytes:
    head = struct.pack("<IIHBBB", event_id("commander_failsafe_enter"), 1, 1, 0, 0, 0x22)
    message = head + struct.pack("<IBB", LOITER, action, cause)
    frame = bytes((0xFD, len(message), 0, 0, 0, 1, 1, EVENT & 0xFF, EVENT >> 8, 0)) + message
    return frame + b"\0\0"


class Flown:
    """Drone 1 in the air, its state told once a second."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.world.apply(record(1, (1,), holder=1, epoch=5))
        self.alice, self.agent, self.now = self.world.browser(1), self.world.agent(1), 0.0
        state = AutopilotState(heard=True, armed=True, airborne=True, system_id=1)
        self.world.hub.reports.receive(self.agent.link, state, self.world.hub.state.clock())
        self.told: list[tuple[str, bool]] = []
        """Words of each alert about a failsafe or an emergency, and whether it is over."""

    def beats(self, status: int, *frames: bytes, seconds: int = 3) -> list[tuple[str, bool]]:
        beat = mavlink.MAVLink_heartbeat_message(2, mavlink.MAV_AUTOPILOT_PX4, 0x81, LOITER, status, 3)
        for _ in range(seconds):
            self.agent.send(build(beat, system_id=1, component_id=1, sequence=0), *frames, now=self.now)
            frames = ()
            for _ in range(10):
                self.now += 0.1
                self.world.hub.tick(self.now)
        told = [one.alert for one in self.alice.events() if isinstance(one, AlertChanged)]
        return [(one.words, one.closed_at is not None) for one in told if one.rule in ("failsafe", "emergency")]


def activated() -> bytes:
    text = mavlink.MAVLink_statustext_message(2, b"Failsafe activated")
    return build(text, system_id=1, component_id=1, sequence=0)


def test_a_text_alone_is_no_failsafe() -> None:
    flown = Flown()
    flown.beats(ACTIVE)
    assert flown.beats(ACTIVE, activated()) == []


def test_it_begins_and_ends_with_the_state_and_says_why() -> None:
    flown = Flown()
    flown.beats(ACTIVE)
    words = "The autopilot of Drone 1: its failsafe returns: no sticks arrive."
    assert flown.beats(CRITICAL, event(1, 6), activated()) == [(words, False)]
    assert flown.beats(ACTIVE) == [(words, True)]


def test_a_second_failsafe_is_not_hidden_by_the_first() -> None:
    flown = Flown()
    flown.beats(ACTIVE)
    flown.beats(CRITICAL, event(1, 6))
    told = flown.beats(CRITICAL, event(5, 7))
    lands = "The autopilot of Drone 1: its failsafe lands: the battery is nearly empty."
    assert (lands, False) in told
    assert [over for words, over in told if "no sticks" in words] == [True]
