/** Shakes a phone for a critical alert. A browser that cannot, or may not before the first touch, does nothing. */

const CRITICAL_MS = [400, 150, 400, 150, 400];

export const canVibrate = (): boolean => 'vibrate' in navigator;

export function vibrate(): boolean {
  return canVibrate() && navigator.vibrate(CRITICAL_MS);
}
