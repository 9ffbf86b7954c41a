"""An open hold as a model: a real agent core with a small ArduCopter. Tower, person, link, agent, position and answers
come and go at any moment.

Invariants at every step:
- Airborne without a pilot, it does not sink more than arresting a descent takes, unless somebody commanded a landing or
  a return, or the agent announced one a second before.
- Sticks never stop in a mode that uses them, while the agent lives.
- While the agent lives, no failsafe of the autopilot acts on a hold.
- While a hold is open, the agent reports a countdown, a stay or the way home at least every 5 s.
- When the agent is dead, only what it announced with `after_sticks` may happen.
Left alone, it lands as announced, or stays because somebody requested it.
"""

import logging
from typing import Final

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from worlds.held_copter import AGENT_COMPONENT, HeldCopter, go_to, mode_command
from worlds.model_copter import GOES_DOWN, USES_STICKS, Mode, ModelCopter, Receiver
from worlds.tiers import examples

from wire.open_holds import AfterSticks, HoldStage, HoldState, LostAction, LostPhase

STEP_S: Final = 0.05
ACTION_S: Final = 8.0
FLIES_S: Final = 0.6
"""Sticks may be stale for half a second before the agent holds."""
SHOWS_S: Final = 1.8
"""By then an autopilot that sends no acknowledgement has shown whether it obeys a command."""
REFUSED_WITHIN_S: Final = 2.0
"""After a command: the autopilot has refused the mode, and its EKF failsafe has waited its second."""
COME_WITHIN_S: Final = 0.15
"""Delay after a mode change: a tick or two."""
ARREST_M: Final = 4.0
SETTLES_S: Final = 0.2
ANNOUNCED_S: Final = 1.0
REPORTED_S: Final = 0.5
"""A change of mode is reported within this time."""
WAKES_UP_S: Final = 0.5
SEND_EVERY_S: Final = 5.2
PATIENCE_S: Final = 3.5
"""Time for a person who commands a stick mode to move the sticks."""
STOPS_S: Final = 6.0
ASKING_S: Final = 8.0
"""The agent requests an unanswered return for 5 s before it requests a landing."""

TOLD: Final = {AfterSticks.RETURNS: {Mode.RTL, Mode.LAND}, AfterSticks.LANDS: {Mode.LAND}}

stick_positions = st.sampled_from([(0, 500), (0, 0), (0, 1000), (700, 500), (-400, 200)])
own_modes = st.sampled_from([Mode.RTL, Mode.LAND, Mode.LOITER, Mode.ALT_HOLD, Mode.GUIDED, Mode.BRAKE, Mode.AUTO])


class Announcements(logging.Handler):
    """What the agent announces, with and without a link."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


class OpenHoldModel(RuleBasedStateMachine):
    """Rules are the actions of people, networks, power cuts and clouds."""

    def __init__(self) -> None:
        super().__init__()
        self.announcements = Announcements()
        self.log = logging.getLogger("onboard_agent.failsafe.failsafe")
        self.log.addHandler(self.announcements)
        self.world: HeldCopter | None = None

    @initialize(
        receiver=st.sampled_from(Receiver),
        failsafe=st.sampled_from([(1.0, 16.0), (1.0, 16.0), (1.0, 29.0), (0.0, 16.0), (3.0, 16.0)]),
        mode=st.sampled_from([Mode.LOITER, Mode.ALT_HOLD, Mode.STABILIZE, Mode.AUTO, Mode.GUIDED]),
        action=st.sampled_from([LostAction.RETURN, LostAction.RETURN, LostAction.LAND, LostAction.STAY]),
        height_m=st.sampled_from([30.0, 60.0]),
        ladder=st.sampled_from([(), (), ("LOITER",), ("BRAKE",)]),
    )
    def somebody_flies(
        self,
        receiver: Receiver,
        failsafe: tuple[float, float],
        mode: Mode,
        action: LostAction,
        height_m: float,
        ladder: tuple[str, ...],
    ) -> None:
        parameters = {"FS_THR_ENABLE": failsafe[0], "FS_OPTIONS": failsafe[1]}
        copter = ModelCopter(50.0, receiver=receiver, parameters=parameters, height_m=height_m, mode=mode)
        self.world = HeldCopter(
            copter,
            step_s=STEP_S,
            knows_s=0.0,
            lost_action=action,
            lost_action_s=ACTION_S,
            hold_ladder=ladder,
        )
        self.flown_at = self.alive_since = self.holds_since = self.world.now
        self.commanded_at = self.taken_at = float("-inf")
        self.linked_since = self.open_since = self.world.now
        self.died_at = float("-inf")
        self.reported_before_death: HoldState | None = None
        self.top_m = height_m
        self.seen_changes = 0
        self.announced_at: float | None = None
        if mode in USES_STICKS:
            self.world.hand = (0, 500)
        self._pass(1.5)

    # -- people

    @rule(position=stick_positions)
    def a_hand_is_on_the_sticks(self, position: tuple[int, int]) -> None:
        """Centres the sticks first, as a person who takes over a holding drone must."""
        self._w.hand = (0, 500)
        self._pass(0.3)
        self._w.hand = position
        self._pass(0.5)

    @rule()
    def the_hand_is_gone(self) -> None:
        self._w.hand = None

    @rule(interrupts=st.booleans(), then_s=st.sampled_from([0.1, 1.0]))
    def an_admin_takes_it(self, interrupts: bool, then_s: float) -> None:
        self._w.take(interrupts=interrupts)
        self.taken_at = self._w.now
        self._pass(then_s)

    @rule(present=st.booleans())
    def the_browser_comes_or_goes(self, present: bool) -> None:
        if not present:
            self._w.hand = None
        self._w.holder_is(present=present)

    @precondition(lambda self: self.w is not None and self.w.linked)
    @rule(mode=own_modes, sticks_end=st.booleans())
    def the_holder_commands_a_mode(self, mode: Mode, sticks_end: bool) -> None:
        if sticks_end:
            self._w.hand = None
        self._w.send(mode_command(mode))
        self.commanded_at = self._w.now
        self._pass(0.2)

    @rule()
    def the_holder_commands_a_go_to(self) -> None:
        self._w.send(go_to())
        self.commanded_at = self._w.now

    @rule()
    def somebody_says_stay(self) -> None:
        self._w.stay()

    @rule(begins=st.booleans())
    def an_admin_assists(self, begins: bool) -> None:
        self._w.assist(begins=begins)
        self._pass(0.3)

    # -- networks, power cuts, clouds

    @rule()
    def the_link_breaks(self) -> None:
        if self._w.linked:
            self._w.hand = None
            self._w.link_down()

    @precondition(lambda self: self.w is not None and self.w.onboard is not None and not self.w.linked)
    @rule(present=st.booleans())
    def the_link_is_back(self, present: bool) -> None:
        self._w.link_up(present=present)
        self.linked_since = self._w.now

    @precondition(lambda self: self.w is not None and self.w.onboard is not None)
    @rule(dead_s=st.sampled_from([0.2, 1.0, 1.0, 1.0, 2.0, 6.0]), links=st.booleans())
    def the_agent_dies_and_is_started_again(self, dead_s: float, links: bool) -> None:
        self._die()
        self._pass(dead_s)
        self._w.begin_agent()
        self.alive_since = self._w.now
        if links:
            self._pass(0.3)
            self.the_link_is_back(True)
        self._pass(SETTLES_S)

    @precondition(lambda self: self.w is not None and self.w.onboard is not None)
    @rule(for_s=st.sampled_from([0.3, 0.8, 1.2]))
    def the_computer_is_busy(self, for_s: float) -> None:
        """The agent gets no processor time, and then everything at once."""
        self._w.stalled_until = self._w.now + for_s
        self.alive_since = self._w.stalled_until
        self._pass(for_s + SETTLES_S)

    def _die(self) -> None:
        world = self._w
        world.hand = None
        reported = world.states()
        self.reported_before_death = reported[-1][1] if reported and world.linked else None
        if world.now - world.copter.mode_since < REPORTED_S:
            self.reported_before_death = None  # it was about the mode before
        self.died_at = world.now
        world.kill_agent()

    @rule(there=st.booleans())
    def the_position_comes_or_goes(self, there: bool) -> None:
        if self._w.copter.has_position is not there:
            self._w.copter.has_position = there

    @rule(loses=st.booleans(), after_s=st.sampled_from([0.003, 0.003, 0.3, 0.8, 1.2]))
    def answers_are_lost_or_slow(self, loses: bool, after_s: float) -> None:
        self._w.copter.loses_acks, self._w.copter.ack_after_s = loses, after_s

    @rule(percent=st.sampled_from([-1, 90, 25]))
    def the_battery_is(self, percent: int) -> None:
        self._w.copter.battery_percent = percent

    @rule(seconds=st.sampled_from([0.1, 0.5, 0.5, 1.0, 2.0, 2.0, 5.0, 9.0]))
    def time_passes(self, seconds: float) -> None:
        self._pass(seconds)

    # Invariants

    @property
    def w(self) -> HeldCopter | None:
        return self.world

    @property
    def _w(self) -> HeldCopter:
        assert self.world is not None
        return self.world

    def _pass(self, for_s: float) -> None:
        world = self._w
        for _ in range(max(1, round(for_s / STEP_S))):
            world.now += STEP_S
            world.step()
            self._look()

    def _look(self) -> None:
        world, copter = self._w, self._w.copter
        now = world.now
        for line in self.announcements.lines:
            if "; it was" in line:
                self.announced_at = None
            elif self.announced_at is None and ("lost: " in line or "battery is needed" in line):
                self.announced_at = now
        self.announcements.lines.clear()
        if world.sticks and world.sticks[-1].buttons:
            self.flown_at = world.sticks[-1].at
        if world.onboard is None or not world.agent.hold.open:
            self.holds_since = now
        for number, change in enumerate(copter.changes[self.seen_changes :], self.seen_changes):
            before = copter.changes[number - 1].mode if number else copter.mode
            self._changed(change.mode, change.why, change.by, before=before)
        self.seen_changes = len(copter.changes)
        alive = world.onboard is not None and now - self.alive_since > WAKES_UP_S
        flies = now - self.flown_at <= FLIES_S or now - self.commanded_at <= SHOWS_S
        if not copter.flying:
            self.top_m = copter.height_m
            return
        if flies or not alive or copter.mode in GOES_DOWN:
            self.top_m = copter.height_m
        self.top_m = max(self.top_m, copter.height_m)
        assert copter.height_m > self.top_m - ARREST_M, f"it sinks in {copter.mode.name}, and nobody flies"
        if alive and copter.mode in USES_STICKS:
            came = flies or now - copter.sticks_at <= FLIES_S
            assert came or now - copter.mode_since <= COME_WITHIN_S, f"no sticks in {copter.mode.name}"
        if alive:
            self._is_announced(now)

    def _changed(self, mode: Mode, why: str, by: int, *, before: Mode) -> None:
        world, now = self._w, self._w.now
        alive = world.onboard is not None and now - self.alive_since > WAKES_UP_S
        orphaned = world.copter.sticks_at <= self.died_at
        """The last sticks came from the previous process, so this process is not responsible for their effects."""
        if why == "radio failsafe" and alive:
            just_commanded = now - self.commanded_at <= COME_WITHIN_S
            assert orphaned or just_commanded, "a radio failsafe while the agent lives and keeps sticks"
        if why == "EKF failsafe" and alive:
            # A hold that has just begun may cross the failsafe on the line. A return or a mission that somebody
            # commanded goes on while the agent waits for the sticks of a mode that the autopilot refuses.
            begun = now - self.holds_since <= COME_WITHIN_S
            flies_itself = before is Mode.RTL or (before is Mode.AUTO and now - self.commanded_at <= REFUSED_WITHIN_S)
            assert begun or flies_itself or not world.agent.hold.open, "an EKF failsafe while the agent holds"
        if why == "radio failsafe" and orphaned and self.reported_before_death is not None:
            reported = self.reported_before_death.after_sticks
            assert reported is AfterSticks.UNKNOWN or mode in TOLD.get(reported, set()), (
                f"{mode.name}, and {reported} was told"
            )
        if by == AGENT_COMPONENT and mode in GOES_DOWN:
            reported_s = -1.0 if self.announced_at is None else now - self.announced_at
            assert reported_s >= ANNOUNCED_S, f"{mode.name} of the agent's own, {reported_s:.2f} s after the first word"

    def _is_announced(self, now: float) -> None:
        world, copter = self._w, self._w.copter
        if not world.agent.hold.open:
            self.open_since = now
        if not world.linked:
            self.linked_since = now
        since = max(self.open_since, self.linked_since, self.alive_since, self.commanded_at)
        if now - since <= PATIENCE_S:
            return
        at, state = world.states()[-1]
        assert state.open, "it is open, and that is not told"
        # After a TAKE in a return, the return ends the countdown until the autopilot shows the hold's mode.
        taken = now - self.taken_at <= SHOWS_S
        assert state.phase is not LostPhase.QUIET or now - at <= COME_WITHIN_S or taken, (
            "nothing is told of what will become of it"
        )
        assert now - at <= SEND_EVERY_S, "it was told long ago"
        if state.stage is HoldStage.STAY and now - max(copter.mode_since, since) > STOPS_S:
            assert max(copter.speed_m_s, abs(copter.climb_m_s)) < 0.5, "it is told as staying, and it moves"
        if state.phase is LostPhase.COUNTING:
            assert state.due_in_s is not None
            assert state.due_in_s - (now - at) > -0.2, "its time is over and nothing happens"

    @invariant()
    def the_newest_that_is_told_has_the_greatest_number(self) -> None:
        if self.world is not None:
            states = [one.number for _, one in self.world.states()[-3:]]
            assert states == sorted(states) or self.world.now - self.alive_since < 30.0

    def teardown(self) -> None:
        try:
            if self.world is not None:
                self._nobody_does_anything_any_more()
        finally:
            self.log.removeHandler(self.announcements)

    def _nobody_does_anything_any_more(self) -> None:
        world = self._w
        world.hand = None
        world.copter.loses_acks, world.copter.ack_after_s = False, 0.003
        if world.onboard is None:
            world.begin_agent()
            self.alive_since = world.now
        if world.linked:
            world.link_down()
        self._pass(ACTION_S + ASKING_S)
        world.link_up(present=False)
        self._pass(0.1)
        if not world.copter.flying:
            return
        assert not world.state.open or world.state.phase is LostPhase.STAYED, f"it is open, and {world.state.phase}"


OpenHoldModel.TestCase.settings = settings(
    max_examples=examples(60, long=300),
    stateful_step_count=25,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
TestOpenHold = OpenHoldModel.TestCase
