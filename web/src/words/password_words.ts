/** The tower's rules for passwords. Checks lengths here at once; only the tower judges how guessable a password is. */

import { t } from '../languages/text';

const MIN_LENGTH = 12;
const MAX_LENGTH = 256;

export const PASSWORD_RULE = t(
  '{minLength} to {maxLength} characters of any kind, and not easy to guess. Length matters more than symbols: four words are good.',
  { minLength: MIN_LENGTH, maxLength: MAX_LENGTH },
);

/** What is wrong with it; empty if nothing. `old`: the password that it replaces, if any. */
export function passwordFault(password: string, old = ''): string {
  const length = [...password].length;
  if (length < MIN_LENGTH) return t('Too short: {minLength} more.', { minLength: MIN_LENGTH - length });
  if (length > MAX_LENGTH) return t('Too long: at most {maxLength} characters.', { maxLength: MAX_LENGTH });
  if (old && password === old) return t('This is the old password: choose another one.');
  return '';
}

const LETTERS = 'abcdefghijkmnpqrstuvwxyz23456789'; // 32, without letters that look alike

/** A first password for another user: 100 random bits, readable aloud without mistakes. */
export function newPassword(
  fill: (bytes: Uint8Array<ArrayBuffer>) => unknown = (bytes) => crypto.getRandomValues(bytes),
): string {
  const bytes = new Uint8Array(20);
  fill(bytes);
  const letters = [...bytes].map((byte) => LETTERS[byte % LETTERS.length]).join('');
  return letters.replace(/(.{5})(?=.)/g, '$1-');
}
