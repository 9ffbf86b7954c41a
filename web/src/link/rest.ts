/**
 * The tower's REST interface under /api/v1. Every failure is a `RestError` with a message for people.
 *
 * The tower's OpenAPI document types paths, parameters, bodies and answers (rest_types.ts). The transport is our own:
 * openapi-fetch 0.17 adds 6.5 kB (2.5 kB gzipped) to a first script of 94 kB (35 kB), and neither raises problem
 * documents nor repeats a request after a proof.
 */

import { t } from '../languages/text';
import { towerText } from '../languages/tower_text';
import { readDrone } from './drone_view';
import type { PasskeyCredential, PasskeyOptions } from './passkeys';
import type { AnswerOf, Method, PathOf, RequestArguments, Schemas } from './rest_types';
import type { LossCheck } from './safety_types';
import { alertInWords, lossCheckInWords } from './tower_words';
import type { Drone, RehearsedLoss, User } from './wire_types';

export interface FieldError {
  readonly field: string;
  readonly message: string;
}

/** An RFC 9457 problem document, or a substitute if the tower sent none. */
export class RestError extends Error {
  constructor(
    /** HTTP status; 0 when the tower could not be reached. */
    readonly status: number,
    readonly title: string,
    readonly detail: string,
    readonly type: string,
    /** What is wrong with which field of the request. */
    readonly errors: readonly FieldError[] = [],
    /** How long to wait before the next attempt; null if the tower did not say. */
    readonly retryAfterS: number | null = null,
    /** For a plan: the refused item, from 0. */
    readonly item: number | null = null,
    /** The accepted kinds of second factor, the best first: `passkey`, `code`. */
    readonly kinds: readonly string[] = [],
  ) {
    super(detail || title);
    this.name = 'RestError';
  }

  /** The last part of the problem's type: its name in docs/api.md. */
  get slug(): string {
    return this.type.slice(Math.max(this.type.lastIndexOf('/'), this.type.lastIndexOf(':')) + 1);
  }
}

export type ControlAction = 'acquire' | 'release' | 'take' | 'give' | 'accept' | 'assist' | 'unassist' | 'stay';

/** Only `take` uses `watch`, `video` and `interrupt`; only `accept` uses `sticks_centred`. */
export type ControlWords = Schemas['TakeRequest'] & Schemas['AcceptRequest'];

/** Empty, or one of the two. */
export interface SecondFactorAnswer {
  readonly code?: string;
  readonly passkey?: PasskeyCredential;
}

type Values = Readonly<Record<string, unknown>>;

/** Parameters by location, and the body. */
export interface LooseRequest {
  readonly path?: Values;
  readonly query?: Values;
  readonly header?: Values;
  readonly body?: unknown;
}

type Fetch = (path: string, init: RequestInit) => Promise<Response>;

const BASE = '/api/v1';

export class Rest {
  /** Asks the user for a fresh proof of identity. True: they gave it, and the request is sent once more. */
  onProofNeeded: (() => Promise<boolean>) | null = null;
  readonly #fetch: Fetch;
  /** Of this page: its requests are found together in the tower's log, and each alone. */
  readonly #page = Array.from(crypto.getRandomValues(new Uint8Array(4)), (one) =>
    one.toString(16).padStart(2, '0'),
  ).join('');
  #requests = 0;

  constructor(fetcher: Fetch = (path, init) => fetch(path, init)) {
    this.#fetch = fetcher;
  }

  /**
   * Sends one request of the OpenAPI document. An answer without content gives undefined. Raises RestError.
   *
   *     rest.call('PATCH', '/users/{user_id}', { path: { user_id: 4 }, body: { disabled: true } })
   */
  call<M extends Method, P extends PathOf<M>>(
    method: M,
    path: P,
    ...[request]: RequestArguments<M, P>
  ): Promise<AnswerOf<M, P>> {
    return this.send(method, path, request) as Promise<AnswerOf<M, P>>;
  }

  /** The same without types, for code that is generic over operations. */
  async send(method: Method, path: string, request: LooseRequest = {}): Promise<unknown> {
    try {
      return await this.#sendOnce(method, path, request);
    } catch (error) {
      const isAsked = error instanceof RestError && error.slug === 'proof-needed' && this.onProofNeeded;
      if (!isAsked || !(await isAsked())) throw error;
    }
    return this.#sendOnce(method, path, request);
  }

  /**
   * Includes the second factor if the account requires one: a code (of the authenticator, or a recovery code) or a
   * passkey.
   */
  signIn(name: string, password: string, second: SecondFactorAnswer = {}): Promise<User> {
    return this.call('POST', '/session', { body: { name, password, ...second } });
  }

  /** The passkey challenge for a sign-in: valid once, for five minutes. */
  async passkeyOptions(): Promise<PasskeyOptions> {
    return (await this.call('POST', '/session/passkey/options')).public_key;
  }

  signInWithPasskey(credential: PasskeyCredential): Promise<User> {
    return this.call('POST', '/session/passkey', { body: { credential } });
  }

  changePassword(oldPassword: string, newPassword: string, keepTokens = false): Promise<User> {
    const body = { old_password: oldPassword, new_password: newPassword, keep_tokens: keepTokens };
    return this.call('POST', '/me/password', { body });
  }

  signOut(): Promise<void> {
    return this.call('DELETE', '/session');
  }

  me(): Promise<User> {
    return this.call('GET', '/me');
  }

  /** The documents that the tower stores for this user, by name. */
  preferences(): Promise<Readonly<Record<string, unknown>>> {
    return this.call('GET', '/me/preferences');
  }

  /** At most 8 KiB of JSON. */
  keepPreference(name: string, document: Record<string, unknown>): Promise<void> {
    return this.call('PUT', '/me/preferences/{name}', { path: { name }, body: document });
  }

  acknowledgeAlert(alertId: number): Promise<Schemas['AlertView']> {
    return this.call('POST', '/alerts/{alert_id}/acknowledge', { path: { alert_id: alertId } }).then(alertInWords);
  }

  /** The newest, of the whole squad. */
  pastAlerts(): Promise<readonly Schemas['AlertView'][]> {
    return this.call('GET', '/alerts', { query: { limit: 100 } }).then((alerts) => alerts.map(alertInWords));
  }

  async control(droneId: number, action: ControlAction, words: ControlWords = {}): Promise<Drone> {
    const path = `/drones/{drone_id}/control/${action}` as const;
    return readDrone(await this.call('POST', path, { path: { drone_id: droneId }, body: words }));
  }

  lossCheck(droneId: number): Promise<LossCheck> {
    return this.call('GET', '/drones/{drone_id}/loss-check', { path: { drone_id: droneId } }).then(lossCheckInWords);
  }

  /** `droneName`: as the user typed it, to confirm that they mean this drone. */
  acknowledgeLossCheck(droneId: number, droneName: string): Promise<LossCheck> {
    const request = { path: { drone_id: droneId }, body: { drone: droneName } };
    return this.call('POST', '/drones/{drone_id}/loss-check/acknowledge', request).then(lossCheckInWords);
  }

  rehearse(droneId: number, what: RehearsedLoss, isInFlight: boolean): Promise<unknown> {
    const body = isInFlight ? { what, in_flight: true } : { what };
    return this.call('POST', '/drones/{drone_id}/rehearsal', { path: { drone_id: droneId }, body });
  }

  async #sendOnce(method: Method, path: string, { path: names, query, header, body }: LooseRequest): Promise<unknown> {
    this.#requests += 1;
    const headers: Record<string, string> = {
      Accept: 'application/json, application/problem+json',
      'X-Request-Id': `${this.#page}.${this.#requests}`,
    };
    if (body !== undefined) headers['Content-Type'] = 'application/json';
    for (const [name, value] of given(header)) headers[name] = String(value);
    const init: RequestInit = { method, headers, credentials: 'same-origin' };
    if (body !== undefined) init.body = JSON.stringify(body);
    let answer: Response;
    try {
      answer = await this.#fetch(BASE + addressOf(path, names, query), init);
    } catch {
      throw new RestError(
        0,
        t('No connection'),
        t('The tower cannot be reached. Check the network and try again.'),
        '',
      );
    }
    if (!answer.ok) throw await problemOf(answer);
    if (answer.status === 204) return undefined;
    try {
      return (await answer.json()) as unknown;
    } catch {
      throw new RestError(answer.status, t('Unexpected answer'), t('The tower sent an answer that is not JSON.'), '');
    }
  }
}

/** Null and undefined mean "not given". */
const given = (values: Values = {}): [string, unknown][] =>
  Object.entries(values).filter(([, value]) => value !== null && value !== undefined);

function addressOf(path: string, names: Values = {}, query?: Values): string {
  const filled = path.replace(/\{(\w+)\}/g, (_, name: string) => encodeURIComponent(String(names[name])));
  const asked = new URLSearchParams(given(query).map(([name, value]) => [name, String(value)])).toString();
  return asked ? `${filled}?${asked}` : filled;
}

async function problemOf(answer: Response): Promise<RestError> {
  let problem: Record<string, unknown> = {};
  try {
    const value: unknown = await answer.json();
    if (typeof value === 'object' && value !== null) problem = value as Record<string, unknown>;
  } catch {
    // A proxy in between answers in HTML: then the status suffices.
  }
  const words = (key: string): string => (typeof problem[key] === 'string' ? problem[key] : '');
  const title = towerText(words('title')) || answer.statusText || t('Error {status}', { status: answer.status });
  const detail = towerText(words('detail')) || t('The tower answered with status {status}.', { status: answer.status });
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
    return typeof field === 'string' && typeof message === 'string' ? [{ field, message: towerText(message) }] : [];
  });
}
