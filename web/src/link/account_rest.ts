/** Requests about one's own account: second factor, sessions, API tokens. Admins read those of everybody too. */

import type { ApiToken, Scope, SecondFactor, SecondFactorBegun, Session } from './admin_types';
import type { Rest } from './rest';

const SECOND_FACTOR = '/me/second-factor';

export class AccountRest {
  readonly #rest: Rest;

  constructor(rest: Rest) {
    this.#rest = rest;
  }

  secondFactor(): Promise<SecondFactor> {
    return this.#rest.call('GET', SECOND_FACTOR);
  }

  beginSecondFactor(password: string): Promise<SecondFactorBegun> {
    return this.#rest.call('POST', SECOND_FACTOR, { password });
  }

  /** The recovery codes, which the tower tells this once. */
  async confirmSecondFactor(code: string): Promise<readonly string[]> {
    return (await this.#codes('/confirm', { code })).recovery_codes;
  }

  async renewRecoveryCodes(password: string, code: string): Promise<readonly string[]> {
    return (await this.#codes('/recovery-codes', { password, code })).recovery_codes;
  }

  removeSecondFactor(password: string, code: string): Promise<void> {
    return this.#rest.call('POST', `${SECOND_FACTOR}/remove`, { password, code });
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
  makeToken(
    name: string,
    scopes: readonly Scope[],
    expiresAt: string | null,
  ): Promise<{ token: ApiToken; secret: string }> {
    return this.#rest.call('POST', '/tokens', { name, scopes, expires_at: expiresAt });
  }

  revokeToken(tokenId: number): Promise<void> {
    return this.#rest.call('DELETE', `/tokens/${tokenId}`);
  }

  #codes(path: string, body: unknown): Promise<{ recovery_codes: readonly string[] }> {
    return this.#rest.call('POST', SECOND_FACTOR + path, body);
  }
}
