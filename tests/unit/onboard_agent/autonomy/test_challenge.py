"""The controller `challenge` on a simulated vehicle and a fake clock; its eyes see by geometry instead of pictures."""

from __future__ import annotations

from dataclasses import dataclass
from math import dist
from typing import Any

import pytest
from controller_world import ControllerWorld
from drone_world import BRAKE, HOME, LOITER, SET_MODE, mavlink

from onboard_agent.autonomy.challenge import Challenge
from onboard_agent.autonomy.core.lines import VideoBox
from onboard_agent.autonomy.look import InPicture
from onboard_agent.autonomy.pose_history import Pose
from onboard_agent.autonomy.target_watch import TargetSeen
from simulator.geodesy import LocalFrame
from wire.controllers import ControllerWork
from wire.dialect import decode
from wire.findings import FINDINGS, SIGHTINGS, TargetFound
from wire.plans import PlanItem, PlanKind
from wire.transactions import Outcome, PlanUploadWork, TransactionProgress

FRAME = LocalFrame(HOME)
CAMERA = ("down,tilt=90,fov=75 http://127.0.0.1:1/camera",)
LETTERS = "ABK"


def on_map(north_m: float, east_m: float) -> tuple[float, float]:
    place = FRAME.to_place(north_m, east_m, 0.0)
    return place.lat_deg, place.lon_deg


@dataclass
class Eyes:
    """A TargetWatch: sees targets (letter, north, east) within a square of as many metres as it is high, four times a
    second. `reads`: whether it can read letters."""

    targets: list[tuple[str, float, float]]
    reads: bool = True
    words: str = ""
    world: ControllerWorld | None = None
    next_at: float = 0.0
    in_video: bool = False

    def __call__(self, *_: Any) -> Eyes:
        return self

    def start(self) -> None: ...

    def pop(self) -> list[TargetSeen]:
        world = self.world
        assert world is not None
        if world.now < self.next_at:
            return []
        self.next_at = world.now + 0.25
        north, east, up = world.where
        for number, (letter, target_north, target_east) in enumerate(self.targets):
            if max(abs(target_north - north), abs(target_east - east)) < up / 2:
                seen = InPicture(number, (0.0, 0.0), letter if self.reads else None, 0.8, b"jpeg")
                pose = Pose(0.0, 0.0, up, 0.0, 0.0, 0.0)
                box = VideoBox(0.5, 0.25, 0.1, 0.2, world.now - 0.3) if self.in_video else None
                return [TargetSeen(world.now, *on_map(target_north, target_east), pose, seen, box)]
        return []


def flown(
    eyes: Eyes, *, mission: bool = True, takes: tuple[str, ...] = (FINDINGS, SIGHTINGS), **settings: str | float
) -> tuple[ControllerWorld, int]:
    """In a world where a mission of three way-points is on board, at the start of the controller."""
    challenge = Challenge()
    challenge.make_watch = eyes  # type: ignore[assignment]
    grips = (("GRIP_ENABLE", 1.0), ("SERVO9_FUNCTION", 28.0))
    world = ControllerWorld(challenge, cameras=CAMERA, takes=("transactions", *takes), parameters=grips)
    eyes.world = world
    world.ready()
    if mission:
        places = [on_map(north, east) for north, east in ((20.0, 0.0), (20.0, 20.0), (0.0, 20.0))]
        items = tuple(PlanItem(16, 3, x=round(lat * 1e7), y=round(lon * 1e7), z=10.0) for lat, lon in places)
        upload = world.begin(PlanUploadWork(PlanKind.MISSION, items), deadline_s=60.0)
        world.until(lambda: bool(world.results(upload)), 60.0, "the mission")
    work = ControllerWork("challenge", may_take_off=True, settings={"alphabet": LETTERS, **settings})
    return world, world.begin(work, deadline_s=600.0)


def ended(world: ControllerWorld, number: int) -> Any:
    world.until(lambda: bool(world.results(number)), 400.0, "the end")
    return world.results(number)[-1]


def found(world: ControllerWorld) -> list[TargetFound]:
    return [one for one in world.reported if isinstance(one, TargetFound) and not one.sighting]


def sightings(world: ControllerWorld) -> list[TargetFound]:
    return [one for one in world.reported if isinstance(one, TargetFound) and one.sighting]


def releases(world: ControllerWorld, since: int = 0) -> int:
    """`since`: how many frames to pass over."""
    frames = [decode(frame) for frame in world.sent[since:]]
    return sum(
        one is not None and one.get_type() == "COMMAND_LONG" and one.command == mavlink.MAV_CMD_DO_GRIPPER
        for one in frames
    )


def texts(world: ControllerWorld) -> str:
    return " ".join(one.text for one in world.seen if one.get_type() == "STATUSTEXT")


def test_it_finds_its_letter_drops_over_it_and_lands_at_home() -> None:
    world, number = flown(Eyes([("A", 12.0, 1.0), ("K", 21.0, 12.0)]), letter="K")
    home = world.where[:2]
    dropped_at: list[tuple[float, float, float]] = []
    looked_at = 0

    def over() -> bool:
        nonlocal looked_at
        if not dropped_at and releases(world, looked_at):
            dropped_at.append(world.where)
        looked_at = len(world.sent)
        return bool(world.results(number))

    world.until(over, 400.0, "the end")
    result = world.results(number)[-1]
    assert result.outcome is Outcome.DONE, result
    assert "has landed it" in result.words
    assert [one.letter for one in found(world)] == ["K", "K"]
    lat, lon = on_map(21.0, 12.0)
    assert found(world)[-1].lat_deg == pytest.approx(lat, abs=1e-6)
    assert found(world)[-1].lon_deg == pytest.approx(lon, abs=1e-6)
    assert releases(world) == 1
    north, east, up = dropped_at[0]
    assert dist((north, east), (21.0, 12.0)) < 0.5
    assert 2.4 < up < 3.6
    assert dist(world.where[:2], home) < 1.5
    assert "Payload landed at" in texts(world)


def test_a_target_in_view_of_the_video_is_shown_at_most_five_times_a_second() -> None:
    world, number = flown(Eyes([("K", 12.0, 1.0)], in_video=True), letter="K")
    assert ended(world, number).outcome is Outcome.DONE
    shown = sightings(world)
    assert len(shown) > 20
    box = shown[-1].in_video
    assert box is not None
    assert (box.x, box.y, box.width, box.height) == (0.5, 0.25, 0.1, 0.2)
    assert 0.3 <= box.age_s < 0.6
    assert shown[-1].letter == "K"
    assert not any(one.thumbnail for one in shown)
    assert [one.in_video is not None for one in found(world)] == [True, True]


@pytest.mark.parametrize(("in_video", "takes"), [(True, (FINDINGS,)), (False, (FINDINGS, SIGHTINGS))])
def test_no_sighting_goes_to_an_older_tower_or_of_another_camera(in_video: bool, takes: tuple[str, ...]) -> None:
    world, number = flown(Eyes([("K", 12.0, 1.0)], in_video=in_video), takes=takes, letter="K")
    assert ended(world, number).outcome is Outcome.DONE
    assert sightings(world) == []
    assert len(found(world)) == 2


def test_it_says_that_it_found_nothing_and_comes_home() -> None:
    world, number = flown(Eyes([("A", 20.0, 10.0)]), letter="K")
    assert ended(world, number).outcome is Outcome.DONE
    assert "nothing was found" in texts(world)
    assert found(world) == []
    assert releases(world) == 0


def test_an_unread_letter_does_not_count() -> None:
    world, number = flown(Eyes([("K", 20.0, 10.0)], reads=False), letter="K")
    assert ended(world, number).outcome is Outcome.DONE
    assert "nothing was found" in texts(world)
    assert releases(world) == 0


def test_the_search_has_a_time() -> None:
    world, number = flown(Eyes([]), search_s=10.0)
    assert ended(world, number).outcome is Outcome.DONE
    assert "nothing was found in time" in texts(world)


def test_points_replace_the_mission() -> None:
    lat, lon = on_map(15.0, 0.0)
    world, number = flown(Eyes([("K", 15.0, 1.0)]), mission=False, points=f"{lat},{lon}")
    assert ended(world, number).outcome is Outcome.DONE
    assert releases(world) == 1


def test_without_a_mission_it_searches_around_its_start() -> None:
    world, number = flown(Eyes([("B", 9.0, 9.0), ("K", -13.0, -14.0)]), mission=False, letter="K")
    assert ended(world, number).outcome is Outcome.DONE
    assert [one.letter for one in found(world)] == ["K", "K"]
    assert releases(world) == 1


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"around_m": 0.0}, "no mission on board"),
        ({"points": "somewhere"}, "is not LAT,LON"),
        ({"colour": "red"}, "colour: is no setting"),
        ({"letter": "Z"}, "letter: 'Z' is not made of characters of ABK"),
        ({"letter": "ABKA"}, "letter: must have at most 3 characters"),
        ({"target": "white 2"}, "has not 2 to 6 squares"),
        ({"search_height_m": "high"}, "search_height_m: must be a number"),
        ({"search_height_m": 2.0}, "drop_height_m: must not be above"),
    ],
)
def test_what_it_cannot_do_it_refuses_on_the_ground(settings: dict[str, str | float], why: str) -> None:
    world, number = flown(Eyes([]), mission=False, **settings)
    result = ended(world, number)
    assert result.outcome is Outcome.REFUSED
    assert why in result.words
    assert not world.vehicle.flight.armed


def test_blindness_leads_home() -> None:
    eyes = Eyes([])
    world, number = flown(eyes)
    world.until(lambda: "way-point" in phase(world, number), 60.0, "the search")
    eyes.words = "the process that looks for the target has ended (code 1)"
    assert ended(world, number).outcome is Outcome.DONE
    assert "the vision failed" in texts(world)


def phase(world: ControllerWorld, number: int) -> str:
    phases = [one.phase for one in world.reported if isinstance(one, TransactionProgress) and one.id == number]
    return phases[-1] if phases else ""


@pytest.mark.parametrize("stage", ["taking off", "searching", "descending"])
def test_a_take_ends_it_in_every_stage(stage: str) -> None:
    world, number = flown(Eyes([("K", 20.0, 10.0)]), letter="K")
    world.until(lambda: stage in phase(world, number), 200.0, stage)
    world.change_epoch()
    taken_at = world.now
    world.run(5.0)
    assert world.results(number)[-1].outcome is Outcome.STALE_EPOCH
    late = [at for at, _ in world.setpoints(taken_at + 0.05)]
    assert late == []
    assert not world.port.running


def test_a_hold_of_somebody_ends_it() -> None:
    world, number = flown(Eyes([("K", 20.0, 10.0)]), letter="K")
    world.until(lambda: "descending" in phase(world, number), 200.0, "the descent")
    world.tower_sends(mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, LOITER, 0, 0, 0, 0, 0))
    world.run(3.0)
    assert world.results(number)[-1].outcome is Outcome.FAILED
    assert releases(world) == 0
    assert world.modes_sent(0.0)[-1][1] != BRAKE
