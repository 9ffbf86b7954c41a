/**
 * Whether this browser was signed in when it was last here. A guess that decides only what is fetched and shown first;
 * who is signed in is the tower's word alone.
 */

const KEY = 'tower.signed-in';

export function maySignOnAgain(): boolean {
  try {
    return localStorage.getItem(KEY) !== null;
  } catch {
    return false; // storage is forbidden here
  }
}

export function rememberSignedIn(isSignedIn: boolean): void {
  try {
    if (isSignedIn) localStorage.setItem(KEY, '1');
    else localStorage.removeItem(KEY);
  } catch {
    // The next visit then fetches one thing after the other.
  }
}
