/**
 * Whether this browser was signed in at the last visit. A guess that affects only what loads first; only the tower
 * decides who is signed in.
 */

const KEY = 'tower.signed-in';

export function maySignOnAgain(): boolean {
  try {
    return localStorage.getItem(KEY) !== null;
  } catch {
    return false; // storage is forbidden
  }
}

export function rememberSignedIn(isSignedIn: boolean): void {
  try {
    if (isSignedIn) localStorage.setItem(KEY, '1');
    else localStorage.removeItem(KEY);
  } catch {
    // The next visit then loads step by step.
  }
}
