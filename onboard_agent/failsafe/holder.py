"""What the holder does with the drone, by sticks and by command, and the consequences for hold and watches. No I/O.

Every flight frame of the holder passes here, whichever way it arrived. Combines `StickGate`, `CommandRequest` and
`StickKeeper`; takes `now`.
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
from onboard_agent.sticks.stick_gate import StickGate
from onboard_agent.sticks.stick_keeper import StickKeeper
from onboard_agent.telemetry.telemetry_stream import TelemetryStream
from wire.autopilots.profile import FlightMode
from wire.open_holds import AfterSticks

HEARTBEAT_OLD_S: Final = 2.0
"""An autopilot may beat once a second only, and take a moment to change its mode."""


class Holder:
    """Ask `why_not` of every frame that is INTERESTING (intent), in the order in which they go to the autopilot."""

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
        self.keeper = StickKeeper(maker)
        self.arming = ArmingSticks(maker)
        self.mission_before_hold = False
        """A trigger, not a change of hands, has stopped a mission, and nobody has flown since."""
        self.commanded = 0
        """Count of flight commands and targets that passed, and of holds."""
        self.moved = 0
        """How often sticks have passed that were not centred."""
        self._autopilot = autopilot
        self._hold = hold
        self._watch = watch
        self._person = person
        self._inquiry = inquiry
        self._stream = stream
        self._called_away_at = float("-inf")
        """Time of the last flight command, except home."""
        self._hand_mode: int | None = None
        """The mode of the last flight by hand, if it holds with centred sticks."""

    @property
    def by_hand(self) -> bool:
        """Whether the drone needs a pilot at the sticks, whoever it is."""
        view = self._autopilot
        return view.armed and not flies_without_sticks(view.kind, view.custom_mode)

    def why_not(self, frame: bytes, now: float) -> str | None:
        """Why the frame may not go to the autopilot, to be counted; None if it may, and then it counts as sent."""
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
        self._person.flown()
        self._watch.sticks_passed(now)
        self.keeper.sticks_passed(now)
        self._stream.sticks_passed(now)
        self._inquiry.sticks_sent(now)

    def _hand_modes(self) -> tuple[FlightMode, ...]:
        """Modes that obey sticks, the one that was flown before first."""
        modes = modes_of(self._autopilot.kind, self._autopilot.vehicle_type)
        if modes is None:
            return ()
        before = [mode for mode in modes.position_holds if mode.custom_mode == self._hand_mode]
        return (*before, modes.altitude_hold)

    def called_away_lately(self, now: float) -> bool:
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
            self._person.acted(now)
            self.mode_request.ask(intent.command, now, from_mode=None if self.by_hand else self._autopilot.custom_mode)
            self._hold.wait()
        elif not self.by_hand and self._obeys_targets:
            self._flies_by_command(now)

    def _wants_sticks(self, now: float) -> None:
        self.mode_request.over()
        self._person.acted(now)
        self._hold.go_on()
        self._hold.overruled(needs_sticks=True, now=now)
        view = self._autopilot
        nobodys = not self.keeper.person_fresh(now) and not self._hold.sticks_on
        known = modes_of(view.kind, view.vehicle_type) is not None
        if nobodys and (not view.heard or (known and view.airborne(now))):
            # Else the radio's would fly it, perhaps at the bottom.
            self._hold.keep_centred(now)

    @property
    def _obeys_targets(self) -> bool:
        view = self._autopilot
        modes = modes_of(view.kind, view.vehicle_type)
        return modes is None or view.custom_mode == modes.pauses[-1].custom_mode

    def _flies_by_command(self, now: float) -> None:
        """No hand is needed on the sticks, as the autopilot shows."""
        self.mode_request.over()
        self._hold.go_on()
        self._hold.overruled(needs_sticks=False, now=now)
        self._person.flown()
        self.gate.let_go()
        self._watch.nobody_needed()

    def acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK of the autopilot that may answer the holder."""
        if self.mode_request.refused(ack):
            self._hold.go_on()
        elif self._obeys_targets and self.mode_request.accepted(ack):
            self._flies_by_command(now)

    def heartbeat(self, now: float) -> None:
        """A HEARTBEAT of the autopilot; the view has read it."""
        view = self._autopilot
        if self.mode_request.granted(needs_sticks=self.by_hand, custom_mode=view.custom_mode):
            self._flies_by_command(now)
        if not view.armed:
            self.gate.let_go()
            self.mission_before_hold = False
            self._hand_mode = None
        elif self.by_hand and self._watch.hand_on_sticks and holds_when_centred(view.kind, view.custom_mode):
            self._hand_mode = view.custom_mode

    def update(self, now: float) -> None:
        """Time has passed: a mode_request that nothing came of is over."""
        if self.mode_request.lapsed(now):
            self._hold.go_on()

    def hold_begins(self, *, needed: bool) -> None:
        """Whatever the holder did is over."""
        self.commanded += 1
        if needed:
            self.gate.close()
        self.keeper.end_turn()
        self.mode_request.over()
        self._watch.nobody_needed()

    def sticks_to_keep(self, now: float, *, somebody_may_arm: bool) -> list[bytes]:
        """Sticks to send in place of a person's."""
        view = self._autopilot
        ids = {
            "vehicle_system_id": view.system_id or 1,
            "ground_station_system_id": self._inquiry.ground_station_system_id,
        }
        needs_rest = view.heard and not view.armed and self._inquiry.arms_with_sticks_at_rest(view.kind)
        frames = self.arming.due(now, wanted=needs_rest and somebody_may_arm, **ids)
        if frames:
            self.keeper.others_sent(now)
        kept = self.keeper.due(
            now,
            for_assistant=view.armed and self._watch.hand_on_sticks and holds_when_centred(view.kind, view.custom_mode),
            for_autopilot=self._minds_end_of_sticks(now) or self._release_for_request,
            lasts_s=self._inquiry.overrides_last_s,
            **ids,
        )
        if self.keeper.for_assistant:
            self._watch.stood_in(now)
        if frames or kept:
            self._inquiry.sticks_sent(now)
        return frames + kept

    @property
    def _release_for_request(self) -> bool:
        """A command is open, and the pilot may have let go of the sticks already."""
        return self.mode_request.open and self._autopilot.armed and self._watch.hand_on_sticks

    def _minds_end_of_sticks(self, now: float) -> bool:
        view = self._autopilot
        if not view.armed or self.by_hand or modes_of(view.kind, view.vehicle_type) is None:
            return False
        if not view.airborne(now):
            return self._inquiry.has_radio is not True  # on the ground a radio failsafe disarms, in every mode
        return self._inquiry.after_sticks(view.kind, view.custom_mode) is not AfterSticks.STAYS
