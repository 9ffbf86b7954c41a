"""The video service, part of the hub: who watches what, what agents must send, and units from one to many.

Rules, besides the hub's:

- A unit goes to those who may watch its drone at this instant: the call that ends a right also removes the viewer.
- A unit is prepared once, and all viewers get the same bytes; nobody waits for anybody.
- Only some of many viewers are written to at once, the rest after other arrivals: frames first.
"""

import secrets
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final

from server.kernel.people import Principal, SignInId
from server.link.core.agent_link import AgentLink
from server.link.core.socket_bounds import SocketBounds
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from server.video.core.drone_video import AgentVideoChannel, DroneVideo, Flow
from server.video.core.fan_out import FanOut
from server.video.core.streams import Relayed, StreamKey, StreamSink
from server.video.core.traffic import VideoTraffic
from server.video.core.viewer import Recipient, VideoViewer
from server.video.core.viewer_messages import Drawn
from server.video.core.watching import NO_SUCH_DRONE, video_taken, why_not_watch
from server.video.core.websocket_bytes import BINARY, whole_message
from wire.ids import DroneId, UserId
from wire.video import ClockAnswer, UnitHead, VideoState, decode_head, with_capture_time

SESSION_ENDED: Final = 4401
GOING_DOWN: Final = 1001
CHANNEL_REPLACED: Final = 4409

CHECK_VIEWERS_EVERY_S: Final = 0.4


class VideoService:
    """One for the hub."""

    def __init__(self, state: LiveState, bounds: SocketBounds, new_ticket: Callable[[], str] | None = None) -> None:
        self._state = state
        self._bounds = bounds
        self._new_ticket = new_ticket or _random_ticket
        self._drones: dict[DroneId, DroneVideo] = {}
        self._viewers: dict[int, VideoViewer] = {}
        self._tickets: dict[str, DroneVideo] = {}
        self._last_number = 0
        self._check_viewers_at = float("-inf")
        self._now = 0.0
        """The last time it was given, for calls without a time."""
        self.traffic = VideoTraffic()
        self.fan_out = FanOut(self.traffic)
        """The hub's owner sets how it reaches everybody."""
        self.on_watched: Callable[[DroneId, DroneVideo, float], None] = lambda drone_id, video, now: None
        """A viewer takes a stream of this drone, which may be at another tower."""
        self.on_rights: Callable[[DroneId | None], None] = lambda drone_id: None
        """Who may watch this drone, or any, may have changed."""

    # -- viewers -------------------------------------------------------------------------------------------------

    def next_number(self) -> int:
        """For a VideoViewer about to enter."""
        self._last_number += 1
        return self._last_number

    def capacity_refusal(self, user_id: UserId, address: str) -> str | None:
        """Why this user may not watch one more stream from there; None if they may."""
        return self._bounds.refusal(self._viewers.values(), user_id, address)

    def enter(self, viewer: VideoViewer, now: float) -> None:
        """A viewer who may watch connects: gets the state and the newest group of pictures at once."""
        self._viewers[viewer.number] = viewer
        self._watch(viewer, now)

    def leave(self, viewer: VideoViewer) -> None:
        """Removes a viewer. Idempotent."""
        if self._viewers.pop(viewer.number, None) is not None:
            self.release(viewer)

    def want(self, viewer: VideoViewer, key: StreamKey, now: float) -> None:
        """Another stream of the same drone."""
        if viewer.number in self._viewers and key != viewer.key:
            self.release(viewer)
            viewer.key = key
            self._watch(viewer, now)

    def got(self, viewer: Recipient, drawn: Drawn, now: float) -> None:
        """The viewer has drawn a unit: there may be room for more."""
        flow = self._flow_of(viewer)
        if flow is not None:
            flow.leave_lockstep(viewer)
        held_s = drawn.held_ms / 1000
        viewer.pace.got(drawn.sequence, now, calm=drawn.calm, overdue=drawn.overdue, held_s=held_s)
        viewer.pump(self.traffic, now)
        if flow is not None:
            flow.join_lockstep(viewer, now)

    def has_room(self, viewer: VideoViewer, now: float) -> None:
        """It reads again what it is sent."""
        if viewer.lockstep is None:
            viewer.pump(self.traffic, now)

    def is_full(self, viewer: VideoViewer) -> None:
        """It does not read what it is sent."""
        flow = self._flow_of(viewer)
        if flow is not None:
            flow.leave_lockstep(viewer)

    def _watch(self, viewer: VideoViewer, now: float) -> None:
        video = self._drones.get(viewer.drone_id)
        if video is not None and video.bars(viewer.viewer.user_id):
            self.end(viewer, *video_taken(video.name))
        elif (video := self.serve(viewer, now)) is not None:
            self.on_watched(viewer.drone_id, video, now)
        else:
            self.end(viewer, NO_SUCH_DRONE, "there is no such drone")

    def serve(self, viewer: Recipient, now: float) -> DroneVideo | None:
        """From the newest key picture on; for those who are judged elsewhere. None if there is no such drone."""
        video = self._of(viewer.drone_id, now)
        if video is None:
            return None
        flow = video.flow(viewer.key, now)
        flow.viewers[viewer.number] = flow.alone[viewer.number] = viewer
        situation = video.situation(viewer.key, now)
        if flow.reported is None:
            flow.reported = situation
        viewer.situation(situation)
        viewer.stream = flow.stream
        viewer.pace.watch(flow.stream, now)
        viewer.pump(self.traffic, now)
        video.send_situation(now)
        return video

    def release(self, viewer: Recipient) -> None:
        """Idempotent."""
        flow = self._flow_of(viewer)
        if flow is not None:
            flow.leave_lockstep(viewer)
            flow.viewers.pop(viewer.number, None)
            flow.alone.pop(viewer.number, None)

    def _flow_of(self, viewer: Recipient) -> Flow | None:
        video = self._drones.get(viewer.drone_id)
        flow = video.flows.get(viewer.key) if video is not None else None
        return flow if flow is not None and viewer.number in flow.viewers else None

    def end(self, viewer: VideoViewer, code: int, why: str) -> None:
        """Nothing more goes to this viewer from this instant; the connection's own end only tells why."""
        viewer.end(code, why)
        self.leave(viewer)

    # -- who may watch -------------------------------------------------------------------------------------------

    def recheck(self, drone_id: DroneId | None = None) -> None:
        """Owners, loans, leases or drones changed (of one drone, or any): removes viewers without a right."""
        for viewer in list(self._viewers.values()):
            if drone_id is None or viewer.drone_id == drone_id:
                refusal = why_not_watch(self._state.drones.get(viewer.drone_id), viewer.viewer)
                if refusal is not None:
                    self.end(viewer, refusal.code, refusal.words)
        for one in [drone_id] if drone_id is not None else list(self._drones):
            self._check_drone(one)
        self.on_rights(drone_id)

    def end_where(self, why_signed_out: Callable[[Principal], str]) -> None:
        """Removes the viewers with a reason to end: accounts changed."""
        for viewer in list(self._viewers.values()):
            why = why_signed_out(viewer.viewer)
            if why:
                self.end(viewer, SESSION_ENDED, why)

    def end_sessions(self, session_ids: Iterable[SignInId], why: str) -> None:
        """Sessions and tokens that have ended."""
        ended = set(session_ids)
        self.end_where(lambda principal: why if principal.session_id in ended else "")

    def end_user(self, user_id: UserId, why: str) -> None:
        """Everything that an account watches."""
        self.end_where(lambda principal: why if principal.user_id == user_id else "")

    def sockets_of(self, signed_in_by: SignInId) -> int:
        """How many streams a session or a token watches."""
        return sum(viewer.viewer.session_id == signed_in_by for viewer in self._viewers.values())

    def close_all(self) -> None:
        """The tower is going down."""
        for viewer in list(self._viewers.values()):
            self.end(viewer, GOING_DOWN, "the tower is shutting down")
        for video in list(self._drones.values()):
            video.end_channel("the tower is shutting down", GOING_DOWN)
            video.end_sinks("the tower is shutting down")

    # -- sinks that take everything ------------------------------------------------------------------------------

    def attach(self, drone_id: DroneId, sink: StreamSink, now: float) -> bool:
        """From the newest key picture on, every unit of its stream. False if there is no such drone."""
        video = self._of(drone_id, now)
        if video is None:
            return False
        video.attach(sink, now)
        return True

    def detach(self, drone_id: DroneId, sink: StreamSink) -> None:
        """Ends its stream. Idempotent."""
        video = self._drones.get(drone_id)
        flow = video.flows.get(StreamKey(sink.quality, sink.codec)) if video is not None else None
        if flow is not None:
            flow.sinks.pop(sink, None)

    # -- agents --------------------------------------------------------------------------------------------------

    def link_changed(self, drone_id: DroneId, now: float | None = None) -> None:
        """The agent of a drone has another link, or none."""
        now = self._now if now is None else now
        drone = self._state.drones.get(drone_id)
        video = self._of(drone_id, now) if drone is not None and drone.link is not None else self._drones.get(drone_id)
        if drone is None or video is None or video.link is drone.link:
            return
        self._tickets.pop(video.ticket, None)
        video.linked(drone.link, now)
        if video.ticket:
            self._tickets[video.ticket] = video
        video.send_situation(now)

    def resumed(self, link: AgentLink) -> None:
        """The link has another control channel: what was posted on the last may be lost."""
        video = self._drones.get(link.drone_id)
        if video is not None and video.link is link:
            video.send_wanted()

    def update_state(self, link: AgentLink, state: VideoState) -> None:
        """The agent reports the state of its camera."""
        video = self._drones.get(link.drone_id)
        if video is not None and video.link is link:
            video.state = state
            video.send_situation(self._now)

    def clock_answered(self, link: AgentLink, answer: ClockAnswer, now: float) -> None:
        """The agent reports its clock."""
        video = self._drones.get(link.drone_id)
        if video is not None and video.link is link:
            video.clock.answered(answer.number, answer.at_us, now)

    def drone_of_ticket(self, ticket: str) -> DroneVideo | None:
        """The link of a video channel's ticket; None: of no present link."""
        return self._tickets.get(ticket)

    def open_channel(self, video: DroneVideo, channel: AgentVideoChannel) -> None:
        """The agent's video process connected. Closes its earlier channel: the newest one counts."""
        video.end_channel("the agent's video process has reconnected", CHANNEL_REPLACED)
        video.channel = channel
        for flow in video.flows.values():
            flow.stream.broken()

    def channel_lost(self, video: DroneVideo, channel: AgentVideoChannel) -> None:
        """The channel is gone. Ignored for a replaced channel."""
        if video.channel is channel:
            video.channel = None
            for flow in video.flows.values():
                flow.stream.broken()

    def unit(
        self,
        video: DroneVideo,
        channel: AgentVideoChannel,
        message: bytes,
        now: float,
        traffic: VideoTraffic | None = None,
    ) -> UnitHead:
        """A unit came from an agent; `now`: when. `traffic`: where it counts, if it came from a tower. Raises
        MalformedUnit."""
        head = decode_head(message)
        self._now = now
        traffic = traffic or self.traffic
        traffic.units_in += 1
        traffic.bytes_in += len(message)
        key = StreamKey(head.quality, head.codec)
        flow = video.flows.get(key)
        if flow is None or video.channel is not channel:
            traffic.dropped["unwanted"] += 1
            return head
        if not flow.stream.follows(head):
            traffic.dropped["no-key"] += 1
            video.ask_key(key, now)
            return head
        captured_us = video.clock.tower_us(head.capture_us, now)
        if captured_us:
            traffic.age.observe(max(0.0, now - captured_us / 1e6))
        message = with_capture_time(message, captured_us)
        head = head._replace(capture_us=captured_us)
        unit = Relayed(message, whole_message(BINARY, message), head, now)
        flow.stream.put(unit)
        self._note(video, flow, head, now)
        self.fan_out.send(flow, unit, now)
        if video.elsewhere is None:  # else it is recorded there
            flow.record(unit, now)
        return head

    @staticmethod
    def _note(video: DroneVideo, flow: Flow, head: UnitHead, now: float) -> None:
        was_live = flow.is_live(now)
        flow.unit_at, flow.silent_after_s = now, max(2.0, 4.0 / head.rate_hz)
        flow.size, flow.rate_hz, flow.bits_per_s = (head.width, head.height), head.rate_hz, head.bits_per_s
        if not was_live:
            video.send_situation(now)

    # -- time ----------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Several times a second."""
        self._now = now
        for drone_id, video in list(self._drones.items()):
            self._check_drone(drone_id)
            video.tick(now)
            video.send_situation(now)
            if video.is_idle(now):
                self._forget(drone_id)
        if now < self._check_viewers_at:
            return
        self._check_viewers_at = now + CHECK_VIEWERS_EVERY_S
        for viewer in list(self._viewers.values()):
            viewer.tick(self.traffic, now)
            if viewer.ended:
                self.leave(viewer)

    def _check_drone(self, drone_id: DroneId) -> None:
        video, drone = self._drones.get(drone_id), self._state.drones.get(drone_id)
        if video is None:
            return
        if drone is None:
            video.end_sinks("the drone was removed")
            self._forget(drone_id)
            video.linked(None, self._now)
            return
        video.name = drone.record.name
        self.link_changed(drone_id)

    def _forget(self, drone_id: DroneId) -> None:
        video = self._drones.pop(drone_id)
        self._tickets.pop(video.ticket, None)

    def _of(self, drone_id: DroneId, now: float) -> DroneVideo | None:
        video, drone = self._drones.get(drone_id), self._state.drones.get(drone_id)
        if video is None and drone is not None:
            video = self._drones[drone_id] = DroneVideo(drone.record.name, self._new_ticket)
            self.link_changed(drone_id, now)
        return video

    # -- what others ask -----------------------------------------------------------------------------------------

    def video_of(self, drone: LiveDrone, now: float) -> DroneVideo:
        """For reads only: keeps no state for a drone without viewers."""
        video = self._drones.get(drone.drone_id)
        if video is None:
            video = DroneVideo(drone.record.name, self._new_ticket)
            video.link = drone.link
        return video

    def first_offered(self, drone_id: DroneId, keys: Sequence[StreamKey]) -> StreamKey:
        """The first one that the agent can produce; the last one if it can produce none or is not known yet. `keys`: at
        least one."""
        video = self._drones.get(drone_id)
        offered = () if video is None else video.codecs
        return next((key for key in keys if key.codec in offered), keys[-1])

    def told_elsewhere(self, video: DroneVideo, now: float) -> None:
        """The tower that has the drone has told how it is."""
        for flow in list(video.flows.values()):
            for viewer in list(flow.viewers.values()):
                if isinstance(viewer, VideoViewer) and video.bars(viewer.viewer.user_id):
                    self.end(viewer, *video_taken(video.name))
        video.send_situation(now)

    def watched(self) -> Iterator[tuple[DroneId, DroneVideo]]:
        """The drones whose video somebody is sent."""
        for drone_id, video in self._drones.items():
            if any(flow.viewers for flow in video.flows.values()):
                yield drone_id, video

    def count(self) -> tuple[int, int]:
        """(viewers, streams requested from agents)."""
        streams = sum(len(video.flows) for video in self._drones.values() if video.elsewhere is None)
        return len(self._viewers), streams


def _random_ticket() -> str:
    return secrets.token_urlsafe(32)
