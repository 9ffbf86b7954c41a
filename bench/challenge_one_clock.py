"""A flight of `bench challenge` in one process and on one clock: the agent's core, the controller, the simulated
vehicle, and target finding in pictures that the simulator's camera draws. A busy machine changes nothing but the time.

Pictures are compressed as the camera does it, and what they show reaches the controller after `LATENCY_S`.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Sequence
from typing import Any, Final

import cv2
import msgspec
import numpy as np

from bench.challenge_task import Flown, Task, apart_m, mission, on_map
from bench.rig import HOME
from onboard_agent.autonomy.camera_settings import parse_cameras
from onboard_agent.autonomy.cameras import ControllerCameras, Frame
from onboard_agent.autonomy.challenge import Challenge
from onboard_agent.autonomy.core.lines import Beat, Directed, Note, Raised, Ready, Report, Seen, SetUp
from onboard_agent.autonomy.look import Looked, loaded_finder, target_in
from onboard_agent.autonomy.pose_history import PoseHistory
from onboard_agent.autonomy.service import ControllerHandler
from onboard_agent.autonomy.target_watch import TargetWatch
from onboard_agent.onboard import Onboard
from simulator.airframe_model import AirframeModel
from simulator.ardupilot import ARDUPILOT
from simulator.camera.scene import Scene
from simulator.camera.targets import GroundTarget, parse_target
from simulator.camera.view import Pose
from simulator.flight_state import FlightSettings
from simulator.geodesy import LocalFrame, Place
from simulator.vehicle import Vehicle, VehicleSettings
from wire.control_messages import Welcome
from wire.controllers import ControllerWork
from wire.dialect import decode
from wire.findings import FINDINGS, TargetFound
from wire.plans import PlanKind
from wire.transactions import PlanUploadWork, Transaction, TransactionProgress, TransactionResult

GRIPS: Final = (("GRIP_ENABLE", 1.0), ("SERVO9_FUNCTION", 28.0))
STEP_S: Final = 0.005
TICK_EVERY: Final = 5
"""Steps."""
BEGAN_S: Final = 1000.0
BOOT_S: Final = {AirframeModel.EXACT: 0.5, AirframeModel.SENSING: 2.0}
"""A filter starts from what its sensors say in three tenths of this."""
PICTURES_HZ: Final = 4.0
LATENCY_S: Final = 0.15
WIDTH_PX, HEIGHT_PX = 640, 480
CAMERA: Final = "down,tilt=90,fov=75,up=0.25 http://127.0.0.1:1/camera"
WITHIN_S: Final = 500.0
_LANDED: Final = re.compile(r"Payload landed at (-?[\d.]+),(-?[\d.]+)")


class MemoryJournal:
    """A JournalStore for the length of a flight."""

    def __init__(self) -> None:
        self._records: dict[PlanKind, bytes] = {}

    def load(self, kind: PlanKind) -> bytes | None:
        """Returns the record, or None."""
        return self._records.get(kind)

    def save(self, kind: PlanKind, record: bytes) -> None:
        """Keeps it."""
        self._records[kind] = record

    def remove(self, kind: PlanKind) -> None:
        """Forgets it."""
        self._records.pop(kind, None)


class PictureWatch(TargetWatch):
    """Instead of a process: draws what the camera sees now, and finds the target in it."""

    world: World

    def start(self) -> None:
        """Loads the finder."""
        self._finder = loaded_finder(self._target, self._alphabet)
        self._due: deque[tuple[float, bytes]] = deque()
        self._next_at = self.world.now
        self._count = 0

    def _lines(self) -> list[bytes]:
        now = self.world.now
        if now >= self._next_at:
            self._next_at += 1.0 / PICTURES_HZ
            self._count += 1
            frame = Frame(self._camera, self.world.picture(), now, self._count, PoseHistory())
            looked = Looked(self._count, now, WIDTH_PX, HEIGHT_PX, target_in(self._finder, frame))
            self._due.append((now + LATENCY_S, msgspec.json.encode(looked)))
        lines = []
        while self._due and self._due[0][0] <= now:
            lines.append(self._due.popleft()[1])
        return lines


class StepPort:
    """A ControllerPort: the controller's steps run at once when telemetry comes."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._controller: Challenge | None = None
        self._reports: list[tuple[float, Report]] = []
        self._number = 0
        self._beat_at = 0.0

    def start(self, set_up: SetUp) -> None:
        """Makes the controller."""
        controller = Challenge()
        self._poses = PoseHistory()
        self._cameras = ControllerCameras(set_up.cameras, self._poses)
        controller.cameras = self._cameras
        controller.make_watch = self._watch  # type: ignore[assignment]
        controller.report = self._say
        controller.note = lambda words, aloud: self._say(Note(words, aloud))
        try:
            controller.begin(set_up)
        except Exception as error:
            self._say(Raised(f"{type(error).__name__}: {error}"))
            return
        self._controller = controller
        self._say(Ready())

    def _watch(self, cameras: ControllerCameras, name: str, target: str, alphabet: str) -> TargetWatch:
        watch = PictureWatch(cameras, name, target, alphabet)
        watch.world = self._world
        return watch

    def _say(self, report: Report) -> None:
        self._reports.append((self._world.now, report))

    def say(self, seen: Seen) -> None:
        """A step."""
        if self._controller is None:
            return
        self._poses.add(seen)
        direction = self._controller.step(seen)
        if direction is not None:
            self._number += 1
            self._say(Directed(self._number, direction))

    def reports(self) -> Sequence[tuple[float, Report]]:
        """With a sign of life ten times a second."""
        if self._controller is not None and self._world.now - self._beat_at >= 0.1:
            self._beat_at = self._world.now
            self._say(Beat(self._cameras.taken))
        reports, self._reports = self._reports, []
        return reports

    def waited_s(self) -> float:
        """Never: it runs on the world's clock."""
        return 0.0

    def stop(self) -> None:
        """Forgets the controller."""
        self._controller, self._reports = None, []


class World:
    """One vehicle, its land, and its agent."""

    def __init__(self, task: Task, seed: int, model: AirframeModel) -> None:
        self.now = BEGAN_S
        self.reported: list[Any] = []
        self.texts: list[str] = []
        home = Place(*HOME)
        wind, wind_from = task.wind
        flight = FlightSettings(
            place=home, boot_s=BOOT_S[model], wind_mps=wind, wind_from_deg=wind_from, seed=seed, model=model
        )
        self.vehicle = Vehicle(VehicleSettings(flight, flavour=ARDUPILOT, parameters=GRIPS), ())
        frame, targets = LocalFrame(home), []
        for number, text in enumerate(task.targets, start=seed):
            letter, lat, lon, heading, side, colour = parse_target(text)
            targets.append(GroundTarget(letter, *frame.to_local(lat, lon), heading, side, number, colour))
        self._scene = Scene(seed, [], targets=targets, light=task.light)
        self._steps = self._ids = 0
        cameras = parse_cameras([CAMERA])
        self._onboard = Onboard(
            now=self.now,
            speaks_first=True,
            journal=MemoryJournal(),
            make_handlers=lambda maker: [ControllerHandler(maker, {}, lambda: StepPort(self), cameras=cameras)],
        )
        self._onboard.welcomed(
            Welcome(
                drone_id=1,
                name="Kestrel",
                link_id=1,
                public_key=b"k" * 32,
                udp_port=1,
                epoch=1,
                holder="operator",
                holder_present=True,
                takes=("transactions", FINDINGS),
            ),
            self.now,
        )

    def picture(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """What the camera sees now."""
        body = self.vehicle.flight.body
        north_m, east_m, height_m, quaternion = body.true_pose
        pose = Pose(north_m, east_m, height_m - body.ground_m(), quaternion)
        drawn = self._scene.draw(pose, WIDTH_PX, HEIGHT_PX, tilt_deg=90, now_s=self.now)
        _, jpeg = cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, 85])
        return np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), np.uint8)

    def run(self, seconds: float) -> None:
        """Advances the clock."""
        for _ in range(round(seconds / STEP_S)):
            self._step()

    def _step(self) -> None:
        self._steps += 1
        self.now += STEP_S
        self.vehicle.step(self.now - BEGAN_S)
        frames = self.vehicle.datagrams_to_send()
        self._read(self._onboard.from_autopilot(frames, self.now))
        if self._steps % TICK_EVERY == 0:
            self._onboard.tower_heard(self.now)
            self._onboard.tick(self.now)
            self._read(self._onboard.frames_to_tower(self.now))
        for frame in self._onboard.frames_to_autopilot():
            self.vehicle.receive(frame, self.now - BEGAN_S)
        self.reported += self._onboard.messages_to_tower(self.now)

    def _read(self, frames: list[bytes]) -> None:
        messages = [message for message in map(decode, frames) if message is not None]
        self.texts += [one.text for one in messages if one.get_type() == "STATUSTEXT"]

    def work(self, work: Any, within_s: float) -> TransactionResult:
        """Does a piece of work. Raises TimeoutError."""
        self._ids += 1
        number = self._ids
        self._onboard.message(Transaction(id=number, epoch=1, deadline_s=within_s, work=work), self.now)
        until = self.now + within_s + 200.0
        while self.now < until:
            self.run(0.1)
            for one in self.reported:
                if isinstance(one, TransactionResult) and one.id == number:
                    return one
        raise TimeoutError(f"{type(work).__name__} never ended")


def fly_on_one_clock(task: Task, seed: int, model: AirframeModel) -> Flown:
    """Flies one task. Raises TimeoutError."""
    cv2.setNumThreads(1)
    world = World(task, seed, model)
    world.run(BOOT_S[model] + 2.5)
    uploaded = world.work(PlanUploadWork(PlanKind.MISSION, mission()), 30.0)
    began_at = world.now
    end = world.work(ControllerWork("challenge", may_take_off=True, settings=task.settings), WITHIN_S)
    found = [one for one in world.reported if isinstance(one, TargetFound)]
    phases = [one.phase for one in world.reported if isinstance(one, TransactionProgress) and "searching" in one.phase]
    truth = on_map(*task.place_m)
    landed = _LANDED.search(" ".join(world.texts))
    return Flown(
        f"{end.words}" if uploaded.outcome == "done" else uploaded.words,
        apart_m((found[-1].lat_deg, found[-1].lon_deg), truth) if found else None,
        None if landed is None else apart_m((float(landed[1]), float(landed[2])), truth),
        found[-1].letter if found else "",
        world.now - began_at,
        phases[-1] if phases else "",
    )
