"""The agent's core with a simulated vehicle and a controller in the same process, all on one fake clock."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent / "transactions"))
from drone_world import DroneWorld

from onboard_agent.autonomy.camera_settings import parse_cameras
from onboard_agent.autonomy.cameras import ControllerCameras
from onboard_agent.autonomy.controller import Controller, Direction
from onboard_agent.autonomy.core.lines import Beat, Directed, Note, Raised, Ready, Report, Seen, SetUp
from onboard_agent.autonomy.pose_history import PoseHistory
from onboard_agent.autonomy.service import ControllerHandler
from wire.controllers import ControllerWork
from wire.dialect import decode

SETPOINTS = ("SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT")


class Script(Controller):
    """Gives the directions that a test has put in, one per step."""

    def __init__(self) -> None:
        self.give: list[Direction] = []
        self.seen: list[Seen] = []

    def step(self, seen: Seen) -> Direction | None:
        self.seen.append(seen)
        return self.give.pop(0) if self.give else None


class FakePort:
    """A ControllerPort whose controller runs at once when telemetry comes. `silent`: it does nothing any more."""

    def __init__(self, controller: Controller, now: Callable[[], float]) -> None:
        self.controller = controller
        self.silent = False
        self.running = False
        self._waits, self._waits_since, self._waited = 0.0, 0.0, 0.0
        self.loads = True
        self.set_up: SetUp | None = None
        self._now = now
        self._number = 0
        self._beat_at = 0.0
        self._reports: list[tuple[float, Report]] = []

    def start(self, set_up: SetUp) -> None:
        self.set_up, self.running, self._number = set_up, True, 0
        self.poses = PoseHistory()
        self.controller.cameras = ControllerCameras(set_up.cameras, self.poses)
        self.controller.report = self.report
        self.controller.note = lambda words, aloud: self.report(Note(words, aloud))
        try:
            self.controller.begin(set_up)
        except Exception as error:
            self.report(Raised(f"{type(error).__name__}: {error}"))
            return
        if self.loads:
            self.report(Ready())

    def report(self, report: Report) -> None:
        self._reports.append((self._now(), report))

    def say(self, seen: Seen) -> None:
        if self.silent or not self.running:
            return
        self.poses.add(seen)
        try:
            direction = self.controller.step(seen)
        except Exception as error:
            self.silent = True
            self.report(Raised(f"{type(error).__name__}: {error}"))
            return
        if direction is None:
            self.report(Beat())
            return
        self._number += 1
        self.report(Directed(self._number, direction))

    def reports(self) -> Sequence[tuple[float, Report]]:
        if self.running and self.loads and not self.silent and self._now() - self._beat_at >= 0.1:
            self._beat_at = self._now()
            self.report(Beat())
        reports, self._reports = self._reports, []
        return reports

    def waits(self, share: float) -> None:
        """From now on it waits for a processor for this share of the time."""
        self._waited, self._waits_since, self._waits = self.waited_s(), self._now(), share

    def waited_s(self) -> float:
        return self._waited + self._waits * (self._now() - self._waits_since)

    def stop(self) -> None:
        self.running, self._reports = False, []


class ControllerWorld(DroneWorld):
    """`script`: the controller, unless another is given."""

    def __init__(self, controller: Controller | None = None, *, cameras: Sequence[str] = (), **options: Any) -> None:
        self.script = Script()
        self.port = FakePort(controller or self.script, lambda: self.now)
        self.sent_at: list[float] = []
        super().__init__(
            make_handlers=lambda maker: [
                ControllerHandler(maker, {"survey": "/x.py:X"}, lambda: self.port, cameras=parse_cameras(cameras))
            ],
            **options,
        )

    def _collect(self) -> None:
        before = len(self.sent)
        super()._collect()
        self.sent_at += [self.now] * (len(self.sent) - before)

    def setpoints(self, since: float = 0.0) -> list[tuple[float, Any]]:
        """Returns the set-points that were sent since then, with their times."""
        both = [(at, decode(frame)) for at, frame in zip(self.sent_at, self.sent, strict=True) if at > since]
        return [(at, one) for at, one in both if one is not None and one.get_type() in SETPOINTS]

    def modes_sent(self, since: float) -> list[tuple[float, int]]:
        both = [(at, decode(frame)) for at, frame in zip(self.sent_at, self.sent, strict=True) if at > since]
        return [
            (at, int(one.param2))
            for at, one in both
            if one is not None and one.get_type() == "COMMAND_LONG" and one.command == 176
        ]

    def flies_by_controller(self, **limits: Any) -> int:
        """In the air, at 10 m, with the controller at the controls."""
        self.ready().flies()
        number = self.begin(ControllerWork("survey", **limits), deadline_s=300.0)
        self.until(lambda: len(self.setpoints()) > 5, what="set-points")
        return number

    @property
    def where(self) -> tuple[float, float, float]:
        """Metres north, east and up of the vehicle itself."""
        body = self.vehicle.flight.body
        return body.north_m, body.east_m, self.vehicle.flight.alt_over_home_m()
