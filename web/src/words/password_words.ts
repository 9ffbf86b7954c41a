/** The tower's rules for passwords. Checks lengths here at once; only the tower judges how guessable a password is. */

const MIN_LENGTH = 12;
const MAX_LENGTH = 256;

export const PASSWORD_RULE = `${MIN_LENGTH} to ${MAX_LENGTH} characters of any kind, and not easy to guess. Length counts more than signs: four words are good.`;

/** What is wrong with it; empty if nothing. `old`: the password that it replaces, if any. */
export function passwordFault(password: string, old = ''): string {
  const length = [...password].length;
  if (length < MIN_LENGTH) return `Too short: ${MIN_LENGTH - length} more.`;
  if (length > MAX_LENGTH) return `Too long: at most ${MAX_LENGTH} characters.`;
  if (old && password === old) return 'This is the old password: choose another one.';
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
