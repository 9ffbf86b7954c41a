/** Keeps a recording of video in step with the replay. Pure. */

/** Farther apart than this it is set anew; nearer it runs faster or slower for a moment. */
export const MAX_APART_S = 0.5;
export const IN_STEP_S = 0.05;
/** It catches up within so long, in steps: a browser that changes the rate at every picture stutters. */
const CATCH_UP_S = 0.4;
const STEP = 0.25;
const MIN_CATCH_UP = -0.75;
const MAX_CATCH_UP = 1;

export interface VideoOrder {
  /** Null: leave it where it is. */
  readonly setS: number | null;
  readonly rate: number;
}

/** `wantedS`: where the replay is in the recording; `isS`: where the picture is. */
export function inStep(wantedS: number, isS: number, speed: number, isPlaying: boolean): VideoOrder {
  const apart = wantedS - isS;
  if (!isPlaying) return { setS: Math.abs(apart) > IN_STEP_S / 2 ? wantedS : null, rate: speed };
  if (Math.abs(apart) > MAX_APART_S * Math.max(1, speed)) return { setS: wantedS, rate: speed };
  if (Math.abs(apart) <= IN_STEP_S) return { setS: null, rate: speed };
  const steps = Math.sign(apart) * Math.ceil(Math.abs(apart) / (speed * CATCH_UP_S * STEP));
  // A browser plays between a sixteenth and sixteen times.
  const rate = speed * (1 + Math.max(MIN_CATCH_UP, Math.min(MAX_CATCH_UP, steps * STEP)));
  return { setS: null, rate: Math.max(0.0625, Math.min(16, rate)) };
}
