/**
 * The drone's attitude between two messages: extrapolates ATTITUDE's angles and rates, as smoothly as a screen can
 * show. The extrapolation is short; after it the last value stays until it expires.
 */

const GUESS_MS = 150;
/** Time constant with which the displayed attitude follows the known one. */
const FOLLOW_MS = 50;
export const OLD_AFTER_MS = 2_000;

export interface AttitudeSample {
  readonly atMs: number;
  /** Radians and radians per second, as in ATTITUDE. */
  readonly roll: number;
  readonly pitch: number;
  readonly yaw: number;
  readonly rollspeed: number;
  readonly pitchspeed: number;
  readonly yawspeed: number;
}

export interface Attitude {
  readonly rollDeg: number;
  readonly pitchDeg: number;
  /** 0..360, clockwise from north. */
  readonly headingDeg: number;
}

const DEGREES = 180 / Math.PI;
/** Near vertical, the rates of Euler angles go to infinity. */
const STEEP = 1.4;

export class AttitudeMotion {
  #shown: (Attitude & { readonly atMs: number }) | null = null;

  /** Returns null without a sample, or with one too old. `smooth: false` for users who prefer reduced motion. */
  at(sample: AttitudeSample | null, nowMs: number, { smooth }: { smooth: boolean }): Attitude | null {
    if (!sample || nowMs - sample.atMs > OLD_AFTER_MS) {
      this.#shown = null;
      return null;
    }
    const known = smooth
      ? ahead(sample, Math.min(Math.max(0, nowMs - sample.atMs), GUESS_MS) / 1000)
      : degreesOf(sample);
    const before = this.#shown;
    if (!smooth || !before) {
      this.#shown = { ...known, atMs: nowMs };
      return known;
    }
    const share = 1 - Math.exp(-Math.max(0, nowMs - before.atMs) / FOLLOW_MS);
    const shown = {
      rollDeg: turn(before.rollDeg, known.rollDeg, share),
      pitchDeg: before.pitchDeg + (known.pitchDeg - before.pitchDeg) * share,
      headingDeg: wrapped(turn(before.headingDeg, known.headingDeg, share)),
    };
    this.#shown = { ...shown, atMs: nowMs };
    return shown;
  }
}

function ahead(sample: AttitudeSample, seconds: number): Attitude {
  const { roll, pitch, yaw, rollspeed, pitchspeed, yawspeed } = sample;
  if (Math.abs(pitch) > STEEP) return degreesOf(sample);
  const sideways = pitchspeed * Math.sin(roll) + yawspeed * Math.cos(roll);
  return degreesOf({
    roll: roll + (rollspeed + Math.tan(pitch) * sideways) * seconds,
    pitch: pitch + (pitchspeed * Math.cos(roll) - yawspeed * Math.sin(roll)) * seconds,
    yaw: yaw + (sideways / Math.cos(pitch)) * seconds,
  });
}

const degreesOf = ({ roll, pitch, yaw }: Pick<AttitudeSample, 'roll' | 'pitch' | 'yaw'>): Attitude => ({
  rollDeg: roll * DEGREES,
  pitchDeg: pitch * DEGREES,
  headingDeg: wrapped(yaw * DEGREES),
});

const wrapped = (deg: number): number => ((deg % 360) + 360) % 360;

/** The shorter way round. */
function turn(from: number, to: number, share: number): number {
  const way = ((((to - from) % 360) + 540) % 360) - 180;
  return from + way * share;
}
