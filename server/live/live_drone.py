"""One drone as the hub knows it right now: record, holder, link, watchers. State and questions about it; no rules."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final, NamedTuple

from server.airspace.core.aircraft.near import NOTHING, Near
from server.airspace.core.separation.plausible import MotionCheck
from server.airspace.core.zones.watch import ZoneWatch
from server.alerts.core.fall_watch import FallWatch
from server.alerts.core.kept_telemetry import KeptTelemetry
from server.control.core.assist_turn import AssistTurn
from server.control.core.hold_steps import HoldSteps
from server.control.core.holder_watch import HolderWatch
from server.control.core.loan_limits import Home, Limits, LimitWatch
from server.control.core.loss_check_mark import LossCheckMark
from server.control.core.open_hold import OpenHold
from server.control.core.policy import Authorization
from server.fleet.core.views import (
    DroneView,
    HoldView,
    IdentityView,
    LoanView,
    RestraintView,
    TeamRefView,
    UserRefView,
)
from server.flights.core.tape import Tape
from server.kernel.fleet import DroneRecord
from server.kernel.people import Principal, Role, UserRef
from server.kernel.relations import Relation, Right, TeamRole, may, relation_of
from server.kernel.restraint import LIMITING, Measure
from server.link.core.agent_link import AgentLink
from server.link.core.last_heard import LastHeard
from server.link.core.noise_watch import LimitedTelemetry, NoiseWatch
from server.link.core.rtt_meter import TooLong
from server.live.browser import Browser
from server.live.flight_start import FlightStart
from server.live.live_messages import ToBrowser
from server.operations.core.onboard_state import OnboardState
from server.operations.core.onboard_views import NO_PARAMETERS, NO_PLANS
from server.readiness.core.signature import Signature
from server.towers.core.place import Place
from wire.control_messages import LossParameters, SafetySettings, StreamSettings, StreamState
from wire.firmware import firmware_words
from wire.ids import DroneId, Epoch, UserId
from wire.open_holds import Lost
from wire.own_system import OwnSystem
from wire.signing_key import Signing
from wire.zones.index import NO_ZONES, ZoneIndex

MANUAL_FOR_S: Final = 3.0
"""A drone counts as flown by hand for this long after the last stick frame: RC_OVERRIDE_TIME of the autopilots."""

ONE_HAND_S: Final = 1.0
"""Two windows of one user do not alternate: the first one flies until its sticks have been silent for this long."""

SILENT_AFTER_S: Final = 5.0
"""A browser that has not answered a ping for this long is not live. Ten pings were sent meanwhile."""

POSITION_BEFORE_S: Final = 10.0
"""A position that is older than the last heartbeat by more than this is not where the drone fell silent."""
WITHOUT_PLACE_S: Final = 60.0
"""The same while it reports that it has none: the last one is where to begin to search."""

NEVER: Final = float("-inf")


@dataclass(frozen=True)
class LeaseView:
    """The controls, as the database last reported them. `taken_from` is shut out until they accept the controls
    back."""

    holder: UserRef | None
    taken_from: UserRef | None
    epoch: Epoch
    offered: bool = False
    """Given back to `taken_from`, who has not accepted yet."""
    assistant: UserRef | None = None
    """An admin whose commands win for as long as they come."""
    view_taken: bool = False
    """`taken_from` may not watch either, but while the controls are offered to them."""
    video_moved: bool = False
    """`taken_from` may not watch the video, but while the controls are offered to them."""

    def part_takers(self) -> frozenset[UserId]:
        """Everybody who has a part in it."""
        return frozenset(user.id for user in (self.holder, self.taken_from, self.assistant) if user is not None)


def lease_of(record: DroneRecord) -> LeaseView:
    """The lease that a database record tells of."""
    return LeaseView(
        holder=record.holder,
        taken_from=record.taken_from,
        epoch=record.epoch,
        offered=record.offered,
        assistant=record.assistant,
        view_taken=record.view_taken,
        video_moved=record.video_moved,
    )


class Viewpoint(NamedTuple):
    """The standpoint from which a user sees a drone."""

    relation: Relation
    view_taken: bool
    no_video: bool
    knows_team: bool
    knows_last: bool
    """What it did before it fell silent."""


@dataclass(slots=True)
class LiveDrone:
    """Mutable; touched by the hub and its parts only, and never across an await."""

    record: DroneRecord
    lease: LeaseView
    place: Place = Place.HERE
    """The tower it belongs to. Without a bus, always this one."""
    link: AgentLink | None = None
    online: bool = False
    """The view last sent to browsers."""
    autopilot_heard: bool = False
    armed: bool | None = None
    """None: not known. Never to be read as disarmed."""
    airborne: bool | None = None
    """None: not known. It may be in the air."""
    watched_only: bool = False
    """The agent sends it no sticks and no mode by itself, as it said last: nobody has measured such a vehicle."""
    own: OwnSystem = field(default_factory=lambda: OwnSystem(judged=True))
    """Which frames of its link are of this vehicle."""
    hears_agent: bool | None = None
    """Whether its autopilot answers its agent, as the agent reports; None: not known."""
    fall_watch: FallWatch = field(default_factory=FallWatch)
    other_systems: tuple[int, ...] = ()
    """System ids of other autopilots on its line, as the agent reports."""
    signing: Signing = Signing.OFF
    """Whether its autopilot and agent sign, as the agent reports."""
    stick_gestures: int | None = None
    """Gestures to arm or disarm by sticks that its agent has held back, as it reports; None: not known yet."""
    was_airborne: bool = False
    """As last known."""
    open_hold: OpenHold = field(default_factory=OpenHold)
    flight_start: FlightStart = field(default_factory=FlightStart)
    last_heard: LastHeard = field(default_factory=LastHeard)
    fenced: bool = False
    """A change of control is pending in the database: no commands pass until it is decided."""
    sticks_at: float = NEVER
    """When the last stick frame was passed on, and from which browser."""
    sticks_from: int = 0
    safety: SafetySettings = field(default_factory=SafetySettings)
    stream: StreamSettings = field(default_factory=StreamSettings)
    stream_state: StreamState | None = None
    """As the agent reports; None without a link."""
    loss_parameters: LossParameters | None = None
    loss_check: LossCheckMark = field(default_factory=LossCheckMark)
    holder_watch: HolderWatch = field(default_factory=HolderWatch)
    rtt_watch: TooLong = field(default_factory=TooLong)
    turn: AssistTurn = field(default_factory=AssistTurn)
    offered_since: float | None = None
    holder_deaf_until: float = NEVER
    """Rehearsal: the holder counts as missing until then."""
    placed_frame: bytes | None = None
    """The newest position that is one: an estimate that fails reports 0, 0."""
    placed_at: float = NEVER
    position_frame: bytes | None = None
    """The newest GLOBAL_POSITION_INT, as it came."""
    position_at: float = NEVER
    home: Home | None = None
    """From HOME_POSITION; before that, the position before arming."""
    has_reported_home: bool = False
    limit_watch: LimitWatch = field(default_factory=LimitWatch)
    aircraft_near: Near = NOTHING
    zones: ZoneIndex = NO_ZONES
    zone_watch: ZoneWatch = field(default_factory=ZoneWatch)
    commanded: int = 0
    """Counts holds and flight commands. A command of several steps ends when it changes."""
    orders: dict[int, str] = field(default_factory=dict)
    """Reasons of the orders to hold that have not ended yet, by order id."""
    hold_steps: HoldSteps = field(default_factory=HoldSteps)
    hold_reason: str = ""
    """Why the last hold began, in words; empty: not known."""
    unheld_why: str = ""
    """How it came that nobody has the controls, in words; empty: somebody has, or it is not known."""
    hold_unconfirmed: str | None = None
    """What the agent reported when it gave up the last hold; None: it did not, or that is over."""
    hold_noted: bool = False
    """The last recorded need to repeat a hold on the next link."""
    close_until: float = NEVER
    """Until then the tower measures the round trip itself (`safety_watch`)."""
    settled_lease: LeaseView | None = None
    settled_record: DroneRecord | None = None
    """While lease and record are these, time changes nothing about it: `safety_watch` checks only its link."""
    onboard: OnboardState = field(default_factory=OnboardState)
    """The plans on board, as the agent reports."""
    telemetry: KeptTelemetry = field(default_factory=KeptTelemetry)
    heartbeat: bytes | None = None
    """The newest of the autopilot, as it came, and when."""
    heartbeat_at: float = NEVER
    agent_version: str | None = None
    """Of the agent of its newest link since the tower started, also while it is offline."""
    firmware: int = 0
    """flight_sw_version of the autopilot, as the agent reports; 0: not known."""
    motion_check: MotionCheck = field(default_factory=MotionCheck)
    """Whether it moves as a machine can. Outlives its links."""
    black_box_problem: str = ""
    """Why its black box records nothing, as the agent reports; empty: nothing is known against it."""
    tape: Tape | None = None
    """What the recorder of flights has of it. Outlives its links."""
    noise: NoiseWatch = field(default_factory=NoiseWatch)
    """How much it sends, and what the tower does about that by itself. Outlives its links."""
    limited: LimitedTelemetry | None = None
    """What has passed while its telemetry is limited."""
    preflight: Signature | None = None
    watchers: dict[int, Browser] = field(default_factory=dict)
    """Browsers that may see this drone, by their number."""
    crew_before: Mapping[UserId, TeamRole] = field(default_factory=dict)
    """The team before the last change, for the text to its former members."""

    @property
    def drone_id(self) -> DroneId:
        return self.record.id

    @property
    def is_muted(self) -> bool:
        """Whether its texts and lesser alerts reach only whoever flies it."""
        return self.record.restraint is not None or Measure.MUTED in self.noise.measures

    @property
    def is_limited(self) -> bool:
        """Whether its telemetry passes a few times a second."""
        restraint = self.record.restraint
        return (restraint is not None and restraint.measure in LIMITING) or Measure.LIMITED in self.noise.measures

    @property
    def is_quarantined(self) -> bool:
        """Whether its agent is to have no link."""
        return self.record.restraint is not None and self.record.restraint.measure is Measure.QUARANTINED

    @property
    def holder_id(self) -> UserId | None:
        return self.lease.holder.id if self.lease.holder else None

    def relation_of(self, user_id: UserId, role: Role) -> Relation:
        """The user's relation to the drone."""
        return relation_of(self.record.ties, user_id, role)

    def may(self, user_id: UserId, role: Role, right: Right) -> bool:
        """Whether this user has this right."""
        return may(relation_of(self.record.ties, user_id, role), right, holds=user_id == self.holder_id)

    def limits_of(self, user_id: UserId, role: Role) -> Limits | None:
        """The loan of a borrower; None for users with a right of their own."""
        if self.relation_of(user_id, role) is not Relation.BORROWER:
            return None
        loan = next((one for one in self.record.loans if one.user.id == user_id), None)
        return Limits(loan.may_arm, loan.max_height_m, loan.radius_m) if loan else None

    def knows_of(self, user_id: UserId, role: Role, at: datetime) -> bool:
        """Whether this user may know who did what with it at that time. Whoever has to do with it through its team
        alone knows nothing from before the drone was in it: that was another team's, perhaps."""
        team, relation = self.record.team, self.relation_of(user_id, role)
        by_team = team is not None and user_id in team.crew and relation is not Relation.ADMIN
        if team is None or not by_team or user_id in self.record.ties.owners:
            return relation is not Relation.STRANGER
        return at >= team.since

    def is_shown_to(self, browser: Browser) -> bool:
        """Whether this tower shows it to this browser: its home does; to one here, any tower if no home is heard."""
        return self.place is Place.HERE or (self.place is not Place.ELSEWHERE and not browser.is_visitor)

    def frame_watchers(self) -> list[Browser]:
        """Browsers that get its frames: all who may see it, except those barred from watching."""
        without_view = self.user_without_view
        if without_view is None:
            return list(self.watchers.values())
        return [browser for browser in self.watchers.values() if browser.viewer.user_id != without_view]

    def notify_frame_watchers(self, event: ToBrowser, of: datetime | None = None) -> None:
        """To those who get its frames; of something that began at `of`, to those who may know of it."""
        for browser in self.frame_watchers():
            if of is None or self.knows_of(browser.viewer.user_id, browser.viewer.role, of):
                browser.notify(event)

    @property
    def user_without_view(self) -> UserId | None:
        """Who gets no frames though it is their drone. Whoever is offered the controls must see what they accept."""
        lease = self.lease
        return lease.taken_from.id if lease.view_taken and not lease.offered and lease.taken_from else None

    @property
    def no_video_user_id(self) -> UserId | None:
        """Who may not watch its video though it is their drone."""
        lease = self.lease
        shut_out = (lease.view_taken or lease.video_moved) and not lease.offered
        return lease.taken_from.id if shut_out and lease.taken_from else None

    def may_arm(self, user_id: UserId) -> bool:
        """Whether this user's commands pass if the drone is online: the holder's and an assistant's do."""
        assistant = self.lease.assistant
        return user_id == self.holder_id or (assistant is not None and user_id == assistant.id)

    def authorization_of(self, viewer: Principal) -> Authorization:
        """The sender's relation to this drone. A sign-in that only watches never has the turn."""
        user_id = viewer.user_id
        return Authorization(
            has_turn=viewer.may_fly and self.may_arm(user_id),
            armed=self.armed,
            airborne=self.airborne,
            loss_check_open=self.loss_check.bars(user_id),
            may_read=self.may(user_id, viewer.role, Right.READ),
        )

    def ignores_holder(self, user_id: UserId, now: float) -> bool:
        """Whether a rehearsal makes the holder's frames be refused."""
        return user_id == self.holder_id and now < self.holder_deaf_until

    def counts_as_flying(self) -> bool:
        """In the air; or it was when it was last known, and now it is not known."""
        return self.was_airborne if self.airborne is None else self.airborne

    def flown_by_hand(self, now: float) -> bool:
        """Whether sticks have moved this drone within the last seconds."""
        return now - self.sticks_at < MANUAL_FOR_S

    def other_hands_of(self, browser: Browser, now: float) -> bool:
        """Whether another window or program of the same user is flying by hand."""
        if browser.number == self.sticks_from or now - self.sticks_at >= ONE_HAND_S:
            return False
        flying = self.watchers.get(self.sticks_from)
        return flying is not None and flying.viewer.user_id == browser.viewer.user_id

    def holder_present(self) -> bool:
        """Whether the holder has a live browser that may fly. A program that only watches does not count."""
        return any(
            browser.viewer.user_id == self.holder_id and browser.viewer.may_fly for browser in self.watchers.values()
        )

    def holder_answers(self, now: float) -> bool:
        """Whether one of those browsers answers. A frozen tab keeps its connection and does not count."""
        return any(
            browser.viewer.user_id == self.holder_id
            and browser.viewer.may_fly
            and browser.trip.rtt_s(now) < SILENT_AFTER_S
            for browser in self.watchers.values()
        )

    def holder_is_there(self, now: float) -> bool:
        """Whether the holder is present, by a browser that answers or by a program's keep-alive.

        A keep-alive cannot vouch for sticks: a pilot who flies by hand is present only with the browser that sends
        them.
        """
        kept = self.holder_watch.kept(self.holder_id, now) and not self.flown_by_hand(now)
        return kept or self.holder_answers(now)

    def somebody_flies(self) -> bool:
        """Whether there is a holder who is present and is not being rehearsed away."""
        watch = self.holder_watch
        kept = self.holder_id is not None and watch.kept_by == self.holder_id
        return watch.missing_since is None and (kept or self.holder_present())

    def silent(self, at: datetime) -> None:
        """Link or autopilot are not heard from this time on."""
        before_s = WITHOUT_PLACE_S if self.position_at > self.placed_at else POSITION_BEFORE_S
        is_of_now = self.placed_at >= self.heartbeat_at - before_s
        self.last_heard.silent(at, self.heartbeat, self.placed_frame if is_of_now else None)

    def forget_link(self, at: datetime) -> None:
        """The agent's link is gone."""
        self.silent(at)
        self.link = self.stream_state = None
        self.online = self.autopilot_heard = False
        self.armed = self.airborne = None
        self.flight_start.lost()
        self.open_hold.link_ended()
        self.hold_steps.link_ended()
        self.orders.clear()
        self.onboard.forget()
        self.telemetry.forget()
        self.heartbeat = None
        self.firmware = 0

    def view(self) -> DroneView:
        """The public view: the same for all who may see the drone, except for what `view_as` changes."""
        return DroneView(
            id=self.record.id,
            name=self.record.name,
            online=self.online,
            owners=[UserRefView.of(owner) for owner in self.record.owners],
            loans=[LoanView.of(loan) for loan in self.record.loans],
            holder=_view_of(self.lease.holder),
            epoch=self.lease.epoch,
            taken_from=_view_of(self.lease.taken_from),
            autopilot_heard=self.autopilot_heard,
            agent_version=self.agent_version,
            firmware=firmware_words(self.firmware) or None,
            release=self.telemetry.release_of(self.firmware),
            armed=self.armed if self.online else None,
            airborne=self.airborne if self.online else None,
            watched_only=self.watched_only,
            other_systems=list(self.other_systems),
            hears_agent=self.hears_agent,
            signing=self.signing,
            hold=self.hold_view(),
            last_heard=self.last_heard.view,
            airborne_since=self.flight_start.since if self.online and self.airborne else None,
            offered=self.lease.offered,
            assistant=_view_of(self.lease.assistant),
            may_watch=True,
            lost_action=self.safety.lost_action,
            lost_action_s=self.safety.lost_action_s,
            profile=self.stream_state.profile if self.stream_state else None,
            profile_chosen=self.stream.profile,
            profile_why=self.stream_state.why if self.stream_state else "",
            plans=self.onboard.plans,
            identity=IdentityView.of(self.record),
            parameters=self.onboard.parameters.state,
            suspicious_motion=self.motion_check.why if self.armed is not False else None,
            restraint=RestraintView.of(self.record.restraint, self.noise),
        )

    def hold_view(self) -> HoldView | None:
        """The open hold and the lost action, with why nobody flies it."""
        hold = self.open_hold.view(online=self.online)
        if hold is None or hold.lost is not Lost.PERSON:
            return hold
        return hold.model_copy(update={"nobody_because": self._nobody_because()})

    def _nobody_because(self) -> str:
        holder = self.lease.holder
        if holder is None:
            return self.unheld_why or "nobody has the controls"
        if self.holder_watch.missing_since is not None:
            return f"{holder.name} has the controls and is away"
        return f"{holder.name} has the controls and does not fly it"

    def view_for(self, user_id: UserId, role: Role) -> DroneView:
        """One user's view."""
        return self.view_as(self.standpoint_of(user_id, role))

    def standpoint_of(self, user_id: UserId, role: Role) -> Viewpoint:
        """The key of a user's view: users with equal keys get equal views."""
        relation = self.relation_of(user_id, role)
        last = self.last_heard.view
        return Viewpoint(
            relation=relation,
            view_taken=user_id == self.user_without_view,
            no_video=user_id == self.no_video_user_id,
            # A borrower sees the drone but not its team.
            knows_team=relation is not Relation.BORROWER or user_id in self.record.ties.crew,
            knows_last=last is None or self.knows_of(user_id, role, last.at),
        )

    def view_as(self, standpoint: Viewpoint) -> DroneView:
        """The view from this standpoint."""
        update: dict[str, object] = {"relation": standpoint.relation}
        team = self.record.team
        if team is not None and standpoint.knows_team:
            update["team"] = TeamRefView(id=team.id, name=team.name)
        if standpoint.no_video or standpoint.view_taken:
            update["may_watch_video"] = False
        if standpoint.view_taken or not standpoint.knows_last:
            update["last_heard"] = None
        if standpoint.view_taken:
            update |= {"may_watch": False, "plans": NO_PLANS, "parameters": NO_PARAMETERS, "suspicious_motion": None}
        return self.view().model_copy(update=update)


def _view_of(ref: UserRef | None) -> UserRefView | None:
    return UserRefView.of(ref) if ref else None
