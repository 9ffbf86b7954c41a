/** What accounts and administration say over REST, as docs/api.md defines it. Times are ISO 8601 texts. */

export interface NamedRef {
  readonly id: number;
  readonly name: string;
}

export type Role = 'admin' | 'operator';

export interface Account {
  readonly id: number;
  readonly name: string;
  readonly role: Role;
  readonly disabled: boolean;
  readonly created_at: string;
  readonly must_change_password: boolean;
  readonly second_factor: boolean;
  readonly passkeys: number;
}

export interface SecondFactor {
  /** Codes of an authenticator. */
  readonly enabled: boolean;
  /** How many there are: each is a second factor too. */
  readonly passkeys: number;
  readonly recovery_codes_left: number;
}

/** How fresh this session's proof of who sits there is, and how it is renewed. */
export interface Proof {
  readonly fresh: boolean;
  readonly fresh_until: string | null;
  /** `passkey`, `password`: how this person can prove it, the best first. */
  readonly kinds: readonly string[];
  readonly code_needed: boolean;
}

/** What the tower thinks of a new password. */
export interface PasswordJudgement {
  readonly acceptable: boolean;
  readonly message: string;
}

/** To be put into an authenticator: the tower tells it once. */
export interface SecondFactorBegun {
  readonly secret: string;
  readonly uri: string;
  readonly qr_svg: string;
}

export interface Passkey {
  readonly id: number;
  readonly name: string;
  /** The host name of the tower at which it is good. */
  readonly made_for: string;
  /** It is kept in more than one device. */
  readonly synced: boolean;
  readonly created_at: string;
  readonly last_used_at: string | null;
}

export interface PasskeyAdded {
  readonly passkey: Passkey;
  /** Empty where the account has some already. */
  readonly recovery_codes: readonly string[];
}

/** A browser that is signed in. */
export interface Session {
  readonly id: number;
  readonly user: NamedRef;
  readonly created_at: string;
  readonly last_seen_at: string;
  readonly expires_at: string;
  readonly address: string;
  readonly user_agent: string;
  readonly current: boolean;
  /** Its open live connections. */
  readonly live: number;
}

export const SCOPES = ['watch', 'fly', 'admin', 'metrics'] as const;
export type Scope = (typeof SCOPES)[number];

export interface ApiToken {
  readonly id: number;
  readonly name: string;
  readonly owner: NamedRef;
  readonly scopes: readonly Scope[];
  readonly created_at: string;
  readonly expires_at: string;
  readonly last_used_at: string | null;
  /** Empty: never used. */
  readonly last_used_address: string;
}

/** A drone lent to somebody who does not own it. */
export interface Loan {
  readonly user: NamedRef;
  readonly until: string;
  readonly may_arm: boolean;
  /** Metres above home; null: no limit. */
  readonly max_height_m: number | null;
  /** Metres from home; null: no limit. */
  readonly radius_m: number | null;
}

export type LoanTerms = Omit<Loan, 'user'>;

export type EnrolmentState = 'waiting' | 'used' | 'seen' | 'expired' | 'cancelled';

export interface Enrolment {
  readonly id: number;
  readonly drone: NamedRef;
  readonly created_by: string;
  readonly created_at: string;
  readonly expires_at: string;
  readonly state: EnrolmentState;
  readonly used_at: string | null;
  readonly used_from: string | null;
  readonly agent_seen_at: string | null;
}

export interface EnrolmentBegun {
  readonly enrolment: Enrolment;
  readonly token: string;
  /** One line to paste on the drone. */
  readonly command: string;
}

export interface AuditEvent {
  readonly id: number;
  readonly at: string;
  readonly actor_id: number | null;
  readonly actor_name: string;
  readonly action: string;
  readonly drone_id: number | null;
  readonly detail: Readonly<Record<string, unknown>>;
  readonly address: string;
}

/** Empty texts filter nothing. */
export interface AuditFilters {
  readonly action: string;
  readonly actor: string;
  readonly drone_id: string;
  readonly since: string;
  readonly until: string;
}

export interface SystemHealth {
  readonly version: string;
  readonly python: string;
  readonly started_at: string;
  readonly uptime_s: number;
  readonly loop_lag_ms: { readonly now: number | null; readonly worst_60s: number | null };
  readonly database: {
    readonly kind: string;
    readonly revision: string | null;
    readonly answered_in_ms: number | null;
    readonly size_bytes: number | null;
  };
  readonly disk: { readonly free_bytes: number; readonly total_bytes: number };
  readonly agents: { readonly known: number; readonly online: number };
  readonly clients: { readonly live: number; readonly users: number };
  readonly memory_bytes: number | null;
}
