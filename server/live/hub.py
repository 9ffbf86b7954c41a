"""The hub: the one owner of live state. Links, drones, leases and browsers meet here and nowhere else.

Its laws:
- Every method is a plain `def`: nothing can happen between reading and writing, so there are no locks.
- It knows no database. What it believes of users, drones and leases is handed to it, newest wins.
- It never waits for anybody: what a browser or an agent cannot take at once waits in a bounded place of its own.
- A frame goes to those who may see its drone, and from whoever has the controls to the drone. Anything else is dropped,
  counted and answered.
- What it notices and cannot decide, it tells (`on_event`), and goes on.

The parts: `live_state` (the dictionaries), `agent_reports`, `audience` (the browsers), `fleet_changes`, `flood_gate`,
`frame_paths`, `hold_orders`, `lease_changes`, `link_changes`, `safety_watch`, `separation.telling`, `video.service`.
"""

from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from typing import Any, Final

from server.domain.clock import Clock, utc_now
from server.domain.fleet import FleetSnapshot
from server.domain.people import Role, SignInId, UserRef
from server.domain.scopes import Scope
from server.live.fleet.views import DroneView
from server.live.hub_events import HubEvent
from server.live.operations.follow_feed import FollowFeed
from server.live.operations.person import Fix
from server.live.operations.service import OperationService
from server.live.relay import live_messages as live
from server.live.relay.agent_link import AgentLink
from server.live.relay.agent_reports import AgentReports
from server.live.relay.audience import Audience
from server.live.relay.browser import Browser
from server.live.relay.census import Census, take_census, who_is_online
from server.live.relay.fleet_changes import SESSION_ENDED, FleetChanges, why_signed_out
from server.live.relay.flood_gate import FloodGate, FloodLimits
from server.live.relay.frame_paths import FramePaths
from server.live.relay.hold_orders import HoldOrders
from server.live.relay.lease_changes import LeaseChanges
from server.live.relay.link_changes import LINK_REPLACED, LinkChanges
from server.live.relay.live_drone import MANUAL_FOR_S, LeaseView, LiveDrone, LossCheckMark
from server.live.relay.live_state import LiveState
from server.live.relay.safety_watch import SafetyWatch
from server.live.relay.socket_bounds import SocketBounds
from server.live.relay.traffic import Traffic
from server.live.relay.viewport import Viewport
from server.live.separation.bounds import SeparationBounds
from server.live.separation.notifier import SeparationNotifier
from server.live.video.service import VideoService
from wire.control_messages import (
    AutopilotState,
    HoldProgress,
    MalformedMessage,
    SafetySettings,
    StreamSettings,
    ToTower,
    decode_to_tower,
)
from wire.drops import DropCounts, Dropped, DropReason
from wire.ids import DroneId, LinkId, UserId
from wire.open_holds import HoldState
from wire.sealing import read_link_id
from wire.video import ClockAnswer

GOING_DOWN: Final = 1001

__all__ = ["GOING_DOWN", "LINK_REPLACED", "SESSION_ENDED", "Hub"]


class Hub:
    """See the module's laws. `now` is monotonic seconds everywhere; `clock` tells the time of day, for people."""

    def __init__(
        self,
        flood_limits: FloodLimits | None = None,
        socket_bounds: SocketBounds | None = None,
        clock: Clock = utc_now,
        separation: SeparationBounds | None = None,
        video_bounds: SocketBounds | None = None,
    ) -> None:
        self._clock = clock
        self._state = LiveState()
        self.separation = SeparationNotifier(self._state, separation or SeparationBounds())
        self._flood = FloodGate(flood_limits or FloodLimits())
        self._socket_bounds = socket_bounds or SocketBounds()
        self._paths = FramePaths(self._state, self._flood)
        self.operations = OperationService(self._state, clock)
        self.follows = FollowFeed(self._state, self.operations)
        self._video_bounds = video_bounds or SocketBounds()
        self.video = VideoService(self._state, self._video_bounds)
        self._reports = AgentReports(self._state, self.operations, self.video)
        self._safety = SafetyWatch(self._state)
        self._holds = HoldOrders(self._state, number_after=int(clock().timestamp()))
        self._links = LinkChanges(self._state, order_hold=self._holds.order)
        self._leases = LeaseChanges(self._state, note_presence=self._safety.note_presence)
        self._fleet = FleetChanges(self._state, lease_learnt=self._leases.learnt)
        self._audience = Audience(
            self._state, note_presence_of=self._safety.note_presence_of, close=self._fleet.close_browser
        )
        self._next_browser = 0

    @property
    def drops(self) -> DropCounts:
        """What was not passed on, by reason."""
        return self._state.drops

    @property
    def traffic(self) -> Traffic:
        """What was passed on, and how fast."""
        return self._state.traffic

    def census(self) -> Census:
        """Who and what is there, and waits, at this moment."""
        return take_census(self._state)

    @property
    def on_event(self) -> Callable[[HubEvent], None]:
        """Whoever acts on what the hub notices."""
        return self._state.on_event

    @on_event.setter
    def on_event(self, listener: Callable[[HubEvent], None]) -> None:
        self._state.on_event = listener

    # -- what the database says ------------------------------------------------------------------------------

    def apply_fleet(self, snapshot: FleetSnapshot) -> None:
        """Takes over drones, owners, accounts and leases. A snapshot older than the last one is ignored."""
        self._fleet.apply(snapshot)
        self.video.end_where(lambda principal: why_signed_out(principal, snapshot))
        self.video.recheck()

    def apply_lease(
        self, drone_id: DroneId, lease: LeaseView, *, event: str, by: UserRef | None, reason: str, now: float
    ) -> None:
        """Takes over a lease that has been committed. From this call on the old holder's frames are refused."""
        self._leases.apply(drone_id, lease, event=event, by=by, reason=reason, now=now)
        self._fleet.look_at_former_holder(drone_id)
        self.video.recheck(drone_id)

    def fence(self, drone_id: DroneId) -> None:
        """A change of control is about to be decided: until `apply_lease` or `unfence` nobody's commands pass."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            drone.fenced = True

    def unfence(self, drone_id: DroneId) -> None:
        """The change was refused: the holder goes on."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            drone.fenced = False

    def apply_safety(self, drone_id: DroneId, settings: SafetySettings) -> None:
        """How a drone holds, from now on; its agent is told."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.safety != settings:
            drone.safety = settings
            self._state.tell_agent_safety(drone)
            self._state.tell_drone(drone)

    def apply_stream(self, drone_id: DroneId, settings: StreamSettings) -> None:
        """How much telemetry a drone is to send, from now on; its agent is told."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.stream != settings:
            drone.stream = settings
            self._state.tell_agent(drone, settings)
            self._state.tell_drone(drone)

    def set_loss_check(self, drone_id: DroneId, mark: LossCheckMark) -> None:
        """What the check before flight came to. Everybody who sees the drone hears that it has changed."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.loss_check != mark:
            drone.loss_check = mark
            self._state.tell_watchers(drone, live.LossCheckChanged(drone_id))

    # -- what others ask -------------------------------------------------------------------------------------

    def drone_for(self, drone_id: DroneId, user_id: UserId, role: Role) -> LiveDrone | None:
        """The drone, or None both where it does not exist and where this user may not see it."""
        drone = self._state.drones.get(drone_id)
        return drone if drone is not None and drone.may_be_seen_by(user_id, role) else None

    def drones_for(self, user_id: UserId, role: Role) -> list[LiveDrone]:
        """By number."""
        return [drone for _, drone in sorted(self._state.drones.items()) if drone.may_be_seen_by(user_id, role)]

    def drone_view(self, drone_id: DroneId, user_id: UserId, role: Role) -> DroneView | None:
        """`drone_for`, as it is told to the outside."""
        drone = self.drone_for(drone_id, user_id, role)
        return drone.view_for(user_id, role) if drone else None

    def drone_views(self, user_id: UserId, role: Role) -> list[DroneView]:
        """`drones_for`, as it is told to the outside."""
        return [drone.view_for(user_id, role) for drone in self.drones_for(user_id, role)]

    @property
    def fleet_revision(self) -> int:
        """Of the last snapshot; -1 before the first."""
        return self._fleet.revision

    def knows_sign_in(self, sign_in: SignInId) -> bool:
        """Whether the last snapshot has this session or token. It lacks a session that began after it was read."""
        return self._fleet.knows_sign_in(sign_in)

    def is_admin(self, user_id: UserId) -> bool:
        """Whether this account is that of an admin of the tower."""
        return self._fleet.is_admin(user_id)

    def drone(self, drone_id: DroneId) -> LiveDrone | None:
        """Any drone, for those who have to act on it whoever asked."""
        return self._state.drones.get(drone_id)

    def drone_ids(self) -> list[DroneId]:
        """Of every drone there is."""
        return sorted(self._state.drones)

    def anybody_flies_by_hand(self, now: float) -> bool:
        """Whether sticks have moved any drone within the last seconds."""
        return now - self._state.sticks_at < MANUAL_FOR_S

    # -- browsers --------------------------------------------------------------------------------------------

    def why_no_room(self, user_id: UserId, address: str, now: float) -> str | None:
        """Why this user may not open one more live connection from there; None if they may."""
        bounds = self._socket_bounds
        if not self._flood.admits_opening(user_id, now, most_open=bounds.per_user):
            return "too many connections of this user were opened in a short time: wait a little"
        return bounds.refusal(self._state.browsers.values(), user_id, address)

    def why_no_room_for_video(self, user_id: UserId, address: str, now: float) -> str | None:
        """The same for one more stream of video."""
        if not self._flood.admits_opening(user_id, now, most_open=self._video_bounds.per_user, video=True):
            return "too many streams were opened by this user in a short time: wait a little"
        return self.video.why_no_room(user_id, address)

    def hears_request(self, browser: Browser, now: float) -> bool:
        """Whether a text message of this browser is looked at. If not, it is counted and answered."""
        if browser.ended:
            return False
        heard = browser.requests.take(1.0, now)
        if not heard:
            self._state.refuse(browser, DropReason.FLOOD, None, now)
        return heard

    def next_browser_number(self) -> int:
        """A number for a Browser about to be attached."""
        self._next_browser += 1
        return self._next_browser

    def attach_browser(self, browser: Browser, server_time: str, now: float) -> None:
        """From here on the browser gets the frames of the drones it may see; the whole picture comes first."""
        viewer = browser.viewer
        self._audience.enter(browser, self.drones_for(viewer.user_id, viewer.role), server_time, now)
        self.separation.tell_all(browser)

    def detach_browser(self, browser: Browser, now: float) -> None:
        """The browser is gone. Harmless if it was gone already."""
        self._audience.leave(browser, now)
        self.follows.browser_gone(browser.number)

    def person_fix(self, browser: Browser, told: live.PersonFix, now: float) -> None:
        """Where the person at this browser is; it counts while a drone follows them."""
        late_s = browser.lateness.late_by(told.sent_ms, now, at_most_s=browser.trip.late_at_most_s(now))
        at = now - late_s - told.age_ms / 1000.0
        fix = Fix(told.lat, told.lon, told.accuracy_m, at, told.speed_m_s, told.heading_deg)
        self.follows.person_fix(DroneId(told.drone_id), fix, browser=browser.number, asked_by=browser.viewer)

    def count_agents(self) -> tuple[int, int]:
        """(drones there are, drones online)."""
        return len(self._state.drones), sum(drone.online for drone in self._state.drones.values())

    def who_is_online(self) -> list[tuple[UserId, str, int]]:
        """(user, name, live connections) of everybody who has one, by name."""
        return who_is_online(self._state)

    def count_browsers(self) -> tuple[int, int]:
        """(live connections, different users behind them)."""
        browsers = self._state.browsers.values()
        return len(browsers), len({browser.viewer.user_id for browser in browsers})

    def end_loans(self, at: datetime) -> bool:
        """Ends the loans whose time is over at `at` (the time of day). Whether there was any."""
        ended = self._fleet.end_loans(at)
        if ended:
            self.video.recheck()
        return ended

    def tell_admins_of_enrolment(self, enrolment: Mapping[str, Any]) -> None:
        """How an enrolment goes, to every admin's browsers; to programs only if they were made for administration."""
        for browser in self._state.browsers.values():
            if browser.viewer.role is Role.ADMIN and Scope.ADMIN in browser.viewer.scopes:
                browser.tell(live.EnrolmentChanged(dict(enrolment)))

    def sockets_of(self, signed_in_by: SignInId) -> int:
        """How many connections a session or a token has open, live and of video."""
        live_ones = sum(browser.viewer.session_id == signed_in_by for browser in self._state.browsers.values())
        return live_ones + self.video.sockets_of(signed_in_by)

    def end_sessions(self, session_ids: Iterable[SignInId], why: str = "the session has ended") -> None:
        """Closes the browsers of sessions and tokens that have ended. Who has no other loses the controls at once."""
        ended = list(session_ids)
        self._audience.end_sessions(ended, why)
        self.video.end_sessions(ended, why)

    def end_user(self, user_id: UserId, why: str) -> None:
        """Closes every browser of an account, which reads why."""
        self._audience.end_user(user_id, why)
        self.video.end_user(user_id, why)

    def say_good_bye(self) -> None:
        """The tower is going down: everybody is told, so that they come back instead of wondering."""
        for browser in self._state.browsers.values():
            browser.close(GOING_DOWN, "the tower is going down")
        for link in self._state.links.values():
            link.close(GOING_DOWN, "the tower is going down")
        self.video.say_good_bye()

    def focus(self, browser: Browser, drone_id: DroneId | None, now: float) -> None:
        """The browser wants the frames of one drone at once."""
        self._audience.focus(browser, drone_id, now)

    def show_map(self, browser: Browser, viewport: Viewport | None) -> None:
        """Which part of the map the browser shows: drones outside it are sent less often."""
        self._audience.show_map(browser, viewport)

    def frames_from_browser(self, browser: Browser, message: bytes, now: float) -> None:
        """A binary message: checks each frame in turn and passes on what may pass."""
        if browser.number in self._state.browsers and not browser.ended:
            self._paths.down(browser, message, now)

    # -- agents ----------------------------------------------------------------------------------------------

    def attach_link(self, link: AgentLink, now: float) -> None:
        """An agent signed in. A link that its drone already had is closed: the newest one counts."""
        self._links.attach(link, now)
        self.video.link_changed(link.drone_id, now)

    def detach_link(self, link: AgentLink) -> None:
        """The link is gone. Harmless if it was gone already or has been replaced."""
        self._links.detach(link)
        self.video.link_changed(link.drone_id)

    def lose_channel(self, link: AgentLink, now: float) -> bool:
        """The control channel of a link has broken off. Whether that was the link's end."""
        ended = self._links.lose_channel(link, now)
        self.video.link_changed(link.drone_id, now)
        return ended

    def resumable(self, link_id: int, drone_id: DroneId, now: float) -> AgentLink | None:
        """The link of this drone that may have another control channel, if the agent proves that it is its."""
        return self._links.resumable(link_id, drone_id, now)

    def resumed(self, link: AgentLink) -> None:
        """The link has another control channel."""
        self._links.resumed(link)
        self.operations.resumed(link)
        self.video.resumed(link)

    def live_link(self, link_id: LinkId) -> AgentLink | None:
        """The link of this number, while it stands."""
        return self._state.links.get(link_id)

    def has_link_id(self, link_id: LinkId) -> bool:
        """Whether a live link has this number."""
        return link_id in self._state.links

    def datagram(self, datagram: bytes, link_id: LinkId, address: tuple[str, int], now: float) -> None:
        """A datagram that claims to be of `link_id`. Raises Dropped with the check that it failed."""
        state = self._state
        link = state.links.get(link_id)
        if link is None:
            read_link_id(datagram)  # says what is wrong with it, unless it is the link
            raise Dropped(DropReason.UNKNOWN_LINK)
        received = link.receive(datagram, address, now)
        traffic = state.traffic
        traffic.datagrams_from_agents += 1
        traffic.bytes_from_agents += len(datagram)
        drone = state.drones[link.sealed.drone_id]
        if not drone.online:
            drone.online = True
            state.tell_drone(drone)
        if received.frames is not None:
            self._paths.up(drone, received.frames, now)
        elif received.urgent is not None:
            self._urgent(link, received.urgent, now)

    def _urgent(self, link: AgentLink, text: bytes, now: float) -> None:
        if not self._flood.admits_report(link.drone_id, now):
            raise Dropped(DropReason.FLOOD)
        try:
            message = decode_to_tower(text)
        except MalformedMessage:
            raise Dropped(DropReason.BAD_CONTENT) from None
        if isinstance(message, HoldProgress):
            self.report(link, message)
        elif isinstance(message, HoldState):
            self.report(link, message, at=self._clock())  # numbered: the newest counts, whatever the way
        elif isinstance(message, ClockAnswer):
            self.video.clock_answered(link, message, now)
        elif isinstance(message, AutopilotState) and not link.has_channel:
            # Else the control channel tells it, where nothing can be overtaken.
            self.report(link, message, at=self._clock())

    def hears_report(self, link: AgentLink, now: float) -> bool:
        """Whether a message of this agent's control channel is looked at. If not, it is counted."""
        heard = self._flood.admits_report(link.drone_id, now)
        self.drops[DropReason.FLOOD] += not heard
        return heard

    def report(self, link: AgentLink, message: ToTower, *, at: datetime | None = None) -> None:
        """The agent tells something. `at`: the time of day, for what people are told the time of."""
        self._reports.take(link, message, at)

    def admits_operation(self, user_id: UserId, now: float, *, stops: bool) -> bool:
        """Whether a user may have one more thing done at a drone now (FloodGate)."""
        return self._flood.admits_operation(user_id, now, stops=stops)

    def admits_recording(self, user_id: UserId, now: float) -> bool:
        """Whether a user may begin one more recording now (FloodGate)."""
        return self._flood.admits_recording(user_id, now)

    # -- holds and rehearsals --------------------------------------------------------------------------------

    def order_hold(self, drone_id: DroneId, reason: str, *, interrupts: bool = False) -> bool:
        """Tells the agent to hold, and everybody that it was ordered. `interrupts`: also a return or a landing that the
        autopilot flies. False if there is no agent to tell: it is ordered when there is."""
        return self._holds.order(drone_id, reason, interrupts=interrupts)

    def keep_hold(self, drone_id: DroneId) -> None:
        """A tower before this one left a hold that was open, or owed to a drone that was offline."""
        self._holds.keep(drone_id)

    def tell_stay(self, drone_id: DroneId, by: str) -> bool:
        """Somebody said "stay": the lost action for a lost person waits. False if there is no agent to tell."""
        return self._holds.stay(drone_id, by)

    def keep_controls(self, drone: LiveDrone, user_id: UserId, now: float) -> None:
        """A program of the holder says that it is there."""
        self._safety.keep(drone, user_id, now)

    def rehearse_operator_loss(self, drone_id: DroneId, *, for_s: float, now: float) -> None:
        """The holder counts as gone for so long."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            drone.holder_deaf_until = now + for_s
            self._safety.note_presence(drone, now)
            # A rehearsal is there to see the hold, so it counts as flown by hand.
            drone.holder_watch.by_hand = True

    def rehearse_tower_loss(self, drone_id: DroneId, *, for_s: float) -> None:
        """Nothing is sent to this agent on the data channel for so long."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.link is not None:
            drone.link.mute(for_s)

    def tell_rehearsal(
        self, drone_id: DroneId, what: str, phase: str, hold_ms: float | None, text: str, *, lasts_s: float
    ) -> None:
        """How a rehearsal goes on."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            self._state.tell_watchers(drone, live.Rehearsal(drone_id, what, phase, hold_ms, text, lasts_s))

    def tell_video_watchers(self, drone_id: DroneId, event: live.ToBrowser, *, of: datetime) -> None:
        """To everybody who may watch the video of the drone, of something that began then."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            self._state.tell_video_watchers(drone, event, of=of)

    # -- time ------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Several times a second: everything that time alone can change."""
        self._safety.tick(now)
        self._links.tick(now)
        self._leases.tick(now)
        self.operations.tick(now)
        self.follows.tick(now)
        self.separation.tick(now)
        self.video.tick(now)

    def each_second(self, now: float) -> None:
        """Once a second: whose map shows which drones, and how the link of every drone is that is online."""
        self._audience.look_at_maps()
        self._flood.forget_idle(self._state.drones, now)
        self._state.tell_links(self._state.drones.values(), now)
