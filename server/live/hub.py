"""The hub: the one owner of live state. Links, drones, leases and browsers meet here and nowhere else.

Rules:

- Every method is a plain `def`: nothing happens between a read and a write, so there are no locks.
- It knows no database. Users, drones and leases are handed to it; the newest wins.
- It never waits: what a browser or an agent cannot take at once waits in a bounded queue.
- A frame goes from a drone to those who may see it, and from the pilot to the drone. Everything else is dropped,
  counted and answered.
- What it notices and cannot decide, it reports (`state.on_event`).

Its parts are public: callers use them directly. The hub itself has only what touches several parts. Do not add methods
that only forward to one part.
"""

from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from typing import Any, Final

from server.airspace.core.aircraft.service import AircraftService
from server.airspace.core.separation.bounds import SeparationBounds
from server.airspace.core.separation.notifier import SeparationNotifier
from server.airspace.core.zones.service import ZoneService
from server.alerts.core.service import AlertService
from server.control.core.hold_orders import HoldOrders
from server.control.core.lease_changes import LeaseChanges
from server.control.core.safety_watch import SafetyWatch
from server.flights.core.black_box import BlackBoxFetcher
from server.flights.core.recorder import FlightRecorder
from server.kernel.access import AccessRequest, Action, judge
from server.kernel.clock import Clock, utc_now
from server.kernel.fleet import FleetSnapshot
from server.kernel.people import SignInId, UserRef
from server.kernel.shares import Shares
from server.link.core.agent_link import AgentLink
from server.link.core.agent_reports import AgentReports
from server.link.core.flood_gate import FloodGate, FloodLimits
from server.link.core.frame_paths import FramePaths
from server.link.core.link_changes import LINK_REPLACED, LinkChanges
from server.link.core.socket_bounds import SocketBounds
from server.live import live_messages as live
from server.live.audience import Audience
from server.live.browser import Browser
from server.live.drone_changes import DroneChanges
from server.live.fleet_changes import SESSION_ENDED, FleetChanges, why_signed_out
from server.live.hub_events import NoiseJudged
from server.live.live_drone import LeaseView, LiveDrone
from server.live.live_state import LiveState
from server.live.squads import Squads
from server.operations.core.follow_feed import FollowFeed
from server.operations.core.observed_commands import ObservedCommands
from server.operations.core.person import Fix
from server.operations.core.service import OperationService
from server.towers.core.place import Place
from server.towers.core.visits import Visits
from server.video.core.service import VideoService
from wire.control_messages import (
    AutopilotState,
    HoldProgress,
    MalformedMessage,
    decode_to_tower,
)
from wire.drops import Dropped, DropReason
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
        height_limit_m: float = 0.0,
        shares: Shares | None = None,
    ) -> None:
        self._clock = clock
        self._socket_bounds = socket_bounds or SocketBounds()
        self._video_bounds = video_bounds or SocketBounds()
        self._next_browser = 0
        state = self.state = LiveState(clock, shares)
        """Drones, links, browsers, counters. Everybody may read it; only the hub and its parts write. `on_event` is for
        the one who acts on what the hub notices."""
        self.squads = Squads(state)
        """What a user sees. For routes and channels."""
        self.flood = FloodGate(flood_limits or FloodLimits(), state.shares)
        """Who may ask for one more operation or recording now. For routes."""
        self.operations = OperationService(state, clock)
        """Work at drones. For routes of commands, plans, parameters, logs."""
        self.follows = FollowFeed(state, self.operations)
        """Drones that follow something. For the routes of commands."""
        self.video = VideoService(state, self._video_bounds)
        """For the channels of video, and for recordings."""
        self.separation = SeparationNotifier(state, separation or SeparationBounds())
        """Which drones come near each other. For the metrics."""
        self.aircraft = AircraftService(state)
        """Other aircraft around the drones. For the network feed, and for the metrics."""
        self.zones = ZoneService(state)
        """Where drones may not be. For routes, for the metrics, and for the store."""
        self.alerts = AlertService(state, self.separation, height_limit_m)
        """What needs attention at which drone. For routes, for the metrics, and for the store."""
        self.black_box = BlackBoxFetcher(state)
        """Fetches from drones what their links lost. For the store, and for the metrics."""
        self.reports = AgentReports(state, self.operations, self.video, self.black_box)
        """What agents report. For the control channel."""
        self.safety = SafetyWatch(state)
        """Presence of people. A program that keeps the controls reports here."""
        self.holds = HoldOrders(state, number_after=int(clock().timestamp()))
        """Orders to hold and to stay. For the services of the controls."""
        self.links = LinkChanges(state, order_hold=self.holds.order)
        """To ask which link may be resumed; what changes one goes through the hub."""
        self.changes = DroneChanges(state, note_presence=self.safety.note_presence)
        """Fence, settings, rehearsals of one drone. For the services of the controls."""
        self._leases = LeaseChanges(state, note_presence=self.safety.note_presence)
        self.fleet = FleetChanges(state, lease_learnt=self._leases.learnt)
        """The last applied snapshot and its accounts. Read only."""
        self.audience = Audience(state, note_presence_of=self.safety.note_presence_of, close=self.fleet.close_browser)
        """What a browser wants to see. For the live channel."""
        self.observed = ObservedCommands(clock)
        """Commands that came as raw frames. For the audit trail."""
        self.flights = FlightRecorder(state)
        """Records flights. For the store, and for whoever notes what belongs to a flight."""
        state.on_told = self.flights.told
        self.alerts.listeners.append(self.flights.alert)
        self._paths = FramePaths(state, self.flood, self.observed, self.flights)
        self.visits: Visits | None = None
        """The browsers here, at other towers. None without a bus."""
        self.takes_browsers = True
        """False: this tower ends its work, and sends browsers elsewhere."""
        self._ticks: tuple[tuple[str, Callable[[float], None]], ...] = (
            ("safety", self.safety.tick),
            ("links", self.links.tick),
            ("leases", self._leases.tick),
            ("operations", self.operations.tick),
            ("observed commands", lambda now: self.observed.tick(now, state.mode_of)),
            ("following", self.follows.tick),
            ("separation", self.separation.tick),
            ("zones", self.zones.tick),
            ("aircraft", self.aircraft.tick),
            ("alerts", self.alerts.tick),
            ("video", self.video.tick),
            ("flights", self.flights.tick),
            ("black boxes", self.black_box.tick),
        )

    # -- database snapshots ----------------------------------------------------------------------------------

    def apply_fleet(self, snapshot: FleetSnapshot) -> None:
        """Takes over drones, owners, accounts and leases. A snapshot older than the last one is ignored."""
        self.fleet.apply(snapshot)
        self.video.end_where(lambda principal: why_signed_out(principal, snapshot))
        self.video.recheck()

    def apply_lease(
        self, drone_id: DroneId, lease: LeaseView, *, event: str, by: UserRef | None, reason: str, now: float
    ) -> None:
        """Takes over a lease that has been committed. From this call on the old holder's frames are refused."""
        self._leases.apply(drone_id, lease, event=event, by=by, reason=reason, now=now)
        self.fleet.check_lease(drone_id)
        self.video.recheck(drone_id)

    # -- browsers --------------------------------------------------------------------------------------------

    def capacity_refusal(self, user_id: UserId, address: str, now: float) -> str | None:
        """Why this user may not open one more live connection from there; None if they may."""
        bounds = self._socket_bounds
        if not self.flood.admits_opening(user_id, now, most_open=bounds.per_user):
            return "this user opened too many connections in a short time: wait a little"
        return bounds.refusal(self.state.browsers.values(), user_id, address)

    def video_capacity_refusal(self, user_id: UserId, address: str, now: float) -> str | None:
        """The same for one more stream of video."""
        if not self.flood.admits_opening(user_id, now, most_open=self._video_bounds.per_user, video=True):
            return "this user opened too many streams in a short time: wait a little"
        return self.video.capacity_refusal(user_id, address)

    def admits_request(self, browser: Browser, now: float) -> bool:
        """Whether a text message of this browser is looked at. If not, it is counted and answered."""
        if browser.ended:
            return False
        heard = browser.requests.take(1.0, now)
        if not heard:
            self.state.refuse(browser, DropReason.FLOOD, None, now)
        return heard

    def next_browser_number(self) -> int:
        """A number for a Browser about to be attached."""
        self._next_browser += 1
        return self._next_browser

    def attach_browser(self, browser: Browser, server_time: str, now: float) -> None:
        """From here on the browser gets the frames of the drones it may see; the whole picture comes first."""
        others = self.visits is not None and self.visits.has_others
        alerts = self.alerts.welcome(browser)
        self.audience.enter(browser, self._shown_to(browser), alerts, server_time, now, other_towers=others)
        self.separation.send_all(browser)
        if self.visits is not None:
            self.visits.entered(browser)

    def attach_visitor(self, browser: Browser, now: float) -> None:
        """The same for a browser that is connected to another tower: it sees the drones whose home is this one."""
        self.audience.enter_visitor(browser, self._shown_to(browser), now)
        self.separation.send_all(browser)

    def _shown_to(self, browser: Browser) -> list[LiveDrone]:
        viewer = browser.viewer
        return [one for one in self.squads.drones(viewer.user_id, viewer.role) if one.is_shown_to(browser)]

    def detach_browser(self, browser: Browser, now: float) -> None:
        """Removes a browser. Idempotent."""
        self.audience.leave(browser, now)
        self.follows.browser_gone(browser.number)
        if self.visits is not None:
            self.visits.left(browser.number)

    def person_fix(self, browser: Browser, fix_message: live.PersonFix, now: float) -> None:
        """Where the person at this browser is; it counts while a drone follows them."""
        late_s = browser.lateness.late_by(fix_message.sent_ms, now, at_most_s=browser.trip.late_at_most_s(now))
        at = now - late_s - fix_message.age_ms / 1000.0
        fix = Fix(
            fix_message.lat, fix_message.lon, fix_message.accuracy_m, at, fix_message.speed_m_s, fix_message.heading_deg
        )
        self.follows.person_fix(DroneId(fix_message.drone_id), fix, browser=browser.number, asked_by=browser.viewer)

    def end_loans(self, at: datetime) -> bool:
        """Ends the loans whose time is over at `at` (the time of day). Whether there was any."""
        ended = self.fleet.end_loans(at)
        if ended:
            self.video.recheck()
        return ended

    def notify_admins_of_enrolment(self, enrolment: Mapping[str, Any]) -> None:
        """How an enrolment goes, to every admin's browsers; to programs only if they were made for administration."""
        for browser in self.state.browsers.values():
            if judge(AccessRequest(browser.viewer, Action.ADMINISTER)).allowed:
                browser.notify(live.EnrolmentChanged(dict(enrolment)))

    def sockets_of(self, signed_in_by: SignInId) -> int:
        """How many connections a session or a token has open, live and of video."""
        live_ones = sum(browser.viewer.session_id == signed_in_by for browser in self.state.browsers.values())
        return live_ones + self.video.sockets_of(signed_in_by)

    def end_sessions(
        self, session_ids: Iterable[SignInId], why: str = "the session has ended", *, told: bool = False
    ) -> None:
        """Closes the browsers of sessions and tokens that have ended. Who has no other loses the controls at once.
        `told`: by another tower."""
        ended = list(session_ids)
        if self.visits is not None and not told:
            self.visits.sessions_ended(ended, why)
        self.fleet.note_ended(ended)
        self.audience.end_sessions(ended, why)
        self.video.end_sessions(ended, why)

    def end_user(self, user_id: UserId, why: str, *, told: bool = False) -> None:
        """Closes every browser of an account, which reads why. `told`: by another tower."""
        if self.visits is not None and not told:
            self.visits.user_ended(user_id, why)
        self.audience.end_user(user_id, why)
        self.video.end_user(user_id, why)

    def close_all(self) -> None:
        """The tower stops: notifies everybody, so that clients reconnect."""
        for browser in list(self.state.browsers.values()):  # one of another tower leaves at once
            browser.close(GOING_DOWN, "the tower is shutting down")
        for link in list(self.state.links.values()):
            link.close(GOING_DOWN, "the tower is shutting down")
        self.video.close_all()

    def frames_from_browser(self, browser: Browser, message: bytes, now: float) -> None:
        """A binary message: checks each frame in turn and passes on what may pass."""
        if browser.number not in self.state.browsers or browser.ended:
            return
        if self.visits is not None and not browser.is_visitor:
            left = self.visits.divert(browser, message, now)
            if left is None:
                return
            message = left
        self._paths.down(browser, message, now)

    # -- agents ----------------------------------------------------------------------------------------------

    def attach_link(self, link: AgentLink, now: float) -> None:
        """An agent signed in. A link that its drone already had is closed: the newest one counts."""
        self.links.attach(link, now)
        self.flights.linked(self.state.drones[link.drone_id], now)
        self.video.link_changed(link.drone_id, now)

    def detach_link(self, link: AgentLink) -> None:
        """Removes a link. Idempotent, also for a replaced link."""
        self.links.detach(link)
        self.video.link_changed(link.drone_id)

    def lose_channel(self, link: AgentLink, now: float) -> bool:
        """The control channel of a link has broken off. Whether that was the link's end."""
        ended = self.links.lose_channel(link, now)
        self.video.link_changed(link.drone_id, now)
        return ended

    def resumed(self, link: AgentLink) -> None:
        """The link has another control channel."""
        self.links.resumed(link)
        self.operations.resumed(link)
        self.video.resumed(link)

    def datagram(self, datagram: bytes, link_id: LinkId, address: tuple[str, int], now: float) -> None:
        """A datagram that claims to be of `link_id`. Raises Dropped with the check that it failed."""
        state = self.state
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
            if drone.autopilot_heard:
                drone.last_heard.heard_again()
            state.publish_drone(drone)
        if received.frames is not None:
            self._paths.up(drone, received.frames, now)
        elif received.urgent is not None:
            self._urgent(link, received.urgent, now)

    def _urgent(self, link: AgentLink, text: bytes, now: float) -> None:
        if not self._admits_report(link, now):
            raise Dropped(DropReason.FLOOD)
        try:
            message = decode_to_tower(text)
        except MalformedMessage:
            raise Dropped(DropReason.BAD_CONTENT) from None
        if isinstance(message, HoldProgress):
            self.reports.receive(link, message)
        elif isinstance(message, HoldState):
            self.reports.receive(link, message, self._clock())  # numbered: the newest counts, whatever the way
        elif isinstance(message, ClockAnswer):
            self.video.clock_answered(link, message, now)
        elif isinstance(message, AutopilotState) and not link.has_channel:
            # Otherwise the control channel reports it, in order.
            self.reports.receive(link, message, self._clock())

    def admits_report(self, link: AgentLink, now: float) -> bool:
        """Whether a message of this agent's control channel is looked at. If not, it is counted."""
        heard = self._admits_report(link, now)
        self.state.drops[DropReason.FLOOD] += not heard
        return heard

    def _admits_report(self, link: AgentLink, now: float) -> bool:
        drone = self.state.drones.get(link.drone_id)
        if drone is None:
            return False
        drone.noise.reports += 1
        return self.flood.admits_report(link.drone_id, now, limited=drone.is_limited)

    def _judge_noise(self, now: float) -> None:
        at = self.state.clock()
        for drone in self.state.drones.values():
            if drone.noise.look(now, at):
                self.state.publish_soon(drone)
                self.state.on_event(NoiseJudged(drone.drone_id, drone.noise.measures, drone.noise.words))

    # -- several towers --------------------------------------------------------------------------------------

    def place_drone(self, drone_id: DroneId, place: Place, now: float, *, keeps_link: bool = False) -> None:
        """The drone belongs to another tower now, or to this one. `keeps_link`: its agent has just come here, and what
        another tower says is older."""
        drone = self.state.drones.get(drone_id)
        if drone is None or drone.place is place:
            return
        drone.place = place
        self.fleet.admit_watchers(drone)
        if place in (Place.ELSEWHERE, Place.OUT_OF_REACH) and not keeps_link:
            self.end_superseded_link(drone_id)
        self.safety.note_presence(drone, now)

    def end_superseded_link(self, drone_id: DroneId) -> None:
        """Another tower has become the drone's home since its agent linked here, because the agent has linked there."""
        drone = self.state.drones.get(drone_id)
        if drone is not None and drone.link is not None:
            drone.link.close(LINK_REPLACED, "the drone has signed in at another tower")
            self.detach_link(drone.link)

    def adopt_lease(self, drone_id: DroneId, lease: LeaseView, now: float, *, moved: bool) -> None:
        """The lease of a drone that comes home, as the database has it. `moved`: from another tower, so what is known
        here of its holder's presence is void."""
        drone = self.state.drones.get(drone_id)
        if drone is None or lease.epoch < drone.lease.epoch or (not moved and lease.epoch == drone.lease.epoch):
            return
        drone.holder_watch.present()
        drone.turn.reset()
        drone.lease = lease
        self.safety.note_presence(drone, now)
        self.state.send_holder_to_agent(drone)

    # -- time ------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Several times a second: everything that time alone can change."""
        self.state.publish_waiting()
        for part, tick in self._ticks:
            try:
                tick(now)
            except Exception as error:  # one part must not end what watches over every flight
                self.state.on_fault(part, None, error)

    def each_second(self, now: float) -> None:
        """Once a second: whose map shows which drones, and how the link of every drone is that is online."""
        self.audience.check_map_viewers()
        self._judge_noise(now)
        self.state.shares.tick(now)
        self.flood.forget_idle(self.state.drones, now)
        self.state.publish_links(self.state.drones.values(), now)
