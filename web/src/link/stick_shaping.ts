/** From where a stick stands to what is meant by it: its calibrated travel, a dead zone in the middle, expo. */

/** Of one axis of a pad, as it reports itself; `low` below `centre` below `high`. */
export interface Travel {
  readonly low: number;
  readonly centre: number;
  readonly high: number;
}

export interface Shape {
  /** Share of the travel, 0..`MAX_DEAD_ZONE`, that counts as the middle. What is beyond begins at nothing: no step. */
  readonly deadZone: number;
  /** 0: as the stick stands; 1: a cube, gentle round the middle. The ends stay the ends. */
  readonly expo: number;
}

export const WHOLE_TRAVEL: Travel = { low: -1, centre: 0, high: 1 };
/** Pads rest a little off their middle. */
export const DEFAULT_SHAPE: Shape = { deadZone: 0.08, expo: 0 };
export const MAX_DEAD_ZONE = 0.4;

const clamp = (value: number): number => Math.max(-1, Math.min(1, value));

/** -1..1 with 0 at the calibrated middle, whatever the two halves measure. `raw` must be finite. */
export function travelled(raw: number, { low, centre, high }: Travel): number {
  const half = raw >= centre ? high - centre : centre - low;
  return half <= 0 ? 0 : clamp((raw - centre) / half);
}

/** -1..1 to -1..1, odd and never falling. */
export function shaped(value: number, { deadZone, expo }: Shape): number {
  const size = Math.abs(clamp(value));
  if (size <= deadZone) return 0;
  const beyond = (size - deadZone) / (1 - deadZone);
  return Math.sign(value) * ((1 - expo) * beyond + expo * beyond ** 3);
}

/** As a servo pulse: 500 * axis + 1500, in microseconds. */
export const rcValue = (axis: number): number => Math.round(500 * clamp(axis) + 1500);
