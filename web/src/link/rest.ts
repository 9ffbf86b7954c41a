/** The tower's REST interface under /api/v1. Every failure is a `RestError` with words for people. */

import { readDrone, type DroneOnWire } from './drone_view';
import type { PasskeyCredential, PasskeyOptions } from './passkeys';
import type { LossCheck, ReceiverSetup, RehearsalTerms, SafetySettings } from './safety_types';
import type { Drone, Online, RehearsedLoss, User } from './wire_types';

export interface FieldError {
  readonly field: string;
  readonly message: string;
}

/** An RFC 9457 problem document, or what we can say when the tower gave none. */
export class RestError extends Error {
  constructor(
    /** HTTP status; 0 when the tower could not be reached. */
    readonly status: number,
    readonly title: string,
    readonly detail: string,
    readonly type: string,
    /** What is wrong with which field of the request. */
    readonly errors: readonly FieldError[] = [],
    /** How long to wait before another try; null where the tower did not say. */
    readonly retryAfterS: number | null = null,
    /** Of a plan: the item that is refused, from 0. */
    readonly item: number | null = null,
    /** Which kinds of second factor will do, the best first: `passkey`, `code`. */
    readonly kinds: readonly string[] = [],
  ) {
    super(detail || title);
    this.name = 'RestError';
  }

  /** The last part of the problem's type: what docs/api.md calls it. */
  get slug(): string {
    return this.type.slice(Math.max(this.type.lastIndexOf('/'), this.type.lastIndexOf(':')) + 1);
  }
}

export type ControlAction = 'acquire' | 'release' | 'take' | 'give' | 'accept' | 'assist' | 'unassist' | 'stay';

export interface ControlWords {
  readonly reason?: string;
  /** With `take`: whether the pilot may still see the drone. */
  readonly watch?: boolean;
  /** With `take`: whether the pilot may still watch its video; `move`: not until it is offered back. */
  readonly video?: 'keep' | 'move';
  /** With `take`: also a return or a landing that the autopilot flies is ended. */
  readonly interrupt?: boolean;
  /** With `accept`: "I have control". */
  readonly sticks_centred?: boolean;
}

/** Nothing, or one of the two. */
export interface SecondFactorAnswer {
  readonly code?: string;
  readonly passkey?: PasskeyCredential;
}

type Fetch = (path: string, init: RequestInit) => Promise<Response>;

const BASE = '/api/v1';

export class Rest {
  /** Asks the person who sits there to prove who they are. True: they did, and the request is sent once more. */
  onProofNeeded: (() => Promise<boolean>) | null = null;
  readonly #fetch: Fetch;

  constructor(fetcher: Fetch = (path, init) => fetch(path, init)) {
    this.#fetch = fetcher;
  }

  /** With the second factor where the account asks for one: a code (of the authenticator, or a recovery code) or a
   * passkey. */
  signIn(name: string, password: string, second: SecondFactorAnswer = {}): Promise<User> {
    return this.#call('POST', '/session', { name, password, ...second });
  }

  /** What a passkey is to answer before somebody is signed in: good once, for five minutes. */
  async passkeyOptions(): Promise<PasskeyOptions> {
    return (await this.#call<{ public_key: PasskeyOptions }>('POST', '/session/passkey/options')).public_key;
  }

  signInWithPasskey(credential: PasskeyCredential): Promise<User> {
    return this.#call('POST', '/session/passkey', { credential });
  }

  changePassword(oldPassword: string, newPassword: string, keepTokens = false): Promise<User> {
    const body = { old_password: oldPassword, new_password: newPassword, keep_tokens: keepTokens };
    return this.#call('POST', '/me/password', body);
  }

  signOut(): Promise<void> {
    return this.#call('DELETE', '/session');
  }

  me(): Promise<User> {
    return this.#call('GET', '/me');
  }

  /** The documents that the tower keeps for this user, by name. */
  preferences(): Promise<Record<string, unknown>> {
    return this.#call('GET', '/me/preferences');
  }

  /** At most 8 KiB of JSON. */
  keepPreference(name: string, document: Record<string, unknown>): Promise<void> {
    return this.#call('PUT', `/me/preferences/${name}`, document);
  }

  /** Who has a live connection now; for admins. */
  online(): Promise<readonly Online[]> {
    return this.#call('GET', '/online');
  }

  async drones(): Promise<Drone[]> {
    return (await this.#call<DroneOnWire[]>('GET', '/drones')).map(readDrone);
  }

  async drone(droneId: number): Promise<Drone> {
    return readDrone(await this.#call<DroneOnWire>('GET', `/drones/${droneId}`));
  }

  async control(droneId: number, action: ControlAction, words: ControlWords = {}): Promise<Drone> {
    return readDrone(await this.#call<DroneOnWire>('POST', `/drones/${droneId}/control/${action}`, words));
  }

  settings(droneId: number): Promise<SafetySettings> {
    return this.#call('GET', `/drones/${droneId}/settings`);
  }

  changeSettings(droneId: number, changes: Partial<SafetySettings>): Promise<SafetySettings> {
    return this.#call('PATCH', `/drones/${droneId}/settings`, changes);
  }

  lossCheck(droneId: number): Promise<LossCheck> {
    return this.#call('GET', `/drones/${droneId}/loss-check`);
  }

  /** `droneName`: as the user wrote it, who must mean this very drone. */
  acknowledgeLossCheck(droneId: number, droneName: string): Promise<LossCheck> {
    return this.#call('POST', `/drones/${droneId}/loss-check/acknowledge`, { drone: droneName });
  }

  receiverSetup(droneId: number): Promise<ReceiverSetup> {
    return this.#call('GET', `/drones/${droneId}/receiver-setup`);
  }

  rehearsal(droneId: number): Promise<RehearsalTerms> {
    return this.#call('GET', `/drones/${droneId}/rehearsal`);
  }

  rehearse(droneId: number, what: RehearsedLoss, isInFlight: boolean): Promise<unknown> {
    const body = isInFlight ? { what, in_flight: true } : { what };
    return this.#call('POST', `/drones/${droneId}/rehearsal`, body);
  }

  /** For the other families of requests: link/account_rest.ts, link/admin_rest.ts. `more`: headers. */
  call<T>(method: string, path: string, body?: unknown, more: Readonly<Record<string, string>> = {}): Promise<T> {
    return this.#call(method, path, body, more);
  }

  async #call<T>(
    method: string,
    path: string,
    body?: unknown,
    more: Readonly<Record<string, string>> = {},
  ): Promise<T> {
    try {
      return await this.#callOnce<T>(method, path, body, more);
    } catch (error) {
      const isAsked = error instanceof RestError && error.slug === 'proof-needed' && this.onProofNeeded;
      if (!isAsked || !(await isAsked())) throw error;
    }
    return this.#callOnce<T>(method, path, body, more);
  }

  async #callOnce<T>(method: string, path: string, body: unknown, more: Readonly<Record<string, string>>): Promise<T> {
    const headers: Record<string, string> = { Accept: 'application/json, application/problem+json', ...more };
    if (body !== undefined) headers['Content-Type'] = 'application/json';
    const init: RequestInit = { method, headers, credentials: 'same-origin' };
    if (body !== undefined) init.body = JSON.stringify(body);
    let answer: Response;
    try {
      answer = await this.#fetch(BASE + path, init);
    } catch {
      throw new RestError(0, 'No connection', 'The tower cannot be reached. Check the network and try again.', '');
    }
    if (!answer.ok) throw await problemOf(answer);
    if (answer.status === 204) return undefined as T;
    try {
      return (await answer.json()) as T;
    } catch {
      throw new RestError(answer.status, 'Unexpected answer', 'The tower gave an answer that is not JSON.', '');
    }
  }
}

async function problemOf(answer: Response): Promise<RestError> {
  let problem: Record<string, unknown> = {};
  try {
    const value: unknown = await answer.json();
    if (typeof value === 'object' && value !== null) problem = value as Record<string, unknown>;
  } catch {
    // A proxy in between answers in HTML: the status says enough.
  }
  const words = (key: string): string => (typeof problem[key] === 'string' ? problem[key] : '');
  const title = words('title') || answer.statusText || `Error ${answer.status}`;
  const detail = words('detail') || `The tower answered with status ${answer.status}.`;
  const waits = Number(answer.headers.get('Retry-After') ?? NaN);
  const retryAfterS = Number.isFinite(waits) ? waits : null;
  const item = typeof problem['item'] === 'number' ? problem['item'] : null;
  const errors = fieldErrors(problem['errors']);
  const kinds = Array.isArray(problem['kinds']) ? problem['kinds'].map(String) : [];
  return new RestError(answer.status, title, detail, words('type'), errors, retryAfterS, item, kinds);
}

function fieldErrors(value: unknown): FieldError[] {
  if (!Array.isArray(value)) return [];
  return value.flatMap((one: unknown) => {
    const { field, message } = (one ?? {}) as Record<string, unknown>;
    return typeof field === 'string' && typeof message === 'string' ? [{ field, message }] : [];
  });
}
