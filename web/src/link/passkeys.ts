/**
 * Passkeys between the browser and the tower: converts WebAuthn JSON to the browser's objects and back, and errors to
 * messages. The tower decides what to request.
 */

import { t } from '../languages/text';
import type { Schemas } from './rest_types';

/** The tower's request, as for `navigator.credentials`; binary members are base64url. */
export type PasskeyOptions = Schemas['PasskeyOptions']['public_key'];

/** An authenticator's answer, as the tower reads it. */
export type PasskeyCredential = Schemas['PasskeyAnswer'];
export type MadePasskey = Schemas['MadePasskey'];
export type Credentials = Pick<CredentialsContainer, 'create' | 'get'>;

/** Why there is no passkey, in words. */
export class PasskeyError extends Error {
  constructor(
    message: string,
    /** The page itself withdrew the request: nothing to report. */
    readonly isWithdrawn = false,
  ) {
    super(message);
    this.name = 'PasskeyError';
  }
}

const IP_ADDRESS = /^(\d+(\.\d+){3}|\[.*\])$/;

/** Whether this browser can use passkeys on this page: over https (or on this machine), at a host name. */
export function offersPasskeys(hostname = location.hostname): boolean {
  return typeof PublicKeyCredential !== 'undefined' && !IP_ADDRESS.test(hostname);
}

/** Whether the browser lists passkeys in the name field. */
export async function offersAutofill(): Promise<boolean> {
  if (!offersPasskeys() || typeof PublicKeyCredential.isConditionalMediationAvailable !== 'function') return false;
  return PublicKeyCredential.isConditionalMediationAvailable();
}

/** Asks an authenticator to create a passkey. Rejects with PasskeyError. */
export async function makePasskey(
  options: PasskeyOptions,
  credentials: Credentials = navigator.credentials,
): Promise<MadePasskey> {
  const asked = withBytes(options) as unknown as PublicKeyCredentialCreationOptions;
  const made = await answerOf(() => credentials.create({ publicKey: asked }), asked.rp.id);
  const response = made.response as AuthenticatorAttestationResponse;
  return {
    ...headOf(made),
    response: {
      clientDataJSON: toBase64Url(response.clientDataJSON),
      attestationObject: toBase64Url(response.attestationObject),
      transports: typeof response.getTransports === 'function' ? response.getTransports() : [],
    },
  };
}

export interface Asking {
  /** Withdraws the request. */
  readonly signal?: AbortSignal;
  /** Waits until the person picks a passkey in the name field. */
  readonly isAutofill?: boolean;
}

/** Asks an authenticator to prove who the user is. Rejects with PasskeyError. */
export async function askPasskey(
  options: PasskeyOptions,
  { signal, isAutofill = false }: Asking = {},
  credentials: Credentials = navigator.credentials,
): Promise<PasskeyCredential> {
  const asked = withBytes(options) as unknown as PublicKeyCredentialRequestOptions;
  const request: CredentialRequestOptions = { publicKey: asked };
  if (signal) request.signal = signal;
  if (isAutofill) request.mediation = 'conditional';
  const found = await answerOf(() => credentials.get(request), asked.rpId);
  const response = found.response as AuthenticatorAssertionResponse;
  const handle = response.userHandle;
  return {
    ...headOf(found),
    response: {
      clientDataJSON: toBase64Url(response.clientDataJSON),
      authenticatorData: toBase64Url(response.authenticatorData),
      signature: toBase64Url(response.signature),
      ...(handle ? { userHandle: toBase64Url(handle) } : {}),
    },
  };
}

async function answerOf(ask: () => Promise<Credential | null>, towerName = ''): Promise<PublicKeyCredential> {
  let answer: Credential | null;
  try {
    answer = await ask();
  } catch (error) {
    throw inWords(error, towerName);
  }
  if (answer === null) throw new PasskeyError(t('The browser returned no passkey.'));
  return answer as PublicKeyCredential;
}

function inWords(error: unknown, towerName: string): PasskeyError {
  const name = error instanceof Error || error instanceof DOMException ? error.name : '';
  switch (name) {
    case 'AbortError':
      return new PasskeyError(t('The passkey request has expired.'), true);
    case 'NotAllowedError':
      return new PasskeyError(t('No passkey was used: the request was cancelled, or it took too long.'));
    case 'InvalidStateError':
      return new PasskeyError(t('This device has a passkey for this account already.'));
    case 'SecurityError':
      return new PasskeyError(
        t('Passkeys of this tower work only at {towerName}. Open the console there.', { towerName }),
      );
    case 'NotSupportedError':
    case 'ConstraintError':
      return new PasskeyError(
        t('This device cannot store such a passkey. It must verify you by PIN, fingerprint or face.'),
      );
    default:
      return new PasskeyError(t('The browser could not use a passkey. Try again, or use another device.'));
  }
}

const headOf = ({ id, rawId }: PublicKeyCredential) => ({ id, rawId: toBase64Url(rawId), type: 'public-key' }) as const;

/** The same options, with bytes where the browser expects bytes. */
function withBytes(options: PasskeyOptions): PasskeyOptions {
  const asked: Record<string, unknown> = { ...options, challenge: fromBase64Url(String(options['challenge'])) };
  const user = options['user'] as { id: string } | undefined;
  if (user) asked['user'] = { ...user, id: fromBase64Url(user.id) };
  for (const list of ['allowCredentials', 'excludeCredentials']) {
    const credentials = options[list] as { id: string }[] | undefined;
    if (credentials) asked[list] = credentials.map((one) => ({ ...one, id: fromBase64Url(one.id) }));
  }
  return asked;
}

export function toBase64Url(data: ArrayBuffer): string {
  const text = Array.from(new Uint8Array(data), (byte) => String.fromCharCode(byte)).join('');
  return btoa(text).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
}

export function fromBase64Url(text: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text.replaceAll('-', '+').replaceAll('_', '/')), (letter) => letter.charCodeAt(0));
}
