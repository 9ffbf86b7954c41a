"""What the refusals of accounts are in HTTP."""

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
from server.http.problem_kinds import INVALID, Kind, Problems

PROBLEMS: Final[Problems] = {
    WrongSignIn: Kind("wrong-sign-in", 401, "Wrong name or password"),
    SecondFactorNeeded: Kind("second-factor-needed", 401, "A code is needed"),
    WrongSecondFactor: Kind("wrong-code", 401, "Wrong code"),
    WrongCode: Kind("code-refused", 403, "The code is wrong"),
    WrongPassword: Kind("wrong-password", 403, "Wrong password"),
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
    TooManySignIns: Kind("busy", 503, "The tower is busy"),
    UnknownUser: Kind("unknown-user", 404, "No such user"),
    UnknownToken: Kind("unknown-token", 404, "No such token"),
    TooManyTokens: Kind("too-many-tokens", 409, "Too many tokens"),
    TooManyPreferences: Kind("too-many-preferences", 409, "Too many documents"),
    BadPreference: INVALID,
    PreferenceTooLarge: Kind("too-large", 413, "The body is too large"),
    BadScopes: INVALID.at("scopes"),
    BadExpiry: INVALID.at("expires_at"),
    UserNameTaken: Kind("name-taken", 409, "The name is taken"),
    LastAdmin: Kind("last-admin", 409, "The last admin must stay"),
    BadPassword: INVALID.at("password"),
}
