"""What the holder does with the drone, by sticks and by command, and what hold and watches make of it. No I/O.

Each frame of the holder that says how the drone is to fly goes through here, whichever way it came. Joins `StickGate`,
`CommandWish` and `StandIn`; takes `now`.
"""

from onboard_agent.autopilot_state import AutopilotView
from onboard_agent.command_wish import CommandWish
from onboard_agent.flight_modes import flies_without_sticks, holds_when_centred
from onboard_agent.hold import Hold
from onboard_agent.inquiry import Inquiry
from onboard_agent.intent import Command, Sticks, Target, arms, read_intent
from onboard_agent.own_frames import FrameMaker
from onboard_agent.pilot_watch import PilotWatch
from onboard_agent.stand_in import StandIn
from onboard_agent.stick_gate import StickGate
from onboard_agent.telemetry_stream import TelemetryStream
from wire.control_messages import SafetySettings


class Holder:
    """Ask `passes` of every frame that is INTERESTING (intent), in the order in which they go to the autopilot."""

    def __init__(
        self,
        maker: FrameMaker,
        *,
        autopilot: AutopilotView,
        hold: Hold,
        watch: PilotWatch,
        inquiry: Inquiry,
        stream: TelemetryStream,
    ) -> None:
        self.gate = StickGate()
        self.wish = CommandWish(maker)
        self.stand_in = StandIn(maker)
        self.mission_before_hold = False
        """A trigger, not a change of hands, has stopped a mission, and nobody has flown since."""
        self.commanded = 0
        """How often somebody has said how to fly: commands and targets that have passed, and holds."""
        self.moved = 0
        """How often sticks have passed that were not centred."""
        self._autopilot = autopilot
        self._hold = hold
        self._watch = watch
        self._inquiry = inquiry
        self._stream = stream

    @property
    def by_hand(self) -> bool:
        """Whether a hand is needed on the sticks, whoever's."""
        view = self._autopilot
        return view.armed and not flies_without_sticks(view.kind, view.custom_mode)

    def passes(self, frame: bytes, now: float) -> bool:
        """Whether the frame may go to the autopilot; if so, it counts as sent."""
        if arms(frame):
            self.commanded += 1
            self._watch.used(now)
        intent = read_intent(frame, autopilot_kind=self._autopilot.kind, middles_us=self._inquiry.channel_middles_us)
        if intent is None:
            return True
        if isinstance(intent, Sticks):
            if not self.gate.admit(intent):
                return False
            self.moved += not intent.centred
            self._hold.stop_sticks()
            self._watch.sticks_passed(now)
            self.stand_in.sticks_passed(now)
            self._stream.sticks_passed(now)
            self._inquiry.sticks_sent(now)
        else:
            self._watch.used(now)
            self._commanded(intent, now)
        self.mission_before_hold = False
        return True

    def _commanded(self, intent: Command | Target, now: float) -> None:
        self.commanded += 1
        if isinstance(intent, Command) and intent.needs_sticks:
            self.wish.over()
            self._hold.go_on()
            self._hold.overruled(needs_sticks=True, now=now)
        elif not self.by_hand:
            self._flies_by_command(now)
        elif isinstance(intent, Command):
            self.wish.ask(intent.command, now)
            self._hold.wait()

    def _flies_by_command(self, now: float) -> None:
        """No hand is needed on the sticks, as the autopilot shows."""
        self.wish.over()
        self._hold.overruled(needs_sticks=False, now=now)
        self.gate.let_go()
        self._watch.nobody_needed()

    def heartbeat(self, now: float) -> None:
        """A HEARTBEAT of the autopilot; the view has read it."""
        if self.wish.granted(needs_sticks=self.by_hand):
            self._flies_by_command(now)
        if not self._autopilot.armed:
            self.gate.let_go()
            self.mission_before_hold = False

    def look(self, now: float) -> None:
        """Time has passed: a wish that nothing came of is over."""
        if self.wish.lapsed(now):
            self._hold.go_on()

    def hold_begins(self, *, needed: bool) -> None:
        """Whatever the holder did is over."""
        self.commanded += 1
        if needed:
            self.gate.close()
        self.stand_in.end()
        self.wish.over()
        self._watch.nobody_needed()

    def centred_for_assistant(self, now: float, settings: SafetySettings) -> list[bytes]:
        """Sticks to send in place of an assistant's who only commands."""
        view = self._autopilot
        frames = self.stand_in.due(
            now,
            wanted=view.armed and self._watch.hand_on_sticks and holds_when_centred(view.kind, view.custom_mode),
            sticks_stale_s=settings.sticks_stale_s,
            bound_s=settings.hold_bound_s,
            vehicle_system_id=view.system_id or 1,
            ground_station_system_id=self._inquiry.ground_station_system_id,
        )
        if self.stand_in.on:
            self._watch.stood_in(now)
            self._inquiry.sticks_sent(now)
        return frames
