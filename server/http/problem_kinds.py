"""The table of refusals: what each is in HTTP. To add an error, add a line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from server.accounts.core.challenges import ChallengeOver, TooManyChallenges
from server.accounts.core.relying_party import PasskeysUnavailable
from server.accounts.store.passkey_sign_in import PasskeyRefused, PasswordNeeded, WrongPasskey
from server.accounts.store.passkeys import PasskeyKnown, TooManyPasskeys, UnknownPasskey
from server.accounts.store.password_policy import BadPassword, TooManyJudgements
from server.accounts.store.passwords import TooManySignIns
from server.accounts.store.preferences import BadPreference, PreferenceTooLarge, TooManyPreferences
from server.accounts.store.reauthentication import CodeNeeded
from server.accounts.store.second_factor import LastFactor, NoSecondFactorBegun, SecondFactorOn, WrongCode
from server.accounts.store.sessions import UnknownSession
from server.accounts.store.sign_in import SecondFactorNeeded, WrongPassword, WrongSecondFactor
from server.accounts.store.tokens import BadExpiry, BadScopes, TooManyTokens, UnknownToken
from server.accounts.store.users import LastAdmin, SignInThrottled, UnknownUser, UserNameTaken, WrongSignIn
from server.airspace.core.zones.imports import UnreadableFile
from server.airspace.core.zones.zone import BadZone
from server.airspace.store.zones import TooManyZones, UnknownZone, ZoneChangedMeanwhile
from server.alerts.core.refusals import MayNotAcknowledge, UnknownAlert
from server.alerts.store.channels.refusals import (
    BadAlertChannel,
    TooManyAlertChannels,
    TooManyBrowsers,
    TooManyMessages,
    UnknownAlertChannel,
)
from server.control.store.service import ControlRefused
from server.fleet.core.update_refusals import FlownByAnother, UnknownRelease
from server.fleet.io.tower_address import AddressUnknown
from server.fleet.store.drones import DroneNameTaken
from server.fleet.store.enrolments import BadDroneKey, BadEnrolment, UnknownEnrolment
from server.fleet.store.loans import BadLoan, OwnerAlready
from server.flights.core.imports.refusals import BadFlightFile, ImportsFull, UnknownImport
from server.flights.core.refusals import BadPage, FlightElsewhere, FlightRunning, NotIdentified, UnknownFlight
from server.flights.core.videos.refusals import FlightVideoNotMade, FlightVideosBusy
from server.http.private_path import NotPrivate
from server.kernel.access import (
    AdminsOnly,
    BadToken,
    InPersonOnly,
    NotSignedIn,
    PasswordChangeNeeded,
    ProofNeeded,
    ReadOnlyAccount,
    ScopeMissing,
    SecondFactorDemanded,
    SessionExpired,
    UnknownDrone,
)
from server.kernel.drone_settings import BadDroneSettings
from server.kernel.names import BadName
from server.kernel.refusal import Refusal
from server.kernel.shares import BadShareLimit
from server.kernel.tower_refusals import LastTower, TowerDraining, UnknownTower
from server.link.core.restraint import LosesItsLink
from server.logs.core import BadCredential, FileIncomplete, FileNotTaken, NotAskedFor, UnknownLog
from server.maps.core import (
    BadMapFile,
    BadMapLayer,
    MapTileUnavailable,
    TooManyMapLayers,
    UnknownMapArea,
    UnknownMapLayer,
)
from server.maps.io.tile_source import NoTileFile
from server.operations.core.flying.following import CannotFollow, NoSuchLeader
from server.operations.core.flying.on_the_ground import NoSuchMotor, NotOnTheGround, PropellersNotConfirmed
from server.operations.core.flying.vehicle import (
    NoSuchItem,
    NoSuchMode,
    NotKnownHow,
    NotKnownYet,
    StateNotRestored,
)
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    LossCheckOpen,
    MovesHome,
    NotInControl,
    NotThroughTheTower,
    OnlyWatches,
    OutsideOwnFence,
    TooManyOperations,
    TurnTimeout,
    UnknownOperation,
    ViewTaken,
    WouldFall,
    ZoneForbids,
)
from server.parameters.core.metadata import NoMetadata
from server.parameters.core.orders import ParametersUnknown
from server.plans.core.document import DocumentTooLarge
from server.plans.core.ground_check import IntoTheGround
from server.plans.core.plan_body import BadPlan, MalformedBody
from server.plans.core.plans import PlanNotRead
from server.plans.store.library import (
    ChangedMeanwhile,
    NotYourMission,
    TooManyMissions,
    UnknownMission,
    VersionNeeded,
)
from server.readiness.core.maintenance_refusals import NotYoursToMaintain, TooManyTasks, UnknownTask
from server.readiness.core.refusals import NoSuchKind, NotYourChecklist, PreflightIncomplete, SignsForPilot
from server.runtime.side_thread import TooMuchWork
from server.teams.core import (
    DroneInUse,
    InAnotherTeam,
    LastTeamAdmin,
    MemberAlready,
    NotYourDrone,
    TeamAdminsOnly,
    TeamFull,
    TooManyTeams,
    UnknownInvitation,
    UnknownTeam,
)
from server.video.core.recordings.refusals import (
    AlreadyRecording,
    NotReady,
    NotYourRecording,
    NotYoursToRecord,
    NoVideo,
    RecordingBusy,
    RecordingStorageFull,
    TooManyRecordings,
    UnknownRecording,
)


@dataclass(frozen=True)
class Kind:
    """`field`: the member of the request's body that was at fault, if any."""

    slug: str
    status: int
    title: str
    field: str | None = None


INVALID: Final = Kind("invalid-request", 422, "The request is not valid")
MALFORMED_JSON: Final = Kind("malformed-json", 400, "The body is not JSON")
JSON_ONLY: Final = Kind("json-only", 415, "Only JSON is accepted")
TOO_LARGE: Final = Kind("too-large", 413, "The body is too large")
BODY_TIMEOUT: Final = Kind("request-timeout", 408, "The body did not arrive in time")
WRONG_ORIGIN: Final = Kind("wrong-origin", 403, "The request came from another site")
DATABASE: Final = Kind("database-unavailable", 503, "The database does not answer")
NOT_THE_TOWER: Final = Kind("not-the-tower", 503, "This process is not the tower")
TOWER_OUT_OF_REACH: Final = Kind("tower-out-of-reach", 503, "The drone's tower does not answer")
INTERNAL: Final = Kind("internal-error", 500, "Something went wrong in the tower")

PROBLEMS: Final[dict[type[Refusal], Kind]] = {
    NotSignedIn: Kind("not-signed-in", 401, "Not signed in"),
    SessionExpired: Kind("session-expired", 401, "The session has ended"),
    BadToken: Kind("bad-token", 401, "The token is not valid"),
    ScopeMissing: Kind("scope-missing", 403, "The token lacks the scope"),
    PasswordChangeNeeded: Kind("password-change-needed", 403, "The first password must be changed"),
    SecondFactorDemanded: Kind("second-factor-demanded", 403, "A second factor must be set up"),
    InPersonOnly: Kind("in-person-only", 403, "Not with a token"),
    WrongSignIn: Kind("wrong-sign-in", 401, "Wrong name or password"),
    SecondFactorNeeded: Kind("second-factor-needed", 401, "A code is needed"),
    WrongSecondFactor: Kind("wrong-code", 401, "Wrong code"),
    WrongCode: Kind("code-refused", 403, "The code is wrong"),
    WrongPassword: Kind("wrong-password", 403, "Wrong password"),
    ProofNeeded: Kind("proof-needed", 403, "Confirm that it is you"),
    CodeNeeded: Kind("code-needed", 403, "A code is needed"),
    SecondFactorOn: Kind("second-factor-on", 409, "A second factor exists already"),
    NoSecondFactorBegun: Kind("no-second-factor-begun", 409, "There is no second factor"),
    PasskeyRefused: Kind("passkey-refused", 401, "The passkey is not accepted"),
    WrongPasskey: Kind("wrong-passkey", 403, "The passkey is not accepted"),
    PasswordNeeded: Kind("password-needed", 401, "The new password is needed"),
    ChallengeOver: Kind("challenge-over", 409, "Too late"),
    TooManyChallenges: Kind("too-many-tries", 429, "Too many tries"),
    PasskeysUnavailable: Kind("passkeys-unavailable", 409, "No passkeys at this address"),
    UnknownPasskey: Kind("unknown-passkey", 404, "No such passkey"),
    TooManyPasskeys: Kind("too-many-passkeys", 409, "Too many passkeys"),
    PasskeyKnown: Kind("passkey-known", 409, "The passkey exists already"),
    LastFactor: Kind("last-factor", 409, "The last second factor must stay"),
    UnknownSession: Kind("unknown-session", 404, "No such session"),
    SignInThrottled: Kind("too-many-tries", 429, "Too many tries"),
    TooManyJudgements: Kind("busy", 503, "The tower is busy"),
    TooMuchWork: Kind("too-much-work", 429, "Too much at once"),
    TooManySignIns: Kind("busy", 503, "The tower is busy"),
    ReadOnlyAccount: Kind("read-only-account", 403, "Your account only watches"),
    AdminsOnly: Kind("admins-only", 403, "For admins only"),
    UnknownTower: Kind("unknown-tower", 404, "No such tower"),
    LastTower: Kind("last-tower", 409, "No other tower"),
    TowerDraining: Kind("tower-draining", 503, "The tower ends its work"),
    UnknownDrone: Kind("unknown-drone", 404, "No such drone"),
    NoTileFile: Kind("no-tiles", 404, "No map tiles here"),
    UnknownUser: Kind("unknown-user", 404, "No such user"),
    UnknownToken: Kind("unknown-token", 404, "No such token"),
    TooManyTokens: Kind("too-many-tokens", 409, "Too many tokens"),
    TooManyPreferences: Kind("too-many-preferences", 409, "Too many documents"),
    BadPreference: Kind(INVALID.slug, INVALID.status, INVALID.title),
    PreferenceTooLarge: Kind("too-large", 413, "The body is too large"),
    BadScopes: Kind(INVALID.slug, INVALID.status, INVALID.title, field="scopes"),
    BadExpiry: Kind(INVALID.slug, INVALID.status, INVALID.title, field="expires_at"),
    UnknownEnrolment: Kind("unknown-enrolment", 404, "No such enrolment"),
    AddressUnknown: Kind("address-unknown", 409, "The tower's own address is not known"),
    BadDroneKey: Kind("bad-drone-key", 403, "The key is not valid"),
    BadEnrolment: Kind("bad-enrolment", 403, "The enrolment token is not valid"),
    NotPrivate: Kind("https-only", 403, "Not over plain http"),
    OwnerAlready: Kind("owner-already", 409, "The user owns the drone"),
    LosesItsLink: Kind("loses-its-link", 409, "The drone would lose its link"),
    BadShareLimit: Kind(INVALID.slug, INVALID.status, INVALID.title, field="limit"),
    BadLoan: Kind(INVALID.slug, INVALID.status, INVALID.title, field="until"),
    UserNameTaken: Kind("name-taken", 409, "The name is taken"),
    DroneNameTaken: Kind("name-taken", 409, "The name is taken"),
    ControlRefused: Kind("control-refused", 409, "The controls did not change"),
    BadDroneSettings: Kind(INVALID.slug, INVALID.status, INVALID.title, field="lost_action_s"),
    DroneOffline: Kind("drone-offline", 409, "The drone is offline"),
    AgentTooOld: Kind("agent-too-old", 409, "The drone's agent is too old"),
    TooManyOperations: Kind("too-many-operations", 429, "Too many requests"),
    DroneBusy: Kind("drone-busy", 409, "The drone is busy"),
    UnknownOperation: Kind("unknown-operation", 404, "No such operation"),
    NotInControl: Kind("not-in-control", 409, "You do not have the controls"),
    Assisted: Kind("assisted", 409, "An admin is assisting"),
    TurnTimeout: Kind("not-in-control", 409, "You do not have the controls"),
    LossCheckOpen: Kind("loss-check", 409, "The loss check is open"),
    NotThroughTheTower: Kind("not-allowed", 409, "Not through the tower"),
    WouldFall: Kind("would-fall", 409, "The drone would fall"),
    PreflightIncomplete: Kind("preflight-incomplete", 409, "Own lines are not confirmed"),
    SignsForPilot: Kind("signs-for-pilot", 403, "The pilot signs"),
    NotYourChecklist: Kind("not-your-checklist", 403, "Not your checklist"),
    NoSuchKind: Kind("no-such-kind", 404, "No such kind of drone"),
    NotOnTheGround: Kind("not-on-the-ground", 409, "The drone is not on the ground"),
    PropellersNotConfirmed: Kind("propellers-not-confirmed", 409, "The propellers are not confirmed to be off"),
    NoSuchMotor: Kind("no-such-motor", 409, "No such motor"),
    MovesHome: Kind("moves-home", 409, "Home would move"),
    StateNotRestored: Kind("state-not-restored", 409, "What earlier items set is not set again"),
    ZoneForbids: Kind("zone", 409, "A zone is on the way"),
    OutsideOwnFence: Kind("outside-fence", 409, "Outside the autopilot's fence"),
    UnknownZone: Kind("unknown-zone", 404, "No such zone"),
    TooManyZones: Kind("too-many-zones", 409, "Too many zones"),
    ZoneChangedMeanwhile: Kind("changed-meanwhile", 412, "Changed meanwhile"),
    BadZone: Kind(INVALID.slug, INVALID.status, INVALID.title, field="points"),
    UnreadableFile: Kind(INVALID.slug, INVALID.status, INVALID.title, field="text"),
    IntoTheGround: Kind("into-the-ground", 409, "The mission leads into the ground"),
    LoanForbids: Kind("loan", 409, "Beyond the limits of the loan"),
    ViewTaken: Kind("view-taken", 403, "The view was taken"),
    OnlyWatches: Kind("only-watches", 403, "You may only watch"),
    UnknownAlertChannel: Kind("unknown-alert-channel", 404, "No such alert channel"),
    TooManyAlertChannels: Kind("too-many-alert-channels", 409, "Too many alert channels"),
    TooManyBrowsers: Kind("too-many-browsers", 409, "Too many browsers with alerts"),
    BadAlertChannel: Kind("bad-alert-channel", 409, "The alert channel is not accepted"),
    TooManyMessages: Kind("too-many-tries", 429, "Too many tries"),
    UnknownAlert: Kind("unknown-alert", 404, "No such alert"),
    MayNotAcknowledge: Kind("only-watches", 403, "You may only watch"),
    MalformedBody: Kind(MALFORMED_JSON.slug, MALFORMED_JSON.status, MALFORMED_JSON.title),
    BadPlan: Kind(INVALID.slug, INVALID.status, INVALID.title),
    ParametersUnknown: Kind("parameters-unknown", 409, "The parameters are not known yet"),
    NoMetadata: Kind("no-metadata", 404, "The vehicle offers no parameter metadata"),
    NotKnownHow: Kind("not-supported", 409, "Not supported by this vehicle"),
    NotKnownYet: Kind("not-known-yet", 409, "Not known yet"),
    NoSuchMode: Kind(INVALID.slug, INVALID.status, INVALID.title, field="mode"),
    NoSuchItem: Kind(INVALID.slug, INVALID.status, INVALID.title, field="item"),
    NoSuchLeader: Kind(INVALID.slug, INVALID.status, INVALID.title, field="leader"),
    CannotFollow: Kind("cannot-follow", 409, "It cannot follow"),
    UnknownMapLayer: Kind("unknown-map-layer", 404, "No such map layer"),
    UnknownMapArea: Kind("unknown-map-area", 404, "No such area"),
    TooManyMapLayers: Kind("too-many-map-layers", 409, "Too many map layers"),
    BadMapLayer: Kind(INVALID.slug, INVALID.status, INVALID.title),
    BadMapFile: Kind(INVALID.slug, INVALID.status, INVALID.title),
    MapTileUnavailable: Kind("map-tile-unavailable", 503, "The tile is not to be had now"),
    UnknownMission: Kind("unknown-mission", 404, "No such mission"),
    NotYourMission: Kind("not-your-mission", 403, "Not your mission"),
    TooManyMissions: Kind("too-many-missions", 409, "Too many missions"),
    ChangedMeanwhile: Kind("changed-meanwhile", 412, "Changed meanwhile"),
    VersionNeeded: Kind("version-needed", 428, "Say which version"),
    DocumentTooLarge: Kind(TOO_LARGE.slug, TOO_LARGE.status, TOO_LARGE.title),
    UnknownRelease: Kind("unknown-release", 404, "No such release of the agent"),
    FlownByAnother: Kind("flown-by-another", 409, "Somebody has the controls"),
    UnknownLog: Kind("unknown-log", 404, "No such log here"),
    BadCredential: Kind("bad-credential", 401, "The ticket or credential is not valid"),
    NotAskedFor: Kind("not-asked-for", 404, "Nobody is waiting for it"),
    FileNotTaken: Kind("no-room", 413, "The file is refused"),
    FileIncomplete: Kind("incomplete", 400, "The file is incomplete"),
    UnknownFlight: Kind("unknown-flight", 404, "No such flight"),
    UnknownImport: Kind("unknown-import", 404, "No such imported flight"),
    BadFlightFile: Kind("bad-flight-file", 422, "The file cannot be imported"),
    ImportsFull: Kind("imports-full", 409, "No room for another flight"),
    FlightElsewhere: Kind("flight-elsewhere", 409, "Its files are elsewhere"),
    FlightRunning: Kind("flight-running", 409, "It is not over yet"),
    FlightVideosBusy: Kind("flight-videos-busy", 409, "Another video is being made"),
    FlightVideoNotMade: Kind("flight-video-not-made", 404, "No such video"),
    NotIdentified: Kind("not-identified", 422, "The flight cannot be identified"),
    UnknownTask: Kind("unknown-task", 404, "No such maintenance"),
    NotYoursToMaintain: Kind("not-yours-to-maintain", 403, "Not your drone to maintain"),
    TooManyTasks: Kind("too-many-tasks", 409, "Too much maintenance"),
    BadPage: Kind("bad-page", 422, "No such page"),
    UnknownRecording: Kind("unknown-recording", 404, "No such recording"),
    NotReady: Kind("recording-not-ready", 409, "There is no file yet"),
    NotYoursToRecord: Kind("not-in-control", 409, "You do not have the controls"),
    NotYourRecording: Kind("not-your-recording", 403, "Not your recording"),
    AlreadyRecording: Kind("already-recording", 409, "It is being recorded already"),
    TooManyRecordings: Kind("too-many-recordings", 409, "Too many recordings"),
    RecordingBusy: Kind("recording-busy", 409, "It is not over yet"),
    NoVideo: Kind("no-video", 409, "There is no video"),
    RecordingStorageFull: Kind("no-room", 413, "No space left"),
    PlanNotRead: Kind("plan-not-read", 409, "The plan could not be read"),
    UnknownTeam: Kind("unknown-team", 404, "No such team"),
    UnknownInvitation: Kind("unknown-invitation", 404, "No such invitation"),
    TeamAdminsOnly: Kind("team-admins-only", 403, "For admins of the team"),
    NotYourDrone: Kind("not-your-drone", 403, "Not your drone"),
    InAnotherTeam: Kind("in-another-team", 409, "The drone is in another team"),
    DroneInUse: Kind("drone-in-use", 409, "Somebody flies the drone"),
    LastTeamAdmin: Kind("last-team-admin", 409, "The last team admin must stay"),
    MemberAlready: Kind("member-already", 409, "In the team already"),
    TooManyTeams: Kind("too-many-teams", 409, "Too many teams"),
    TeamFull: Kind("team-full", 409, "The team is full"),
    LastAdmin: Kind("last-admin", 409, "The last admin must stay"),
    BadName: Kind(INVALID.slug, INVALID.status, INVALID.title, field="name"),
    BadPassword: Kind(INVALID.slug, INVALID.status, INVALID.title, field="password"),
}
