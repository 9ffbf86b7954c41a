/** The four stick axes, their source, and when they are centred. */

/** Each -1..1. `throttle` 0 is the middle (keep height), `pitch` 1 is stick forward (nose down). */
export interface Axes {
  readonly roll: number;
  readonly pitch: number;
  readonly yaw: number;
  readonly throttle: number;
}

export const CENTRED: Axes = { roll: 0, pitch: 0, yaw: 0, throttle: 0 };
export const AXIS_NAMES = ['throttle', 'yaw', 'pitch', 'roll'] as const satisfies readonly (keyof Axes)[];

/** After dead zone and expo. */
export const CENTRE_LIMIT = 0.08;

/** The axes that are not centred. */
export function offCentre(axes: Axes): (keyof Axes)[] {
  return AXIS_NAMES.filter((name) => Math.abs(axes[name]) > CENTRE_LIMIT);
}

/** A device that a pilot moves. */
export interface AxesSource {
  readonly name: string;
  /**
   * `nowMs` never goes back or jumps. Null when the source is gone (a pad that was unplugged). It is not read again
   * then: a source that returns must be started again.
   */
  read(nowMs: number): Axes | null;
}
