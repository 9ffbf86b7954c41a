"""Applies an agent's reports from the control channel to the live state and notifies the people concerned.

One entry for each message of `wire.control_messages.ToTower`. Reports of a replaced link are ignored.
"""

from datetime import datetime
from typing import Final

from server.flights.core.black_box import BlackBoxFetcher
from server.link.core.agent_link import AgentLink
from server.live import live_messages as live
from server.live.hub_events import HoldStepReported, LossParametersReported, StickGestureHeldBack
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.operations.core.service import OperationService
from server.readiness.core.signature import after_report
from server.video.core.service import VideoService
from wire.black_box import BlackBoxPiece, BlackBoxState
from wire.control_messages import (
    AutopilotState,
    HoldCause,
    HoldProgress,
    HoldStep,
    LossParameters,
    StreamState,
    ToTower,
)
from wire.open_holds import HoldStage, HoldState
from wire.parameter_metadata import PARAMETER_METADATA, MetadataKnown, MetadataPiece, MetadataToTower, MetadataWanted
from wire.transactions import TRANSACTIONS, TransactionToTower
from wire.video import VIDEO, VideoState

MAX_TEXT_LENGTH: Final = 500
"""Maximum length of an agent's text that is passed on. Many browsers keep such texts in their queues."""

_OWN_CAUSES: Final = {
    HoldCause.PILOT_LOST: "its pilot or the tower was lost",
    HoldCause.STICKS_STALE: "its pilot's sticks stopped",
}
"""Of holds that the agent begins by itself."""


class AgentReports:
    """No state of its own: all of it is in the drones, and at the services of operations and of video."""

    def __init__(
        self, state: LiveState, operations: OperationService, video: VideoService, black_box: BlackBoxFetcher
    ) -> None:
        self._state = state
        self._black_box = black_box
        self._operations = operations
        self._video = video

    def receive(self, link: AgentLink, message: ToTower, at: datetime | None = None) -> None:
        """Handles a message that arrived at this time of day. Ignores a hello, which belongs at the beginning.

        Raises MalformedMessage.
        """
        drone = self._state.drones.get(link.drone_id)
        if drone is None or drone.link is not link:
            return
        match message:
            case AutopilotState():
                self._autopilot_state(drone, message, at)
            case HoldProgress():
                self._hold_progress(drone, link, message)
            case HoldState():
                self._hold_state(drone, link, message, at)
            case LossParameters():
                drone.loss_parameters = message
                self._state.on_event(LossParametersReported(drone.drone_id, message))
            case StreamState():
                if drone.stream_state != message:
                    drone.stream_state = message
                    self._state.publish_drone(drone)
            case VideoState():
                if VIDEO in link.takes:
                    self._video.update_state(link, message)
            case BlackBoxState() | BlackBoxPiece():
                self._black_box.receive(drone, link, message)
            case MetadataKnown() | MetadataPiece():
                if PARAMETER_METADATA in link.takes:
                    self._metadata(drone, link, message)
            case _:
                if isinstance(message, TransactionToTower) and TRANSACTIONS in link.takes:
                    self._operations.receive(drone, link, message)

    def _metadata(self, drone: LiveDrone, link: AgentLink, message: MetadataToTower) -> None:
        if isinstance(message, MetadataPiece):
            drone.onboard.metadata.add_piece(message)
            return
        lacking = drone.onboard.metadata.update_known(message)
        if lacking is not None:
            link.post(MetadataWanted(hash=lacking))

    def _autopilot_state(self, drone: LiveDrone, state: AutopilotState, at: datetime | None) -> None:
        before = _reported(drone)
        drone.firmware, drone.watched_only = state.firmware, state.watched_only
        drone.other_systems, drone.hears_agent = state.other_systems, state.hears_agent
        drone.signing = state.signing
        drone.own.told(state.system_id, state.other_systems)
        self._stick_gestures(drone, state)
        drone.autopilot_heard = state.heard
        # What an autopilot that is silent did last is no longer known: it may be in the air.
        drone.armed, drone.airborne = (state.armed, state.airborne) if state.heard else (None, None)
        drone.preflight = after_report(drone.preflight, armed=drone.armed)
        if state.heard:
            drone.was_airborne = state.airborne
            if not state.armed:
                drone.hold_unconfirmed = None
        drone.last_heard.reported(state)
        if not state.heard:
            drone.silent(at or self._state.clock())
        drone.flight_start.report(heard=state.heard, airborne=state.airborne, at=at)
        if before != _reported(drone):
            self._state.publish_drone(drone)

    def _stick_gestures(self, drone: LiveDrone, state: AutopilotState) -> None:
        """What came before the tower's first report from this agent was somebody else's."""
        known, drone.stick_gestures = drone.stick_gestures, state.stick_gestures
        if known is None or state.stick_gestures in (0, known):
            return
        lease, name = drone.lease, drone.record.name
        who = lease.assistant if drone.turn.whose == "assistant" else lease.holder
        text = f"{'Somebody' if who is None else who.name} tried to arm or disarm {name} by sticks. It was held back."
        self._state.notify_watchers(drone, live.Notice("warning", "stick-gesture", text, drone.drone_id, 1))
        event = StickGestureHeldBack(
            drone.drone_id, None if who is None else who.id, state.airborne, state.stick_gestures
        )
        self._state.on_event(event)

    def _hold_state(self, drone: LiveDrone, link: AgentLink, state: HoldState, at: datetime | None) -> None:
        if not link.knows_open_holds or at is None:
            return
        if not state.open or state.stage is not HoldStage.NONE:
            drone.hold_unconfirmed = None
        news = drone.open_hold.take(state, at)
        self._state.note_hold(drone)
        if news:
            self._state.publish_drone(drone)

    def _hold_progress(self, drone: LiveDrone, link: AgentLink, progress: HoldProgress) -> None:
        link.answered(progress.order_id)
        if progress.step.final:
            drone.open_hold.ended(progress.order_id)
            self._state.note_hold(drone)
        if not drone.hold_steps.is_news(progress):
            return
        reason = drone.orders.get(progress.order_id, "")
        if progress.step is HoldStep.ORDERED:
            drone.hold_reason = _OWN_CAUSES.get(progress.cause, reason)
        elif progress.step.final:
            drone.hold_unconfirmed = (
                progress.detail[:MAX_TEXT_LENGTH] if progress.step is HoldStep.UNCONFIRMED else None
            )
        if progress.cause is not HoldCause.ORDER and not progress.step.final:
            drone.commanded += 1  # an order was counted when it was given
        event = live.Hold(
            drone.drone_id,
            progress.epoch,
            progress.step,
            progress.detail[:MAX_TEXT_LENGTH],
            progress.elapsed_ms,
            progress.cause,
        )
        self._state.traffic.hold_steps[str(progress.step)] += 1
        self._state.notify_watchers(drone, event)
        self._state.on_event(HoldStepReported(drone.drone_id, progress, reason))


def _reported(drone: LiveDrone) -> tuple[object, ...]:
    """What people see of the agent's report."""
    state = drone.autopilot_heard, drone.armed, drone.airborne
    line = drone.watched_only, drone.other_systems, drone.hears_agent, drone.signing
    return *state, drone.firmware, *line
