/** Requests about one's own account: second factor, sessions, API tokens. Admins read those of everybody too. */

import type {
  ApiToken,
  Passkey,
  PasskeyAdded,
  PasswordJudgement,
  Proof,
  Scope,
  SecondFactor,
  SecondFactorBegun,
  Session,
} from './admin_types';
import type { PasskeyCredential, PasskeyOptions } from './passkeys';
import type { Rest } from './rest';

const SECOND_FACTOR = '/me/second-factor';
const PASSKEYS = '/me/passkeys';
const PROOF = '/session/proof';

export class AccountRest {
  readonly #rest: Rest;

  constructor(rest: Rest) {
    this.#rest = rest;
  }

  secondFactor(): Promise<SecondFactor> {
    return this.#rest.call('GET', SECOND_FACTOR);
  }

  proof(): Promise<Proof> {
    return this.#rest.call('GET', PROOF);
  }

  /** `code`: of the second factor, where the account has one. */
  prove(password: string, code: string): Promise<Proof> {
    return this.#rest.call('POST', PROOF, code ? { kind: 'password', password, code } : { kind: 'password', password });
  }

  async proofOptions(): Promise<PasskeyOptions> {
    return (await this.#rest.call<{ public_key: PasskeyOptions }>('POST', `${PROOF}/passkey`)).public_key;
  }

  proveByPasskey(credential: PasskeyCredential): Promise<Proof> {
    return this.#rest.call('POST', PROOF, { kind: 'passkey', credential });
  }

  /** The tower's judgement of a new password of one's own. */
  judgePassword(password: string): Promise<PasswordJudgement> {
    return this.#rest.call('POST', '/me/password/judgement', { password });
  }

  beginSecondFactor(): Promise<SecondFactorBegun> {
    return this.#rest.call('POST', SECOND_FACTOR);
  }

  /** The recovery codes, which the tower tells this once. */
  async confirmSecondFactor(code: string): Promise<readonly string[]> {
    return (await this.#codes('/confirm', { code })).recovery_codes;
  }

  async renewRecoveryCodes(): Promise<readonly string[]> {
    return (await this.#codes('/recovery-codes')).recovery_codes;
  }

  removeSecondFactor(): Promise<void> {
    return this.#rest.call('POST', `${SECOND_FACTOR}/remove`);
  }

  passkeys(): Promise<Passkey[]> {
    return this.#rest.call('GET', PASSKEYS);
  }

  /** What the browser is to make: good once, for five minutes. */
  async newPasskeyOptions(): Promise<PasskeyOptions> {
    return (await this.#rest.call<{ public_key: PasskeyOptions }>('POST', `${PASSKEYS}/options`)).public_key;
  }

  /** With the first second factor of an account come recovery codes, told this once. */
  addPasskey(name: string, credential: PasskeyCredential): Promise<PasskeyAdded> {
    return this.#rest.call('POST', PASSKEYS, { name, credential });
  }

  renamePasskey(passkeyId: number, name: string): Promise<Passkey> {
    return this.#rest.call('PATCH', `${PASSKEYS}/${passkeyId}`, { name });
  }

  removePasskey(passkeyId: number): Promise<void> {
    return this.#rest.call('DELETE', `${PASSKEYS}/${passkeyId}`);
  }

  sessions(ofEverybody: boolean): Promise<Session[]> {
    return this.#rest.call('GET', ofEverybody ? '/sessions?everybody=true' : '/sessions');
  }

  endSession(sessionId: number): Promise<void> {
    return this.#rest.call('DELETE', `/sessions/${sessionId}`);
  }

  tokens(ofEverybody: boolean): Promise<ApiToken[]> {
    return this.#rest.call('GET', ofEverybody ? '/tokens?everybody=true' : '/tokens');
  }

  /** The token's own text is in `secret`, this once. */
  makeToken(name: string, scopes: readonly Scope[], expiresAt: string): Promise<{ token: ApiToken; secret: string }> {
    return this.#rest.call('POST', '/tokens', { name, scopes, expires_at: expiresAt });
  }

  revokeToken(tokenId: number): Promise<void> {
    return this.#rest.call('DELETE', `/tokens/${tokenId}`);
  }

  #codes(path: string, body?: unknown): Promise<{ recovery_codes: readonly string[] }> {
    return this.#rest.call('POST', SECOND_FACTOR + path, body);
  }
}
