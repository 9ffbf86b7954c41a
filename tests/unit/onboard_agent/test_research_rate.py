"""The black box at a research rate: what the autopilot is asked for, and what the tower gets all the same."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.autopilot.rates import RATE_REQUESTS, RESEARCH, Rates
from onboard_agent.cli import parse_black_box_hz
from onboard_agent.onboard import Onboard
from onboard_agent.unusable import Unusable
from simulator.ardupilot import ARDUPILOT
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.vehicle import Vehicle, VehicleSettings
from wire.dialect import build, decode, mavlink
from wire.frames import message_id

ATTITUDE, CHANNELS = mavlink.MAVLINK_MSG_ID_ATTITUDE, mavlink.MAVLINK_MSG_ID_RC_CHANNELS
OUTPUTS = mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW
FLOWN_S = 10.0


def asked(rates: Rates) -> dict[int, float]:
    """Answers every request, and returns the rates in Hz."""
    rates.ask_all(1.0)
    found, now = {}, 1.0
    for _ in range(200):
        now += 0.05
        frame = rates.due(now, vehicle_system_id=1)
        message = None if frame is None else decode(frame)
        if message is None:
            continue
        if message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            found[int(message.param1)] = 1e6 / message.param2
        rates.acknowledged(mavlink.MAVLink_command_ack_message(message.command, 0), now)
    return found


@pytest.mark.parametrize("narrow_line", [False, True])
def test_attitude_sticks_and_outputs_are_asked_for_and_nothing_else_changes(narrow_line: bool) -> None:
    usual, faster = asked(Rates(FrameMaker())), asked(Rates(FrameMaker(), narrow_line=narrow_line, research_hz=100.0))
    assert {message: faster[message] for message in RESEARCH} == pytest.approx(dict.fromkeys(RESEARCH, 100.0))
    assert OUTPUTS not in usual
    others = {one.message_id for one in RATE_REQUESTS if one.rate_hz} - set(RESEARCH)
    assert {message: faster[message] for message in others} == {message: usual[message] for message in others}


def test_the_setting_is_0_or_10_to_100() -> None:
    assert [parse_black_box_hz(text) for text in ("0", "10", "50", "100")] == [0, 10, 50, 100]
    for text in ("9", "101", "-1", "fast", "", "1.5"):
        with pytest.raises(Unusable, match="black_box_hz"):
            parse_black_box_hz(text)


class Drone:
    """A simulated vehicle and its agent, on one clock."""

    def __init__(self, research_hz: float) -> None:
        self.recorded: list[tuple[float, bytes]] = []
        self.sent: Counter[int] = Counter()
        self.now = 100.0
        flight = FlightSettings(place=Place(47.4, 8.5, 400.0), boot_s=0.5, seed=1)
        self._vehicle = Vehicle(VehicleSettings(flight, flavour=ARDUPILOT), ())
        self._onboard = Onboard(
            now=self.now,
            speaks_first=True,
            research_hz=research_hz,
            record=lambda frames, now: self.recorded.extend((now, frame) for frame in frames),
        )

    def fly(self, seconds: float) -> None:
        for step in range(round(seconds / 0.005)):
            self.now += 0.005
            self._vehicle.step(self.now - 100.0)
            passed = self._onboard.from_autopilot(self._vehicle.datagrams_to_send(), self.now)
            if step % 5 == 0:
                self._onboard.tick(self.now)
                passed += self._onboard.frames_to_tower(self.now)
            self.sent.update(message_id(frame) for frame in passed)
            for frame in self._onboard.frames_to_autopilot():
                self._vehicle.receive(frame, self.now - 100.0)


def test_the_black_box_has_50_a_second_without_a_gap_and_the_tower_no_more_than_before() -> None:
    usual, faster = Drone(0.0), Drone(50.0)
    for drone in (usual, faster):
        drone.fly(6.0)
        drone.recorded.clear()
        drone.sent.clear()
        drone.fly(FLOWN_S)
    for message in (ATTITUDE, CHANNELS, OUTPUTS):
        times = [at for at, frame in faster.recorded if message_id(frame) == message]
        assert len(times) == pytest.approx(50 * FLOWN_S, rel=0.02), message
        assert max(later - before for before, later in itertools.pairwise(times)) < 0.03
    for message, usual_hz in RESEARCH.items():
        assert faster.sent[message] <= usual_hz * FLOWN_S + 2
    assert faster.sent[ATTITUDE] == pytest.approx(usual.sent[ATTITUDE], abs=3)
    assert faster.sent[CHANNELS] == pytest.approx(usual.sent[CHANNELS], abs=2)


def test_what_others_send_is_spaced_by_sender() -> None:
    from onboard_agent.telemetry.spacing import Spacing

    spacing = Spacing({ATTITUDE: 10.0})
    attitude = mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0)
    ours, other = (build(attitude, system_id=1, component_id=part, sequence=0) for part in (1, 2))
    beat = build(mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 0, 3), system_id=1, component_id=1, sequence=0)
    passed = [len(spacing.admit([ours, other, beat], at / 100)) for at in range(100)]
    assert sum(passed) == 100 + 2 * 10
    assert passed[0] == 3
