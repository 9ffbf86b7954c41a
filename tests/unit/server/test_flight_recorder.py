"""Which flights are recorded, and that each holds every frame of both directions and what happened."""

from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from io import BytesIO
from typing import Any

import msgspec
import pytest
from hub_world import NOW, HubWorld, command_long, heartbeat, record, sticks

from server.flights.core.recorder import (
    AFTER_S,
    DRONE_GONE,
    LINK_LOST,
    MAX_IN_A_ROW,
    MAX_LINE_BYTES,
    MAX_UNKNOWN_S,
    STICKS_REST_S,
    TEAM_CHANGED,
    FlightHead,
)
from server.flights.core.tape import IDLE_CHUNK_S
from server.flights.core.tlog import Entry, read_entries
from server.kernel.fleet import TeamRecord
from server.kernel.people import UserRef
from server.live.hub_events import SeparationLost
from wire.control_messages import AutopilotState, HoldProgress, HoldStep
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId
from wire.tagged import tag

ONE = DroneId(1)


@dataclass
class Sink:
    """What a flight would have on the disk."""

    head: FlightHead
    tlog: bytes = b""
    lines: list[dict[str, Any]] = field(default_factory=list)
    problem: str = ""
    ended: tuple[datetime, str] | None = None

    def frames(self, chunk: bytes, count: int) -> None:
        assert self.ended is None
        assert len(list(read_entries(BytesIO(chunk)))) == count
        self.tlog += chunk

    def event(self, line: bytes) -> None:
        assert len(line) <= MAX_LINE_BYTES
        self.lines.append(msgspec.json.decode(line))

    def end(self, at: datetime, words: str) -> None:
        self.ended = at, words

    def entries(self) -> list[Entry]:
        return list(read_entries(BytesIO(self.tlog)))

    def kinds(self, *kinds: str) -> list[dict[str, Any]]:
        return [line for line in self.lines if line["kind"] in kinds]


class Scene:
    def __init__(self, before_s: float | None = 60.0) -> None:
        self.world = HubWorld()
        self.now = 0.0  # when the agent signs in
        self.time_of_day = NOW
        self.hub = self.world.hub
        self.hub.state.clock = lambda: self.time_of_day
        self.sinks: list[Sink] = []
        self.takes = True
        self.hub.flights.before_s = before_s
        self.hub.flights.on_begin = self._begin
        self.world.apply(record(1, (1,), holder=1, epoch=3), record(2, (2,)))
        self.agent = self.world.agent(1, heard=False)
        self.browser = self.world.browser(1)

    def _begin(self, head: FlightHead) -> Sink | None:
        if not self.takes:
            return None
        self.sinks.append(Sink(head))
        return self.sinks[-1]

    def passes(self, seconds: float, *, frames: int = 0, step_s: float = 0.1) -> None:
        """Time, with so many heartbeats in each step."""
        for _ in range(round(seconds / step_s)):
            self.now += step_s
            self.time_of_day += timedelta(seconds=step_s)
            if frames:
                self.agent.send(*[heartbeat()] * frames, now=self.now)
            self.hub.flights.tick(self.now)

    def says(self, *, armed: bool, heard: bool = True) -> None:
        state = AutopilotState(heard=heard, armed=armed, airborne=armed)
        self.hub.reports.receive(self.agent.link, state, self.time_of_day)
        self.passes(0.5)

    def fly(self, frame: bytes) -> None:
        self.browser.send(tag(ONE, frame), now=self.now)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_a_flight_has_the_minute_before_and_every_frame_of_both_directions(scene: Scene) -> None:
    scene.passes(90.0, frames=1)
    scene.says(armed=True)
    scene.passes(5.0, frames=2)
    scene.fly(sticks())
    scene.fly(command_long())
    scene.says(armed=False)
    scene.passes(AFTER_S + 1)
    (sink,) = scene.sinks
    assert sink.ended is not None
    entries = sink.entries()
    armed_us = round(sink.head.began_at.timestamp() * 1e6)
    before = [entry for entry in entries if entry.at_us < armed_us]
    # a minute, in chunks of five seconds, ten frames a second
    assert 600 - 10 * IDLE_CHUNK_S <= len(before) <= 600 + 10 * IDLE_CHUNK_S
    assert len(entries) - len(before) == 2 * 50 + 2
    assert [entry.frame for entry in entries if entry.frame[7] not in (0,)] == [sticks(), command_long()]
    times = [entry.at_us for entry in entries]
    assert times == sorted(times)
    assert times[-1] - times[0] == pytest.approx(66e6, abs=6e6)
    # Nothing is counted twice or left out: what the traffic counts is in the file, but for what was too long ago.
    traffic = scene.hub.state.traffic
    passed = traffic.frames_from_agents + traffic.frames_to_agents
    assert passed - len(entries) == 900 - len(before)


def test_the_end_is_some_seconds_after_disarming(scene: Scene) -> None:
    scene.says(armed=True)
    scene.passes(30.0, frames=1)
    scene.says(armed=False)
    landed = scene.time_of_day
    scene.passes(AFTER_S - 1.5, frames=1)
    (sink,) = scene.sinks
    assert sink.ended is None
    scene.passes(3.0, frames=1)
    assert sink.ended is not None
    at, words = sink.ended
    assert (abs(at - landed) < timedelta(seconds=1), words) == (True, "")
    assert [one["kind"] for one in sink.kinds("armed", "disarmed", "end")] == ["armed", "disarmed", "end"]
    assert scene.hub.flights.counts == {"begun": 1, "ended": 1, "not_recorded": 0, "faults": 0}


def test_armed_again_is_another_flight(scene: Scene) -> None:
    scene.says(armed=True)
    scene.says(armed=False)
    scene.passes(2.0, frames=1)
    scene.says(armed=True)
    scene.passes(1.0)
    first, second = scene.sinks
    assert first.ended is not None
    assert second.ended is None


def test_a_lost_link_ends_no_flight(scene: Scene) -> None:
    scene.says(armed=True)
    scene.passes(5.0, frames=1)
    scene.hub.detach_link(scene.agent.link)
    scene.passes(MAX_UNKNOWN_S - 60, step_s=10)
    (sink,) = scene.sinks
    assert sink.ended is None
    assert sink.kinds("link_lost")
    scene.agent = scene.world.agent(1, link_id=555, heard=False)
    scene.says(armed=True)
    scene.passes(5.0, frames=1)
    assert len(scene.sinks) == 1
    assert sink.ended is None
    assert sink.kinds("link_back")
    assert len(sink.entries()) == 100
    scene.hub.detach_link(scene.agent.link)
    scene.passes(MAX_UNKNOWN_S + 20, step_s=10)
    assert sink.ended is not None
    assert sink.ended[1] == LINK_LOST


def test_the_index_has_who_flew_and_what_each_was_told(scene: Scene) -> None:
    scene.says(armed=True)
    scene.passes(0.1, frames=1)
    scene.fly(sticks())
    scene.passes(STICKS_REST_S + 1, frames=1)
    scene.hub.holds.order(ONE, "a test")
    order = next(iter(scene.hub.state.drones[ONE].orders))
    progress = HoldProgress(order_id=order, epoch=3, step=HoldStep.CONFIRMED, detail="BRAKE", elapsed_ms=210.0)
    scene.hub.reports.receive(scene.agent.link, progress, scene.time_of_day)
    lease = replace(scene.hub.state.drones[ONE].lease, holder=UserRef(UserId(9), "admin"), epoch=4)
    scene.hub.apply_lease(ONE, lease, event="taken", by=UserRef(UserId(9), "admin"), reason="test", now=scene.now)
    scene.hub.flights.noticed(SeparationLost(ONE, DroneId(2), 3.0, 4.0, 5.0))
    scene.hub.flights.note(ONE, "alert", {"what": "a battery is low"})
    (sink,) = scene.sinks
    (armed,) = sink.kinds("armed")
    assert armed["holder"] == {"id": 1, "name": "alice"}
    assert [(one["kind"], one["by"]["name"]) for one in sink.kinds("sticks", "sticks_rest")] == [
        ("sticks", "alice"),
        ("sticks_rest", "alice"),
    ]
    assert [(one["step"], one["detail"]) for one in sink.kinds("hold")] == [
        ("ordered", "a test"),
        ("confirmed", "BRAKE"),
    ]
    control = sink.kinds("control")[-1]
    assert (control["event"], control["holder"]["name"], control["reason"]) == ("taken", "admin", "test")
    assert [one["what"] for one in sink.kinds("alert")] == ["SeparationLost", "a battery is low"]
    assert sink.kinds("link")
    assert all(isinstance(one["at_us"], int) for one in sink.lines)


def test_what_happened_before_arming_is_in_the_index_too(scene: Scene) -> None:
    scene.hub.flights.note(ONE, "alert", {"what": "long ago"})
    scene.passes(61.0)
    scene.hub.flights.note(ONE, "alert", {"what": "just now"})
    scene.says(armed=True)
    (sink,) = scene.sinks
    assert [one["what"] for one in sink.kinds("alert")] == ["just now"]
    assert [one["kind"] for one in sink.lines[:2]] == ["alert", "armed"]


def test_a_drone_that_changes_its_team_takes_nothing_along(scene: Scene) -> None:
    """Neither the minute before nor a flight that goes on."""
    scene.passes(30.0, frames=1)
    _join_team(scene, 7)
    scene.passes(1.0)
    scene.says(armed=True)
    scene.passes(2.0, frames=1)
    (sink,) = scene.sinks
    assert len(sink.entries()) <= 10 * 2 + 1
    _join_team(scene, 8)
    scene.passes(1.0)
    first, second = scene.sinks
    assert first.ended is not None
    assert first.ended[1] == TEAM_CHANGED
    scene.passes(1.0, frames=1)
    assert 5 <= len(second.entries()) <= 15


def _join_team(scene: Scene, team_id: int) -> None:
    team = TeamRecord(team_id, f"team {team_id}", {}, scene.time_of_day)
    scene.world.apply(replace(record(1, (1,), holder=1, epoch=3), team=team), record(2, (2,)))


def test_a_deleted_drone_ends_its_flight(scene: Scene) -> None:
    scene.says(armed=True)
    scene.world.apply(record(2, (2,)))
    scene.passes(1.0)
    (sink,) = scene.sinks
    assert sink.ended is not None
    assert sink.ended[1] == DRONE_GONE


def test_a_disk_that_cannot_be_written_costs_the_recording_and_nothing_else(scene: Scene) -> None:
    scene.says(armed=True)
    scene.sinks[0].problem = "the tower's disk is full"
    scene.takes = False
    scene.passes(5.0, frames=1)
    assert scene.sinks[0].ended is not None
    assert scene.sinks[0].ended[1] == "the tower's disk is full"
    assert scene.browser.frames()
    scene.fly(command_long())
    assert scene.agent.received(scene.now)
    assert scene.hub.flights.counts["not_recorded"] == 1
    scene.takes = True
    scene.passes(120.0, frames=1)  # the next flight begins by itself
    assert len(scene.sinks) == 2


def test_a_fault_of_the_recorder_reaches_nobody(scene: Scene) -> None:
    def fails(*_: object) -> None:
        raise RuntimeError("a fault")

    scene.hub.flights.on_begin = fails
    scene.says(armed=True)
    scene.hub.flights._note = fails  # type: ignore
    scene.browser.events()
    scene.world.apply(record(1, (1,), holder=2, epoch=4), record(2, (2,)))
    scene.passes(5.0)
    assert scene.browser.events()
    assert scene.hub.flights.counts["faults"] > 2


def test_arming_again_and_again_makes_few_flights(scene: Scene) -> None:
    for _ in range(50):
        scene.says(armed=True)
        scene.says(armed=False)
    assert MAX_IN_A_ROW <= len(scene.sinks) <= MAX_IN_A_ROW + 3
    assert scene.hub.flights.counts["not_recorded"] >= 30


def test_the_key_of_signed_mavlink_is_never_recorded(scene: Scene) -> None:
    secret = mavlink.MAVLink_setup_signing_message(1, 1, list(b"secret key of thirty-two bytes!!"), 5)
    frame = build(secret, system_id=1, component_id=1, sequence=0)
    scene.says(armed=True)
    scene.agent.send(heartbeat(), frame, heartbeat(), now=scene.now)
    scene.passes(1.0)
    assert b"secret" not in scene.sinks[0].tlog
    assert len(scene.sinks[0].entries()) == 2


def test_a_clock_that_was_set_spoils_no_flight(scene: Scene) -> None:
    scene.passes(10.0, frames=1)
    scene.time_of_day += timedelta(hours=1)
    scene.says(armed=True)
    scene.passes(2.0, frames=1)
    (sink,) = scene.sinks
    times = [entry.at_us for entry in sink.entries()]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(scene.time_of_day.timestamp() * 1e6, abs=1e6)


@pytest.mark.parametrize("by", [timedelta(days=1095), timedelta(seconds=-40)])
def test_a_clock_that_is_set_in_flight_is_marked_and_adds_nothing(scene: Scene, by: timedelta) -> None:
    scene.says(armed=True)
    scene.passes(10.0, frames=1)
    scene.time_of_day += by
    scene.passes(10.0, frames=1)
    scene.hub.flights.note(ONE, "video", {})
    scene.says(armed=False)
    scene.passes(AFTER_S + 1, frames=1)
    (sink,) = scene.sinks
    began, ended = sink.head.began_at, sink.ended
    assert ended is not None
    assert (ended[0] - began).total_seconds() == pytest.approx(20.5, abs=0.6)
    times = [line["at_us"] for line in sink.lines if line["kind"] != "flight"]
    assert times == sorted(times)
    assert (times[-1] - times[0]) / 1e6 == pytest.approx(30.0, abs=2.0)
    (jump,) = sink.kinds("clock_set")
    assert jump["by_s"] == pytest.approx(by.total_seconds())
    (disarmed,) = sink.kinds("disarmed")
    assert disarmed["at_us"] <= sink.entries()[-1].at_us


def test_without_the_setting_nothing_is_kept() -> None:
    scene = Scene(before_s=None)
    scene.passes(10.0, frames=1)
    scene.says(armed=True)
    scene.passes(10.0, frames=1)
    assert scene.sinks == []
    assert scene.hub.state.drones[ONE].tape is None


def test_a_line_that_is_too_long_is_cut(scene: Scene) -> None:
    scene.says(armed=True)
    scene.hub.flights.note(ONE, "command", {"about": "x" * 100_000})
    assert scene.sinks[0].kinds("command")[0]["too_long"] > 100_000


def test_a_thousand_idle_drones_share_the_memory() -> None:
    """The worst case is bounded, whatever they send."""
    world = HubWorld()
    world.hub.flights.before_s = 60.0
    numbers = range(1, 1001)
    world.apply(*[record(number, (1,)) for number in numbers])
    for number in numbers:
        world.agent(number, heard=False)
    tapes = [drone.tape for drone in world.hub.state.drones.values()]
    assert all(tape is not None for tape in tapes)
    assert sum(tape.ring_bytes for tape in tapes if tape is not None) <= 128 * 1024 * 1024
    tape = tapes[0]
    assert tape is not None
    for second in range(60):
        for _ in range(10):
            tape.add([bytes((0xFD, 255, *bytes(265 + 0)))] * 30, 1000.0 + second)
    assert tape.kept_bytes <= tape.ring_bytes
