import { afterEach, describe, expect, it, vi } from 'vitest';

import {
  askPasskey,
  fromBase64Url,
  makePasskey,
  offersPasskeys,
  PasskeyError,
  toBase64Url,
  type Credentials,
} from '../../src/link/passkeys';

const bytes = (...values: number[]): ArrayBuffer => Uint8Array.from(values).buffer;
const REQUEST = { challenge: '-_8', rpId: 'tower.example.org', allowCredentials: [{ id: 'AQI', type: 'public-key' }] };
const CREATION = {
  challenge: '-_8',
  rp: { id: 'tower.example.org', name: 'Control Tower' },
  user: { id: 'AwQ', name: 'anna', displayName: 'anna' },
  excludeCredentials: [{ id: 'AQI', type: 'public-key' }],
};

function credentials(answer: () => unknown): { api: Credentials; asked: CredentialRequestOptions[] } {
  const asked: CredentialRequestOptions[] = [];
  const work = (options?: object): Promise<never> => {
    asked.push(options ?? {});
    return Promise.resolve(answer() as never);
  };
  return { api: { create: work, get: work }, asked };
}

async function failure(work: Promise<unknown>): Promise<PasskeyError> {
  const error: unknown = await work.then(
    () => null,
    (reason: unknown) => reason,
  );
  expect(error).toBeInstanceOf(PasskeyError);
  return error as PasskeyError;
}

describe('passkeys in the browser', () => {
  it('reads and writes base64url of every length', () => {
    for (let length = 0; length < 70; length++) {
      const data = Uint8Array.from({ length }, (_, at) => (at * 67 + 250) % 256);
      const text = toBase64Url(data.buffer);
      expect(text).toMatch(/^[A-Za-z0-9_-]*$/);
      expect(fromBase64Url(text)).toEqual(data);
    }
  });

  it('asks with bytes where the browser wants bytes, and answers in base64url', async () => {
    const { api, asked } = credentials(() => ({
      id: '__4',
      rawId: bytes(255, 254),
      response: {
        clientDataJSON: bytes(1),
        authenticatorData: bytes(2),
        signature: bytes(251, 255),
        userHandle: bytes(3, 4),
      },
    }));
    const { signal } = new AbortController();
    const answer = await askPasskey(REQUEST, { signal, isAutofill: true }, api);
    expect(answer).toEqual({
      id: '__4',
      rawId: '__4',
      type: 'public-key',
      response: { clientDataJSON: 'AQ', authenticatorData: 'Ag', signature: '-_8', userHandle: 'AwQ' },
    });
    expect(asked[0]).toEqual({
      publicKey: {
        challenge: Uint8Array.of(251, 255),
        rpId: 'tower.example.org',
        allowCredentials: [{ id: Uint8Array.of(1, 2), type: 'public-key' }],
      },
      signal,
      mediation: 'conditional',
    });
  });

  it('leaves out the handle that an authenticator does not send', async () => {
    const response = { clientDataJSON: bytes(), authenticatorData: bytes(), signature: bytes(), userHandle: null };
    const { api, asked } = credentials(() => ({ id: '', rawId: bytes(), response }));
    expect((await askPasskey(REQUEST, {}, api)).response).not.toHaveProperty('userHandle');
    expect(asked[0]).not.toHaveProperty('mediation');
  });

  it('has a new one made', async () => {
    const { api, asked } = credentials(() => ({
      id: 'AQ',
      rawId: bytes(1),
      response: { clientDataJSON: bytes(1), attestationObject: bytes(2), getTransports: () => ['internal', 'hybrid'] },
    }));
    const made = await makePasskey(CREATION, api);
    expect(made.response).toEqual({
      clientDataJSON: 'AQ',
      attestationObject: 'Ag',
      transports: ['internal', 'hybrid'],
    });
    expect(asked[0]?.publicKey).toMatchObject({
      user: { id: Uint8Array.of(3, 4), name: 'anna' },
      excludeCredentials: [{ id: Uint8Array.of(1, 2), type: 'public-key' }],
    });
  });

  it.each([
    ['NotAllowedError', 'cancelled, or it took too long'],
    ['InvalidStateError', 'has a passkey for this account already'],
    ['SecurityError', 'work only at tower.example.org'],
    ['ConstraintError', 'PIN, fingerprint or face'],
    ['NotSupportedError', 'PIN, fingerprint or face'],
    ['UnknownError', 'could not use a passkey'],
  ])('says %s in words', async (name, words) => {
    const { api } = credentials(() => {
      throw new DOMException('The operation either timed out or was not allowed', name);
    });
    for (const work of [makePasskey(CREATION, api), askPasskey(REQUEST, {}, api)]) {
      const error = await failure(work);
      expect(error.message).toContain(words);
      expect(error.isWithdrawn).toBe(false);
    }
  });

  it('has nothing to tell where the question was taken back', async () => {
    const { api } = credentials(() => {
      throw new DOMException('', 'AbortError');
    });
    expect((await failure(askPasskey(REQUEST, {}, api))).isWithdrawn).toBe(true);
  });

  it('says so where the browser gives none', async () => {
    const { api } = credentials(() => null);
    expect((await failure(askPasskey(REQUEST, {}, api))).message).toContain('no passkey');
  });
});

describe('where passkeys are offered', () => {
  afterEach(() => vi.unstubAllGlobals());

  it('is where the browser has them, at a name', () => {
    expect(offersPasskeys('tower.example.org')).toBe(false); // no PublicKeyCredential: plain http
    vi.stubGlobal('PublicKeyCredential', class {});
    expect(offersPasskeys('tower.example.org')).toBe(true);
    expect(offersPasskeys('localhost')).toBe(true);
    expect(offersPasskeys('127.0.0.1')).toBe(false);
    expect(offersPasskeys('[::1]')).toBe(false);
  });
});
