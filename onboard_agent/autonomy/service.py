"""Handler for controllers on board, as the agent always has it. It loads the rest only when one is started: most agents
never run a controller, and must not pay for it in memory. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.handler import Around
from wire.controller_settings import ControllerDescribed
from wire.controllers import ControllerWork
from wire.dialect import mavlink
from wire.frames import source
from wire.plans import Plan
from wire.transactions import Outcome, Transaction, TransactionResult, TransactionToTower
from wire.zones.nearby import NearbyZones

if TYPE_CHECKING:
    from onboard_agent.autonomy.core.controller_port import ControllerPort
    from onboard_agent.autonomy.core.flight import ControllerFlight
    from onboard_agent.autonomy.core.lines import CameraSetting
    from onboard_agent.autonomy.frame_sharing import FrameSharing

_AUTOPILOT: Final = 1


class ControllerHandler:
    """A TransactionHandler. `sources`: FILE:CLASS of the controllers in the agent's settings, by name. `make_port`:
    called at the first start of a controller. Call `connect` before the first frame."""

    works = (ControllerWork,)
    hears = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
            mavlink.MAVLINK_MSG_ID_ATTITUDE,
            mavlink.MAVLINK_MSG_ID_HEARTBEAT,
            mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
        }
    )

    def __init__(
        self,
        maker: FrameMaker,
        sources: Mapping[str, str],
        make_port: Callable[[], ControllerPort],
        *,
        cameras: Sequence[CameraSetting] = (),
        release: str = "",
        share: Callable[[str], None] | None = None,
    ) -> None:
        """`cameras`, `release`: as the agent's settings `controller_cameras` and `payload_release`.
        `share`: tells the video process where to put its pictures."""
        self._maker = maker
        self._cameras = cameras
        self._release = release
        self._share = share
        self._frames: FrameSharing | None = None
        self._sources = sources
        self._make_port = make_port
        self._port: ControllerPort | None = None
        self._flight: ControllerFlight | None = None
        self._system: int | None = None
        self._zones: tuple[NearbyZones, float] | None = None
        """The tower's newest message, and when it came."""
        self._reports: list[TransactionToTower] = []
        self._described: dict[str, ControllerDescribed] = {}
        self._warnings: list[str] = []

    def connect(
        self,
        *,
        send: Callable[[bytes, float], str | None],
        commanded: Callable[[], int],
        moved: Callable[[], int],
        mission: Callable[[], Plan] = tuple,
    ) -> None:
        """`send`: returns why a command must not pass. `commanded`, `moved`: counts of the holder's commands and
        moved sticks. `mission`: that on board, as far as it is known."""
        self._send, self._commanded, self._moved, self._mission = send, commanded, moved, mission

    def zones(self, message: NearbyZones, now: float) -> None:
        """Takes the zones near the drone. They count at once."""
        self._zones = (message, now)
        if self._flight is not None:
            self._flight.zones.told(message, now)

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot has lost what it was sent before it rebooted: ends the flight."""
        if self._flight is not None:
            self._flight.rebooted()

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts the controller's process, or refuses."""
        work = transaction.work
        assert isinstance(work, ControllerWork)
        from onboard_agent.autonomy.core.flight import ControllerFlight
        from onboard_agent.autonomy.core.flight_phase import profile_of
        from onboard_agent.autonomy.core.lines import SetUp
        from onboard_agent.autonomy.core.mission import waypoints
        from onboard_agent.autonomy.core.payload_release import USUAL, parse_release

        why_not = self._why_not(work, around)
        if why_not is None and around is not None and profile_of(around) is None:
            why_not = "this vehicle is not known to obey set-points"
        if why_not is not None or around is None:
            words = f"The controller {work.name} was not started: {why_not}."
            self._reports.append(TransactionResult(id=transaction.id, outcome=Outcome.REFUSED, words=words))
            return
        self._system = around.system_id
        self._port = port = self._port or self._make_port()
        cameras = tuple(self._cameras)
        limits = (work.max_speed_m_s, work.min_height_m, work.max_height_m, work.max_distance_m)
        port.start(
            SetUp(
                work.name,
                self._sources.get(work.name, ""),
                *limits,
                work.may_take_off,
                settings=work.settings,
                cameras=cameras,
                mission=waypoints(self._mission()),
                frames_path=self._shared(cameras),
            )
        )
        self._flight = ControllerFlight(
            self._maker,
            transaction,
            around,
            now,
            port=port,
            send=self._send,
            commanded=self._commanded,
            moved=self._moved,
            release=parse_release(self._release or USUAL),
        )
        if self._zones is not None:
            self._flight.zones.told(*self._zones)

    def _why_not(self, work: ControllerWork, around: Around | None) -> str | None:
        if around is None or not around.heard:
            return "no heartbeat from the autopilot"
        if self._flight is not None:
            return "another one flies; stop that first"
        if around.holding:
            return "the drone is being made to hold"
        if work.min_height_m > work.max_height_m:
            return "its least height is above its greatest"
        if not around.airborne and not work.may_take_off:
            return "the drone is not in the air, and it may not take off"
        return None

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower stops the controller."""
        if self._flight is not None and self._flight.id == transaction_id:
            self._flight.cancel(now)

    def epoch_changed(self, epoch: int, now: float) -> None:
        """The new holder did not start it: ends the flight."""
        if self._flight is not None:
            self._flight.epoch_changed(epoch)

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a frame of a type in `hears`."""
        if self._flight is not None and self._system is not None and source(frame) == (self._system, _AUTOPILOT):
            self._flight.receive(frame, self._system, now)
        return False

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        flight = self._flight
        if flight is None:
            return []
        out = [] if flight.result is not None else flight.due(around, now)
        self._take(flight)
        return out

    def _take(self, flight: ControllerFlight) -> None:
        self._reports += flight.told.pop()
        self._warnings += flight.told.pop_warnings()
        if flight.result is not None:
            outcome, words = flight.result
            self._reports.append(TransactionResult(id=flight.id, outcome=outcome, words=words))
            self._flight = None
            if self._frames is not None:
                self._frames.end()

    def _shared(self, cameras: Sequence[CameraSetting]) -> str:
        """Returns the path of the video process's pictures if one of the cameras is that."""
        if self._share is None or not any(one.source == "video" for one in cameras):
            return ""
        from onboard_agent.autonomy.frame_sharing import FrameSharing

        self._frames = self._frames or FrameSharing(self._share)
        return self._frames.begin()

    def pop_warnings(self) -> list[str]:
        """Returns the texts for STATUSTEXT, once."""
        warnings, self._warnings = self._warnings, []
        return warnings

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def described(self, told: ControllerDescribed) -> None:
        """A controller of a file or a package has said what its settings are."""
        from onboard_agent.autonomy.controller_settings import with_cameras

        settings = with_cameras(told.settings, self._cameras)
        self._described[told.controller] = one = ControllerDescribed(controller=told.controller, settings=settings)
        self._reports.append(one)

    def resend(self) -> None:
        """Reports the settings of the controllers again."""
        if not self._described:
            from onboard_agent.autonomy.built_in_settings import BUILT_IN_SETTINGS

            for name, settings in BUILT_IN_SETTINGS.items():
                if name not in self._sources:
                    self.described(ControllerDescribed(controller=name, settings=settings))
        self._reports = [one for one in self._reports if not isinstance(one, ControllerDescribed)]
        self._reports += self._described.values()
