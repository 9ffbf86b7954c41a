"""The process runs while the drone is armed, and LANDING_TARGET goes out while it flies."""

from __future__ import annotations

from dataclasses import replace

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.landing.handler import LandingTargetHandler
from onboard_agent.landing.sighting_line import SightingLine, decode_line, encode_line
from onboard_agent.transactions.handler import Around
from onboard_agent.vision.landing_target import landing_target
from wire.dialect import decode

FLYING = Around(
    system_id=7,
    autopilot_kind=3,
    vehicle_type=2,
    heard=True,
    armed=True,
    airborne=True,
    custom_mode=9,
    starting=False,
    flown_by_hand=False,
    holding=False,
    commanded=0,
    narrow_line=False,
)
PARKED = replace(FLYING, armed=False, airborne=False)


class Port:
    def __init__(self) -> None:
        self.asked: list[bool] = []
        self.waiting: list[SightingLine] = []

    def look(self, wanted: bool) -> None:
        self.asked.append(wanted)

    def sightings(self) -> list[SightingLine]:
        waiting, self.waiting = self.waiting, []
        return waiting


def line(taken_s: float, number: int = 1) -> SightingLine:
    return SightingLine(
        taken_s, landing_target((0.0, 0.1, 4.0), time_us=round(taken_s * 1e6), kind=2, number=number, distance_m=4.0)
    )


def test_nothing_is_started_before_the_drone_is_armed() -> None:
    handler = LandingTargetHandler(FrameMaker(), lambda: (_ for _ in ()).throw(AssertionError("started")))
    assert handler.due(PARKED, 1.0) == []
    assert handler.due(replace(FLYING, heard=False), 1.1) == []


def test_it_looks_while_armed_and_sends_while_flying() -> None:
    port = Port()
    handler = LandingTargetHandler(FrameMaker(), lambda: port)
    port.waiting = [line(10.0)]
    assert handler.due(replace(FLYING, airborne=False), 10.05) == []
    port.waiting = [line(10.1, 3), line(10.2, 4)]
    (frame,) = handler.due(FLYING, 10.25)
    message = decode(frame)
    assert message is not None
    assert (message.get_srcSystem(), message.target_num, message.time_usec) == (7, 4, 10_200_000)
    assert handler.due(PARKED, 10.5) == []
    assert port.asked == [True, True, False]


def test_the_lines_come_back_as_they_were() -> None:
    assert decode_line(encode_line(line(12.5))) == line(12.5)
