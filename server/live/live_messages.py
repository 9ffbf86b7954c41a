"""The text messages of `/api/v1/live` (docs/wire-protocol.md, 1.2 and 1.3) as typed structs."""

from typing import Annotated, Any, Final, Literal, Self

import msgspec

from server.airspace.core.aircraft.messages import AircraftHeard
from server.airspace.core.zones.messages import ZonesChanged
from server.alerts.core.views import AlertView
from server.fleet.core.views import DroneView
from server.kernel.people import UserRef
from server.operations.core.findings import FindingEvent
from server.operations.core.onboard_views import OnboardPlanView
from server.operations.core.operation import Operation
from server.operations.core.views import OperationView
from server.video.core.recordings.views import RecordingView
from wire.control_messages import UNREADABLE
from wire.link_quality import Quality


class User(msgspec.Struct, frozen=True):
    """Who this browser is signed in as."""

    id: int
    name: str
    role: str


class WelcomeBrowser(msgspec.Struct, frozen=True, tag="welcome", tag_field="type"):
    """First of all: the whole picture."""

    user: User
    drones: list[DroneView]
    server_time: str
    alerts: list[AlertView] = []
    """Those that are open or wait for a person."""
    other_towers: bool = False
    """Another tower can take this browser if this one is lost."""


class LeaveTower(msgspec.Struct, frozen=True, tag="leave_tower", tag_field="type"):
    """This tower ends its work: the browser connects again, beside this connection, and leaves this one once the other
    one has its welcome."""


class DroneChanged(msgspec.Struct, frozen=True, tag="drone", tag_field="type"):
    """A drone appeared, or anything in it changed."""

    drone: DroneView


class DroneRemoved(msgspec.Struct, frozen=True, tag="drone_removed", tag_field="type"):
    """A drone is no longer this browser's to see."""

    drone_id: int


class Control(msgspec.Struct, frozen=True, tag="control", tag_field="type"):
    """Who has the controls has changed."""

    drone_id: int
    event: str
    epoch: int
    holder: UserRef | None
    by: UserRef | None
    reason: str


class Hold(msgspec.Struct, frozen=True, tag="hold", tag_field="type"):
    """One step of a hold."""

    drone_id: int
    epoch: int
    step: str
    detail: str
    elapsed_ms: float
    cause: str


class Ping(msgspec.Struct, frozen=True, tag="ping", tag_field="type"):
    """To be answered with a Pong at once."""

    sequence: int


class Turn(msgspec.Struct, frozen=True, tag="turn", tag_field="type"):
    """While an admin assists: whose frames pass now."""

    drone_id: int
    user: UserRef


class Rehearsal(msgspec.Struct, frozen=True, tag="rehearsal", tag_field="type"):
    """How a loss made on purpose goes on: `hold_ms` from it to the confirmed hold, `lasts_s` how long it lasts."""

    drone_id: int
    what: str
    phase: str
    hold_ms: float | None
    text: str
    lasts_s: float


class LossCheckChanged(msgspec.Struct, frozen=True, tag="loss_check", tag_field="type"):
    """The loss check has changed or was acknowledged: request it again."""

    drone_id: int


class LinkOver(msgspec.Struct, frozen=True):
    """The link over a while. None is: not known. `loss_up`: of what the agent sent, 0..1; `loss_down`: the tower."""

    rtt_ms: float | None
    jitter_ms: float | None
    loss_up: float | None
    loss_down: float | None

    @classmethod
    def of(cls, quality: Quality) -> Self:
        """Seen from the tower, so what it received came up."""
        rtt_s, jitter_s, loss_sent, loss_received = quality
        return cls(_ms(rtt_s), _ms(jitter_s), _share(loss_received), _share(loss_sent))


class LinkQuality(msgspec.Struct, frozen=True):
    """How one agent's link is. `rtt_ms` is smoothed, None before the first measurement; `loss` the share of lost pings.

    `path_mtu`: bytes of the largest datagram known to pass to the agent. `uplinks`: by how many ways it comes at the
    moment.
    """

    drone_id: int
    rtt_ms: float | None
    loss: float
    over_1s: LinkOver
    over_30s: LinkOver
    path_mtu: int
    transport: Literal["udp", "websocket"]
    uplinks: int


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(seconds * 1000, 1)


def _share(share: float | None) -> float | None:
    return None if share is None else round(share, 3)


class Links(msgspec.Struct, frozen=True, tag="links", tag_field="type"):
    """How the links of several drones are. One message for all that are due together: a thousand drones on twenty
    screens would otherwise be twenty thousand messages a second. Each is a LinkQuality in JSON, made once for all."""

    links: list[msgspec.Raw]


class Notice(msgspec.Struct, frozen=True, tag="notice", tag_field="type"):
    """An answer to something that this browser did."""

    severity: Literal["info", "warning", "error"]
    code: str
    text: str
    drone_id: int | None
    count: int


class Lost(msgspec.Struct, frozen=True, tag="lost", tag_field="type"):
    """Transactional frames that this browser was too slow for."""

    drone_id: int
    count: int


class Separation(msgspec.Struct, frozen=True, tag="separation", tag_field="type"):
    """Two drones come near each other, or do so no more. `number` stays the same from the first word to `clear`.

    `drones`: the first one is this browser's to see; null where the second is not, and then every figure is rounded
    (separation/strangers.py), `horizontal_m` and `vertical_m` are null and `why` is empty. Predicted, null when
    clear or not known any more: the closest over ground `horizontal_m`, `vertical_m` apart at that moment, `in_s`
    seconds from now. Where the second is now, seen from the first: `bearing_deg` clockwise from north, `distance_m`
    over ground, `above_m`. `why` it is clear: `apart`, `landed` (or no longer there), `unheard`.
    """

    number: int
    level: Literal["caution", "warning", "clear"]
    drones: tuple[int, int | None]
    in_s: float | None
    horizontal_m: float | None
    vertical_m: float | None
    bearing_deg: float | None
    distance_m: float | None
    above_m: float | None
    why: str


class AlertChanged(msgspec.Struct, frozen=True, tag="alert", tag_field="type"):
    """An alert was opened, changed, acknowledged or closed: the whole of it, as it is now."""

    alert: AlertView


class EnrolmentChanged(msgspec.Struct, frozen=True, tag="enrolment", tag_field="type"):
    """How the enrolment of a drone goes, for admins: the Enrolment of docs/api.md."""

    enrolment: dict[str, Any]


class OperationChanged(msgspec.Struct, frozen=True, tag="operation", tag_field="type"):
    """A piece of work at a drone began, went on, or ended."""

    operation: OperationView

    @classmethod
    def of(cls, operation: Operation) -> Self:
        """As it is now."""
        return cls(OperationView.of(operation))


class PlanOnBoardChanged(msgspec.Struct, frozen=True, tag="plan_on_board", tag_field="type"):
    """Another plan of this kind is on board, or it is no longer known which."""

    drone_id: int
    kind: str
    state: str
    hash: str | None
    sent_hash: str | None
    count: int
    fit_to_fly: bool

    @classmethod
    def of(cls, drone_id: int, view: OnboardPlanView) -> Self:
        """As a `Drone` has it."""
        return cls(drone_id, view.kind.value, view.state, view.hash, view.sent_hash, view.count, view.fit_to_fly)


class ParametersChanged(msgspec.Struct, frozen=True, tag="parameters", tag_field="type"):
    """The parameters of a drone are being read (`hash` None), are all known, or one has another value."""

    drone_id: int
    hash: str | None
    count: int
    total: int


class Recording(msgspec.Struct, frozen=True, tag="recording", tag_field="type"):
    """A recording of a drone's video: `begun`, `ended` (its file is being made), `ready` or `failed`; `removed`:
    deleted, or to make room."""

    drone_id: int
    event: Literal["begun", "ended", "ready", "failed", "removed"]
    recording: RecordingView


class Watch(msgspec.Struct, frozen=True, tag="watch", tag_field="type"):
    """The requested rate of state messages."""

    rate_hz: Annotated[float, msgspec.Meta(ge=0.2, le=20.0)]


class Focus(msgspec.Struct, frozen=True, tag="focus", tag_field="type"):
    """The drone whose frames are wanted at once."""

    drone_id: Annotated[int, msgspec.Meta(ge=1, le=0xFFFFFFFF)] | None


Latitude = Annotated[float, msgspec.Meta(ge=-90.0, le=90.0)]
Longitude = Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]


class Bounds(msgspec.Struct, frozen=True):
    """A part of the map in degrees; `west` above `east` where it crosses the antimeridian."""

    south: Latitude
    west: Longitude
    north: Latitude
    east: Longitude

    def __post_init__(self) -> None:
        if self.south > self.north:
            raise ValueError("south of a map must not be above its north")


class MapShown(msgspec.Struct, frozen=True, tag="viewport", tag_field="type"):
    """Which part of the map this browser shows; None: all of it."""

    bounds: Bounds | None


class Pong(msgspec.Struct, frozen=True, tag="pong", tag_field="type"):
    """The answer to a Ping."""

    sequence: Annotated[int, msgspec.Meta(ge=0, le=1 << 53)]


class PersonFix(msgspec.Struct, frozen=True, tag="person_fix", tag_field="type"):
    """Where the person at this browser is, whom the drone follows. `age_ms`: since it was measured, when it was sent.
    `sent_ms`: the browser's clock, as in the stamps of its frames."""

    drone_id: Annotated[int, msgspec.Meta(ge=1, le=0xFFFFFFFF)]
    lat: Latitude
    lon: Longitude
    accuracy_m: Annotated[float, msgspec.Meta(ge=0.0)]
    age_ms: Annotated[float, msgspec.Meta(ge=0.0, le=3_600_000.0)]
    sent_ms: Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
    speed_m_s: float | None = None
    heading_deg: float | None = None


class Relayed(msgspec.Struct, frozen=True):
    """A message of another tower, as it is to go."""

    text: str


ToBrowser = (
    WelcomeBrowser
    | DroneChanged
    | DroneRemoved
    | Control
    | Hold
    | Ping
    | Turn
    | Rehearsal
    | LossCheckChanged
    | Links
    | Notice
    | ZonesChanged
    | AircraftHeard
    | Lost
    | Separation
    | AlertChanged
    | EnrolmentChanged
    | OperationChanged
    | PlanOnBoardChanged
    | ParametersChanged
    | FindingEvent
    | Recording
    | Relayed
    | LeaveTower
)
FromBrowser = Watch | Focus | MapShown | Pong | PersonFix


class MalformedRequest(ValueError):
    """A text message that no browser of ours would send."""


def _view(value: Any) -> Any:
    """Views are pydantic's, because REST answers them too."""
    return value.model_dump() if hasattr(value, "model_dump") else value


_encoder: Final = msgspec.json.Encoder(enc_hook=_view)
_decoder: Final[msgspec.json.Decoder[FromBrowser]] = msgspec.json.Decoder(FromBrowser)


_SHARED: Final = (
    DroneChanged,
    Control,
    Hold,
    OperationChanged,
    PlanOnBoardChanged,
    ParametersChanged,
    Recording,
    Separation,
    AlertChanged,
)
"""Events for all who watch a drone, one object for all of them."""
_MAX_SHARED: Final = 256
_encoded: Final[dict[int, tuple[ToBrowser, str]]] = {}
"""The last encoded event, by identity. When a thousand agents reconnect, twenty browsers are notified of each."""


def encode_event(event: ToBrowser) -> str:
    """The text message for the WebSocket."""
    if isinstance(event, Relayed):
        return event.text
    if not isinstance(event, _SHARED):
        return _encoder.encode(event).decode()
    known = _encoded.get(id(event))
    if known is not None and known[0] is event:
        return known[1]
    text = _encoder.encode(event).decode()
    if len(_encoded) >= _MAX_SHARED:
        _encoded.clear()
    _encoded[id(event)] = (event, text)
    return text


def encode_quality(quality: LinkQuality) -> msgspec.Raw:
    """As a part of Links."""
    return msgspec.Raw(_encoder.encode(quality))


def decode_request(text: str) -> FromBrowser:
    """Decodes a browser's request. Raises MalformedRequest, whose text says what is wrong."""
    try:
        return _decoder.decode(text)
    except UNREADABLE as error:
        raise MalformedRequest(str(error)) from None
