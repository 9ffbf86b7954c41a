/** Converts a stick position to a command: calibrated travel, a dead zone in the middle, expo. */

/** Raw values of one axis of a pad; `low` below `centre` below `high`. */
export interface Travel {
  readonly low: number;
  readonly centre: number;
  readonly high: number;
}

export interface Shape {
  /**
   * Share of the travel, 0..`MAX_DEAD_ZONE`, that counts as the middle. Output rises from zero at its edge, without a
   * step.
   */
  readonly deadZone: number;
  /** 0: linear; 1: cubic, gentle near the middle. The end points do not change. */
  readonly expo: number;
}

export const WHOLE_TRAVEL: Travel = { low: -1, centre: 0, high: 1 };
/** Pads rest slightly off centre. */
export const DEFAULT_SHAPE: Shape = { deadZone: 0.08, expo: 0 };
export const MAX_DEAD_ZONE = 0.4;

const clamp = (value: number): number => Math.max(-1, Math.min(1, value));

/** -1..1 with 0 at the calibrated centre, even if the two halves differ. `raw` must be finite. */
export function travelled(raw: number, { low, centre, high }: Travel): number {
  const half = raw >= centre ? high - centre : centre - low;
  return half <= 0 ? 0 : clamp((raw - centre) / half);
}

/** Maps -1..1 to -1..1, odd and monotonic. */
export function shaped(value: number, { deadZone, expo }: Shape): number {
  const size = Math.abs(clamp(value));
  if (size <= deadZone) return 0;
  const beyond = (size - deadZone) / (1 - deadZone);
  return Math.sign(value) * ((1 - expo) * beyond + expo * beyond ** 3);
}

/** As servo pulse width: 500 * axis + 1500, in microseconds. */
export const rcValue = (axis: number): number => Math.round(500 * clamp(axis) + 1500);
