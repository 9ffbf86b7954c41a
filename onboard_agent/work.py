"""Connects `Onboard` with the handlers for the tower's work at the drone, and checks what they may send. No I/O.

It makes no flight decisions: a handler's commands pass the same checks as the holder's frames.
"""

import logging
from collections.abc import Callable, Sequence
from typing import Final

from onboard_agent.autonomy.service import ControllerHandler
from onboard_agent.autopilot.autopilot_state import AutopilotView
from onboard_agent.autopilot.intent import INTERESTING
from onboard_agent.autopilot.mode_names import mission_modes
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.hold import Hold
from onboard_agent.failsafe.holder import Holder
from onboard_agent.transactions.command_handler import CommandHandler
from onboard_agent.transactions.follow_handler import FollowHandler
from onboard_agent.transactions.handler import Around, TransactionHandler
from onboard_agent.transactions.journal import JournalStore
from onboard_agent.transactions.metadata_service import MetadataService
from onboard_agent.transactions.plan_watch import PlanWatch
from onboard_agent.transactions.start_gate import INSPECTED, LatestStart, StartGate, may_start, starts_mission
from onboard_agent.transactions.transactions import Transactions
from wire.dialect import mavlink
from wire.following import LeaderPosition
from wire.frames import message_id
from wire.parameter_metadata import MetadataWanted
from wire.transactions import TRANSACTIONS, CancelTransaction, Outcome, Transaction, TransactionToTower
from wire.zones.nearby import NearbyZones

_log = logging.getLogger(__name__)

STATION_READS_S: Final = 30.0
"""For this long after a ground station requests parameters, all values go to it, even if the agent reads them too."""

STATION_FILES_S: Final = 5.0
"""For this long after a ground station requests files, the agent reads no files in the background."""

_ASKS_FOR_PARAMETERS: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
        mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
        mavlink.MAVLINK_MSG_ID_PARAM_SET,
    }
)

MakeHandlers = Callable[[FrameMaker], Sequence[TransactionHandler]]
"""Makes the handlers that need more than the time and the frames (a disk, for example), with the given frame maker."""


class WorkAtDrone:
    """One for each drone. Call `due` at each tick, and after each input."""

    def __init__(
        self,
        maker: FrameMaker,
        *,
        autopilot: AutopilotView,
        hold: Hold,
        holder: Holder,
        narrow_line: bool,
        journal: JournalStore,
        make_handlers: MakeHandlers,
    ) -> None:
        self._autopilot = autopilot
        self._hold = hold
        self._holder = holder
        self._narrow_line = narrow_line
        self._plans = PlanWatch(maker, journal)
        commands = CommandHandler(maker, send=self._why_not_command, commanded=lambda: holder.commanded)
        self._follow = FollowHandler(
            maker, send=self._why_not_command, commanded=lambda: holder.commanded, moved=lambda: holder.moved
        )
        more = make_handlers(maker)
        self._metadata = next((one for one in more if isinstance(one, MetadataService)), None)
        self._controllers = next((one for one in more if isinstance(one, ControllerHandler)), None)
        if self._controllers is not None:
            self._controllers.connect(
                send=self._why_not_command,
                commanded=lambda: holder.commanded,
                moved=lambda: holder.moved,
                mission=lambda: self._plans.mission,
            )
        self._transactions = Transactions([self._plans, commands, self._follow, *more])
        self._gate = StartGate(maker)
        self._latest_start = LatestStart()
        self._answers: list[bytes] = []
        self._takes: tuple[str, ...] = ()
        self._station_asked_at = float("-inf")
        """When a ground station last requested parameters from the autopilot."""
        self._station_files_at = float("-inf")
        """When a ground station last requested files from the autopilot."""
        self.hears: Final = self._transactions.hears
        """Ids of the autopilot's messages for `receive`."""

    # The link.

    def link_up(self, takes: Sequence[str]) -> None:
        """A new link is up. `takes`: from the tower's welcome."""
        self._takes = tuple(takes)
        self.resumed()

    def resumed(self) -> None:
        """The link continues on another control channel."""
        self._transactions.link_up(taken=TRANSACTIONS in self._takes, takes=self._takes)

    def link_down(self) -> None:
        """The link is down. Work in progress continues."""
        self._transactions.link_down()

    # The tower.

    def why_not(self, frame: bytes, now: float) -> str | None:
        """Returns why a frame from the tower must not pass to the autopilot (a reason to count), or None."""
        if message_id(frame) in _ASKS_FOR_PARAMETERS:
            self._station_asked_at = now
        why = self._why_not_start(frame, now)
        if why is not None:
            system_id = self._autopilot.system_id or 1
            self._answers += self._gate.answers(frame, why, now, vehicle_system_id=system_id)
            return "no mission may be started"
        return "a plan is being written" if self._plans.keeps_out(frame, now) else None

    def ahead_of(self, frame: bytes, now: float) -> list[bytes]:
        """Returns frames to send to the autopilot before this frame from the tower. When a ground station requests
        files, the agent first closes the file that it reads in the background: autopilots open one at a time."""
        if message_id(frame) != mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
            return []
        self._station_files_at = now
        around = self._around(now)
        return [] if self._metadata is None or around is None else self._metadata.due(around, now)

    @property
    def may_start(self) -> bool:
        """Whether the mission on board may be started."""
        return self._plans.why_no_start is None

    def pop_answers(self) -> list[bytes]:
        """Returns frames that report refusals and warnings to the tower."""
        answers, self._answers = self._answers, []
        return answers

    def tell(self, words: str) -> None:
        """Tells those who watch the drone."""
        _log.warning("%s", words)
        self._answers += self._gate.say(words, vehicle_system_id=self._autopilot.system_id or 1)

    def refuse(self, transaction: Transaction, words: str) -> None:
        """Refuses a transaction before it begins."""
        self._transactions.refuse(transaction.id, Outcome.REFUSED, words)

    def message(self, message: Transaction | CancelTransaction | MetadataWanted | NearbyZones, now: float) -> None:
        """Begins or cancels a transaction, or notes a request for metadata or the zones near the drone."""
        if isinstance(message, Transaction):
            self._transactions.begin(message, self._around(now), now)
        elif isinstance(message, MetadataWanted):
            if self._metadata is not None:
                self._metadata.wanted(message.hash)
        elif isinstance(message, NearbyZones):
            if self._controllers is not None:
                self._controllers.zones(message, now)
        else:
            self._transactions.cancel(message.id, now)

    def leader(self, position: LeaderPosition, late_s: float, now: float) -> None:
        """Position of the drone that this one follows. `late_s`: how late it arrived."""
        self._follow.leader(position, late_s, now)

    def epoch(self, epoch: int, now: float) -> None:
        """Reports the current epoch to the transactions, whether it has changed or not."""
        self._transactions.epoch_changed(epoch, now)

    def reports(self, *, room: int) -> list[TransactionToTower]:
        """Returns messages for the control channel, at most `room`."""
        return self._transactions.reports(room=room)

    # The autopilot.

    def autopilot_came(self, now: float) -> None:
        """The autopilot was found, or has rebooted."""
        around = self._around(now)
        if around is not None:
            self._transactions.autopilot_came(around, now)

    def receive(self, frame: bytes, now: float) -> bool:
        """Handles a frame from the autopilot whose id is in `hears`. Returns True if the tower does not need it."""
        answers_us = self._transactions.receive(frame, now)
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_PARAM_VALUE and now - self._station_asked_at < STATION_READS_S:
            return False  # PARAM_VALUE does not name its requester
        return answers_us

    def due(self, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        out = self._transactions.due(self._around(now), now)
        controllers = [] if self._controllers is None else self._controllers.pop_warnings()
        for warning in [*self._plans.pop_warnings(), *controllers]:
            self.tell(warning)
        return out

    def sent(self, frames: Sequence[bytes], now: float) -> None:
        """Inspects frames that the agent sends on its own, because one of them may resume the mission."""
        for frame in frames:
            if self._starts_mission(frame):
                self._latest_start.passed(frame, now)

    def _starts_mission(self, frame: bytes) -> bool:
        if message_id(frame) not in INSPECTED:
            return False
        view = self._autopilot
        if view.system_id is None:
            return may_start(frame)  # it is not known yet which mode is the mission's
        return starts_mission(
            frame, autopilot_kind=view.kind, vehicle_type=view.vehicle_type, custom_mode=view.custom_mode
        )

    def _why_not_start(self, frame: bytes, now: float) -> str | None:
        if not self._starts_mission(frame):
            return None
        why = self._plans.why_no_start
        if why is None:
            self._latest_start.passed(frame, now)
        return why

    def _why_not_command(self, frame: bytes, now: float) -> str | None:
        """Applies the checks for the holder's frames to a handler's command."""
        why = self._why_not_start(frame, now)
        if why is None and message_id(frame) in INTERESTING:
            self._holder.why_not(frame, now)  # a command always passes
        return why

    def _around(self, now: float) -> Around | None:
        view = self._autopilot
        if view.system_id is None:
            return None
        mode_shown = view.custom_mode in mission_modes(view.kind, view.vehicle_type)
        return Around(
            system_id=view.system_id,
            autopilot_kind=view.kind,
            vehicle_type=view.vehicle_type,
            heard=view.heard,
            armed=view.armed,
            airborne=view.airborne(now),
            custom_mode=view.custom_mode,
            starting=self._latest_start.is_pending(now, mode_shown=mode_shown, armed=view.armed),
            flown_by_hand=self._holder.by_hand,
            narrow_line=self._narrow_line,
            holding=self._hold.acting,
            commanded=self._holder.commanded,
            busy=self._transactions.busy or self._plans.busy or now - self._station_files_at < STATION_FILES_S,
            firmware=view.firmware,
            system_is_fixed=view.system_is_fixed,
            other_systems=view.other_systems,
        )
