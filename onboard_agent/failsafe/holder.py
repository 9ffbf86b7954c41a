"""Checks the holder's sticks and commands, and reports them to the hold and the watches. No I/O.

Each frame from the holder that controls the flight passes through here, on any channel. Connects `StickGate`,
`CommandRequest` and `StickFallback`; takes `now`.
"""

from typing import Any, Final

from onboard_agent.autopilot.autopilot_state import AutopilotView
from onboard_agent.autopilot.command_request import CommandRequest
from onboard_agent.autopilot.flight_modes import flies_without_sticks, holds_when_centred, modes_of
from onboard_agent.autopilot.inquiry import Inquiry
from onboard_agent.autopilot.intent import Command, Sticks, Target, arms, read_intent
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.hold import Hold
from onboard_agent.failsafe.person_watch import PersonWatch
from onboard_agent.failsafe.pilot_watch import PilotWatch
from onboard_agent.sticks.arming_sticks import ArmingSticks
from onboard_agent.sticks.stick_fallback import StickFallback
from onboard_agent.sticks.stick_gate import StickGate
from onboard_agent.telemetry.telemetry_stream import TelemetryStream
from wire.autopilots.profile import FlightMode
from wire.open_holds import AfterSticks

HEARTBEAT_OLD_S: Final = 2.0
"""An autopilot may send only one heartbeat a second, and needs a moment to change its mode."""


class Holder:
    """Call `why_not` for every INTERESTING frame (intent), in the order in which frames go to the autopilot."""

    def __init__(
        self,
        maker: FrameMaker,
        *,
        autopilot: AutopilotView,
        hold: Hold,
        watch: PilotWatch,
        person: PersonWatch,
        inquiry: Inquiry,
        stream: TelemetryStream,
    ) -> None:
        self.gate = StickGate()
        self.mode_request = CommandRequest(maker)
        self.stick_fallback = StickFallback(maker)
        self.arming = ArmingSticks(maker)
        self.mission_before_hold = False
        """A trigger, not a hand-over, has stopped a mission, and nobody has flown since."""
        self.commanded = 0
        """Counts commands that control the flight: commands, targets and arming requests that passed, and holds."""
        self.moved = 0
        """Counts passed sticks that were not centred."""
        self._autopilot = autopilot
        self._hold = hold
        self._watch = watch
        self._person = person
        self._inquiry = inquiry
        self._stream = stream
        self._called_away_at = float("-inf")
        """Time of the last command, if it was not a command to go home."""
        self._hand_mode: int | None = None
        """The last mode flown by hand, if it holds when the sticks are centred."""
        self._wanted_sticks_at = float("-inf")
        """Time of the last command of a mode that needs sticks, or of a hold, which may need them too."""
        self._was_by_hand = False

    @property
    def by_hand(self) -> bool:
        """Whether the drone needs a hand on the sticks, the holder's or a radio pilot's."""
        view = self._autopilot
        return view.armed and not view.watched_only and not flies_without_sticks(view.kind, view.custom_mode)

    def why_not(self, frame: bytes, now: float) -> str | None:
        """Returns why the frame may not go to the autopilot, for a counter. None: it may, and counts as sent."""
        if arms(frame):
            self.commanded += 1
            self._watch.used(now)
        intent = read_intent(frame, autopilot_kind=self._autopilot.kind, middles_us=self._inquiry.channel_middles_us)
        if intent is None:
            return None
        if isinstance(intent, Sticks):
            if self.arming.on:
                return "sticks while disarmed, without a receiver"
            if not self.gate.admit(intent):
                return "sticks not centred after a hold"
            self._sticks_pass(intent, now)
        else:
            self._watch.used(now)
            self._commanded(intent, now)
        self.mission_before_hold = False
        return None

    def _sticks_pass(self, sticks: Sticks, now: float) -> None:
        self.moved += not sticks.centred
        self._hold.sticks_come(self._hand_modes(), now)
        self._person.attended()
        self._watch.sticks_passed(now)
        self.stick_fallback.sticks_passed(now)
        self._stream.sticks_passed(now)
        self._inquiry.sticks_sent(now)

    def _hand_modes(self) -> tuple[FlightMode, ...]:
        """Modes that obey sticks; the one flown before comes first."""
        modes = modes_of(self._autopilot.kind, self._autopilot.vehicle_type)
        if modes is None:
            return ()
        before = [mode for mode in modes.position_holds if mode.custom_mode == self._hand_mode]
        return (*before, modes.altitude_hold)

    def commanded_away_lately(self, now: float) -> bool:
        """Whether a heartbeat that shows a return or a landing may be older than the command that ended it."""
        return now - self._called_away_at <= HEARTBEAT_OLD_S

    def _commanded(self, intent: Command | Target, now: float) -> None:
        self.commanded += 1
        if isinstance(intent, Command):
            self._called_away_at = float("-inf") if intent.goes_home else now
        if isinstance(intent, Command) and intent.needs_sticks:
            self._wants_sticks(now)
        elif not self.by_hand and not self._hold.open:
            self._flies_by_command(now)
        elif isinstance(intent, Command):
            self._person.commanded(now)
            self.mode_request.ask(intent.command, now, from_mode=None if self.by_hand else self._autopilot.custom_mode)
            self._hold.wait()
        elif not self.by_hand and self._obeys_targets:
            self._flies_by_command(now)

    def _wants_sticks(self, now: float) -> None:
        self.mode_request.over()
        self._person.commanded(now)
        self._hold.go_on()
        self._hold.overruled(needs_sticks=True, now=now)
        view = self._autopilot
        self._wanted_sticks_at = now
        if self.stick_fallback.person_fresh(now):
            self._watch.sticks_due(now)
        nobodys = not self.stick_fallback.person_fresh(now) and not self._hold.sticks_on
        known = modes_of(view.kind, view.vehicle_type) is not None
        if nobodys and (not view.heard or (known and view.airborne(now))):
            # Otherwise the radio's sticks would fly the drone, perhaps with the throttle at the bottom.
            self._hold.keep_centred(now)

    @property
    def _obeys_targets(self) -> bool:
        view = self._autopilot
        modes = modes_of(view.kind, view.vehicle_type)
        return modes is None or view.custom_mode == modes.pauses[-1].custom_mode

    def _flies_by_command(self, now: float) -> None:
        """The autopilot shows that the drone flies without sticks."""
        self.mode_request.over()
        self._hold.go_on()
        self._hold.overruled(needs_sticks=False, now=now)
        self._person.attended()
        self.gate.let_go()
        self._watch.no_pilot_needed()

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK that may answer the holder."""
        if self.mode_request.refused(ack):
            self._hold.go_on()
        elif self._obeys_targets and self.mode_request.accepted(ack):
            self._flies_by_command(now)

    def heartbeat(self, now: float) -> None:
        """Handles a HEARTBEAT of the autopilot, after the view has read it."""
        view = self._autopilot
        if self.mode_request.granted(needs_sticks=self.by_hand, custom_mode=view.custom_mode):
            self._flies_by_command(now)
        if self.by_hand and not self._was_by_hand:
            self._hand_needed(now)
        self._was_by_hand = self.by_hand
        if not view.armed:
            self.gate.let_go()
            self.mission_before_hold = False
            self._hand_mode = None
        elif self.by_hand and self._watch.hand_on_sticks and holds_when_centred(view.kind, view.custom_mode):
            self._hand_mode = view.custom_mode

    def wants_sticks(self, now: float) -> bool:
        """Whether a mode that needs sticks was commanded so recently that a heartbeat may not show it yet."""
        return now - self._wanted_sticks_at <= HEARTBEAT_OLD_S

    def _hand_needed(self, now: float) -> None:
        """The autopilot shows a mode that needs sticks, and showed none before.

        A later command that it refuses, such as a go-to, may have ended the hold, or the watch for a hand, before this
        mode was seen.
        """
        if (
            self.wants_sticks(now)
            and self._autopilot.airborne(now)
            and not (self._hold.open or self._watch.hand_on_sticks)
        ):
            self._watch.sticks_due(now)

    def update(self, now: float) -> None:
        """Ends a mode request that had no effect in time."""
        if self.mode_request.lapsed(now):
            self._hold.go_on()

    def hold_begins(self, now: float, *, needed: bool) -> None:
        """Ends the holder's requests and sticks, because a hold begins."""
        self.commanded += 1
        self._wanted_sticks_at = now
        if needed:
            self.gate.close()
        self.stick_fallback.end_turn()
        self.mode_request.over()
        self._watch.no_pilot_needed()

    def sticks_to_keep(self, now: float, *, somebody_may_arm: bool) -> list[bytes]:
        """Returns sticks to send in place of missing ones."""
        view = self._autopilot
        if not view.may_be_held:
            return []
        ids = {
            "vehicle_system_id": view.system_id or 1,
            "ground_station_system_id": self._inquiry.ground_station_system_id,
        }
        needs_rest = view.heard and not view.armed and self._inquiry.arms_with_sticks_at_rest(view.kind)
        frames = self.arming.due(now, wanted=needs_rest and somebody_may_arm, **ids)
        if frames:
            self.stick_fallback.others_sent(now)
        kept = self.stick_fallback.due(
            now,
            for_assistant=view.armed and self._watch.hand_on_sticks and holds_when_centred(view.kind, view.custom_mode),
            for_autopilot=self._minds_end_of_sticks(now) or self._release_for_request,
            lasts_s=self._inquiry.overrides_last_s,
            **ids,
        )
        if self.stick_fallback.for_assistant:
            self._watch.replaced_by_agent(now)
        if frames or kept:
            self._inquiry.sticks_sent(now)
        return frames + kept

    @property
    def _release_for_request(self) -> bool:
        """Whether a command is pending and the hand that was on the sticks may already be gone."""
        return self.mode_request.open and self._autopilot.armed and self._watch.hand_on_sticks

    def _minds_end_of_sticks(self, now: float) -> bool:
        view = self._autopilot
        if not view.armed or self.by_hand or modes_of(view.kind, view.vehicle_type) is None:
            return False
        if not view.airborne(now):
            return self._inquiry.has_radio is not True  # on the ground a radio failsafe disarms, in every mode
        # A lost transmitter is the autopilot's own affair while it flies by command.
        after = self._inquiry.after_sticks(view.kind, view.custom_mode, now, trusts_receiver=True)
        return after is not AfterSticks.STAYS
