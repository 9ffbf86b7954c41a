"""The typed messages of the control channel between agent and tower (docs/wire-protocol.md, 2).

Text messages are these structs as JSON, told apart by `type`. Unknown fields are ignored, so that either side may be
newer; an unknown type is a MalformedMessage. In the sign-in it closes the channel; later the receiver drops and counts
it, and the link goes on.
"""

from enum import StrEnum
from typing import Annotated, Final

import msgspec

from wire.black_box import BlackBoxToTower, BlackBoxWanted
from wire.open_holds import HoldToAgent, HoldToTower, LostAction
from wire.signing_key import Signing
from wire.stream_profiles import StreamChoice, StreamProfile
from wire.tower_list import Addresses, TowerList
from wire.transactions import TransactionToAgent, TransactionToTower
from wire.video import VideoToAgent, VideoToTower
from wire.zones.nearby import NearbyZones

PROTOCOL: Final = 1
"""The protocol of a hello with a bearer credential; a signed hello has that of `wire.sign_in`."""
AGENT_SUBPROTOCOL: Final = "tower-agent.v1"
KEY_SUBPROTOCOL: Final = "tower-agent.v2"
"""The tower speaks first, with a challenge, and the agent signs its hello."""
MAX_MESSAGE_BYTES: Final = 64 * 1024


U8 = Annotated[int, msgspec.Meta(ge=0, le=0xFF)]
U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
Port = Annotated[int, msgspec.Meta(ge=1, le=0xFFFF)]
Takes = Annotated[tuple[Annotated[str, msgspec.Meta(max_length=40)], ...], msgspec.Meta(max_length=40)]
"""Names of optional message groups that a side understands (wire.transactions.TRANSACTIONS)."""


class MalformedMessage(ValueError):
    """The received bytes are not a message of this channel."""


class HoldStep(StrEnum):
    """The steps of a hold, in the order in which they can occur; the last three end it."""

    ORDERED = "ordered"
    STICKS_CENTRED = "sticks_centred"
    MODE_REQUESTED = "mode_requested"
    MODE_ACKNOWLEDGED = "mode_acknowledged"
    CONFIRMED = "confirmed"
    NOT_NEEDED = "not_needed"
    UNCONFIRMED = "unconfirmed"

    @property
    def final(self) -> bool:
        """Returns whether this step ends the hold."""
        return self in (HoldStep.CONFIRMED, HoldStep.NOT_NEEDED, HoldStep.UNCONFIRMED)


class SignInChallenge(msgspec.Struct, frozen=True, tag="sign_in_challenge", tag_field="type", kw_only=True):
    """Tower to agent, the first message of `tower-agent.v2`. 32 bytes each, base64 in JSON.

    `public_key`: X25519. `tower_key`: Ed25519, the tower's identity. `bound`: the agent must bind its signature to the
    TLS channel (wire.channel_binding).
    """

    nonce: bytes
    public_key: bytes
    tower_key: bytes
    bound: bool = False


class SignIn(msgspec.Struct, frozen=True, kw_only=True):
    """A part of hello: the agent's identity. `wire.sign_in` has the signed text. Bytes are base64 in JSON."""

    purpose: Annotated[int, msgspec.Meta(ge=1, le=3)]
    drone_id: U32
    drone_key: bytes
    tower: Annotated[str, msgspec.Meta(max_length=255)]
    nonce: bytes
    binding: bytes = b""
    signature: bytes


class Hello(msgspec.Struct, frozen=True, tag="hello", tag_field="type", kw_only=True):
    """Agent to tower, first. `public_key`: X25519, 32 bytes, base64 in JSON.

    `resume`: the agent's existing link, which is to continue on this control channel (wire.resuming). A tower that
    cannot or will not resume answers with a welcome. `process`: a random number of the agent's process, by which the
    tower distinguishes a reconnect from a restart; 0: from an agent that sends none.
    """

    agent_version: str
    public_key: bytes
    protocol: int = PROTOCOL
    resume: U32 | None = None
    takes: Takes = ()
    process: U32 = 0
    sign_in: SignIn | None = None


class Welcome(msgspec.Struct, frozen=True, tag="welcome", tag_field="type", kw_only=True):
    """Tower to agent, the answer to hello. UDP goes to the host of the control channel, `udp_port`.

    `signature`: the tower's, over the transcript and the link's id (wire.sign_in). `credential_forgotten`: the bearer
    credential that this agent used is void; its key is valid. `ticket`: authorizes the agent's HTTP requests while this
    link exists. All three are absent after a hello of protocol 1. `tower_version`: for the agent's log; empty: from an
    older tower. `towers`: as in wire.tower_list.
    """

    drone_id: U32
    name: str
    link_id: U32
    public_key: bytes
    udp_port: Port
    epoch: U32
    holder: str | None
    holder_present: bool = False
    takes: Takes = ()
    signature: bytes = b""
    credential_forgotten: bool = False
    ticket: str = ""
    tower_version: Annotated[str, msgspec.Meta(max_length=40)] = ""
    towers: Addresses = ()


class ResumeChallenge(msgspec.Struct, frozen=True, tag="resume_challenge", tag_field="type", kw_only=True):
    """Tower to agent, the answer to a hello that names a resumable link. `nonce`: 32 bytes."""

    nonce: bytes


class ResumeProof(msgspec.Struct, frozen=True, tag="resume_proof", tag_field="type", kw_only=True):
    """Agent to tower, the answer to ResumeChallenge. `proof`: 32 bytes (wire.resuming)."""

    proof: bytes


class Resumed(msgspec.Struct, frozen=True, tag="resumed", tag_field="type", kw_only=True):
    """Tower to agent, instead of a welcome: the link continues unchanged, with this as its control channel."""

    link_id: U32
    proof: bytes


class ControlChanged(msgspec.Struct, frozen=True, tag="control_changed", tag_field="type", kw_only=True):
    """Tower to agent: who has the controls. `holder_present`: the holder has a live connection.

    `assistant_flies`: an admin assists the holder, and the admin's frames pass. `number` grows with each message of a
    link: the message travels on two channels, and the agent ignores one that is not newer than the last. 0: from a
    tower that does not number them.
    """

    number: U32 = 0

    epoch: U32
    holder: str | None
    holder_present: bool
    assistant_flies: bool = False


class HoldOrder(msgspec.Struct, frozen=True, tag="hold_order", tag_field="type", kw_only=True):
    """Tower to agent: hold now. From here on frames of an epoch below `epoch` are refused.

    `interrupts`: the hold also ends a return or a landing that the autopilot flies; without it these continue.
    """

    order_id: U32
    epoch: U32
    reason: str
    interrupts: bool = True


class HoldCause(StrEnum):
    """Who or what caused the hold."""

    ORDER = "order"
    """The tower: a change of control, or a trigger that the tower monitors."""
    PILOT_LOST = "pilot-lost"
    """The tower, or the holder's connection to it, is lost."""
    STICKS_STALE = "sticks-stale"
    """The holder's sticks stopped or were late during manual flight."""


class SafetySettings(msgspec.Struct, frozen=True, tag="safety_settings", tag_field="type", kw_only=True):
    """Tower to agent, after the welcome and on each change: how this drone holds.

    `hold_ladder`: mode names, tried in order; altitude hold is always the last rung, whether listed or not. Times in
    seconds.
    """

    hold_ladder: tuple[str, ...] = ()
    sticks_stale_s: float = 0.5
    sticks_late_s: float = 0.5
    """Stick frames later than this are discarded."""
    commands_late_s: float = 2.0
    """Commands later than this are never executed."""
    lost_hold_s: float = 2.0
    lost_action: LostAction = LostAction.RETURN
    lost_action_s: float = 30.0
    """Delay of `lost_action` after the loss of the tower, or of the person (a hold began, or the holder left)."""
    rtt_limit_ms: float = 500.0
    """The agent holds when sticks are older than half of this for `rtt_limit_s` during manual flight."""
    rtt_limit_s: float = 1.0


class StreamSettings(msgspec.Struct, frozen=True, tag="stream_settings", tag_field="type", kw_only=True):
    """Tower to agent, after the welcome and on each change: how much telemetry this drone is to send."""

    profile: StreamChoice = StreamChoice.AUTO


class StreamState(msgspec.Struct, frozen=True, tag="stream_state", tag_field="type", kw_only=True):
    """Agent to tower, on each change: the profile in force, the configured choice, and the reason."""

    profile: StreamProfile
    chosen: StreamChoice
    why: Annotated[str, msgspec.Meta(max_length=200)]


class LossParameters(msgspec.Struct, frozen=True, tag="loss_parameters", tag_field="type", kw_only=True):
    """Agent to tower, when read and on each change: the parameters that decide what the autopilot does on a loss.

    `values` holds those that the autopilot has, by their own names. `complete`: it includes those without which the
    behaviour is unknown. `has_radio`: whether RC input from a receiver is present (None: not known).
    """

    autopilot: str
    """`ardupilot`, `px4`, or empty for another."""
    values: dict[str, float]
    complete: bool
    has_radio: bool | None = None


class HoldProgress(msgspec.Struct, frozen=True, tag="hold_progress", tag_field="type", kw_only=True):
    """Agent to tower: a hold has completed one step. `elapsed_ms` since the order arrived.

    `number` counts the steps reported by this agent process; duplicates (two channels, several copies) share a number.
    Without it, a second hold that took equally long would pass for a copy of the first. It starts at a random value, so
    that the first steps of a restarted agent do not pass for earlier ones.
    """

    number: U32 = 0
    order_id: U32
    epoch: U32
    step: HoldStep
    detail: str
    elapsed_ms: float
    cause: HoldCause = HoldCause.ORDER


class AutopilotState(msgspec.Struct, frozen=True, tag="autopilot_state", tag_field="type", kw_only=True):
    """Agent to tower, on each change: whether the autopilot sends heartbeats, is armed, is airborne.

    `firmware`: flight_sw_version of its AUTOPILOT_VERSION (wire.firmware); 0: not known yet. `watched_only`: nobody has
    measured how such a vehicle holds, so the agent sends it no sticks and no mode by itself. `system_id`: the MAVLink
    system that the agent serves; 0: not known yet. `other_systems`: of other autopilots on its line, whose frames it
    passes in neither direction. `hears_agent`: whether the autopilot has answered the agent in the last 10 s; None: not
    known yet, or it answers nothing that the agent could ask. `signing`: whether autopilot and agent sign what they
    send each other; older agents do not. `stick_gestures`: how many gestures of sticks that arm or disarm the agent has
    kept from the autopilot since it started.
    """

    heard: bool
    armed: bool
    airborne: bool
    firmware: U32 = 0
    watched_only: bool = False
    system_id: U8 = 0
    other_systems: tuple[U8, ...] = ()
    hears_agent: bool | None = None
    signing: Signing = Signing.OFF
    stick_gestures: U32 = 0


ToTower = (
    Hello
    | ResumeProof
    | HoldProgress
    | AutopilotState
    | LossParameters
    | StreamState
    | HoldToTower
    | TransactionToTower
    | VideoToTower
    | BlackBoxToTower
)
ToAgent = (
    SignInChallenge
    | Welcome
    | ResumeChallenge
    | Resumed
    | ControlChanged
    | HoldOrder
    | SafetySettings
    | StreamSettings
    | HoldToAgent
    | TransactionToAgent
    | VideoToAgent
    | TowerList
    | BlackBoxWanted
    | NearbyZones
)

UNREADABLE: Final = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
"""All that msgspec raises for unacceptable JSON: invalid UTF-8 and too deep nesting raise errors of their own."""

_encoder: Final = msgspec.json.Encoder()
_to_tower: Final[msgspec.json.Decoder[ToTower]] = msgspec.json.Decoder(ToTower)
_to_agent: Final[msgspec.json.Decoder[ToAgent]] = msgspec.json.Decoder(ToAgent)


def encode_message(message: ToTower | ToAgent) -> str:
    """Returns the text message for the WebSocket."""
    return _encoder.encode(message).decode()


def decode_to_tower(text: str | bytes) -> ToTower:
    """Decodes a message of an agent. Raises MalformedMessage."""
    try:
        return _to_tower.decode(text)
    except UNREADABLE as error:
        raise MalformedMessage(str(error)) from None


def decode_to_agent(text: str | bytes) -> ToAgent:
    """Decodes a message of the tower. Raises MalformedMessage."""
    try:
        return _to_agent.decode(text)
    except UNREADABLE as error:
        raise MalformedMessage(str(error)) from None
