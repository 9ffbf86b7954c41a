/** Keys as sticks: hold to move, with ramps, because a key knows only "all or nothing". */

import { CENTRED, type Axes, type AxesSource } from './sticks';

/** Stick travel each second while a key is held, and while it springs back. */
const RISE_PER_S = 2;
const FALL_PER_S = 5;

/** KeyboardEvent.code: by place on the keyboard, whatever its layout. */
const KEYS: Record<string, readonly [keyof Axes, 1 | -1]> = {
  KeyW: ['throttle', 1],
  KeyS: ['throttle', -1],
  KeyA: ['yaw', -1],
  KeyD: ['yaw', 1],
  ArrowUp: ['pitch', 1],
  ArrowDown: ['pitch', -1],
  ArrowLeft: ['roll', -1],
  ArrowRight: ['roll', 1],
};

/** Whether the key of this code moves a stick. */
export const isStickKey = (code: string): boolean => Object.hasOwn(KEYS, code);

export class KeyboardSticks implements AxesSource {
  readonly name = 'Keyboard: W S height, A D turn, arrows move';
  readonly #held = new Set<string>();
  #axes: Axes = CENTRED;
  #readMs: number | null = null;

  /** True when the key is one of ours. */
  press(code: string): boolean {
    if (!isStickKey(code)) return false;
    this.#held.add(code);
    return true;
  }

  release(code: string): void {
    this.#held.delete(code);
  }

  /**
   * The sticks spring back. For when keys may come up without a word: macOS is silent about those released together
   * with Command, and menus (of the browser, or under the pointer) keep them for themselves.
   */
  letGo(): void {
    this.#held.clear();
  }

  /** No key is held any more, whatever we did not hear of. */
  releaseAll(): void {
    this.#held.clear();
    this.#axes = CENTRED;
    this.#readMs = null;
  }

  read(nowMs: number): Axes {
    const passedS = this.#readMs === null ? 0 : Math.max(0, nowMs - this.#readMs) / 1000;
    this.#readMs = nowMs;
    const wanted: Record<keyof Axes, number> = { ...CENTRED };
    for (const code of this.#held) {
      const [axis, direction] = KEYS[code]!;
      wanted[axis] += direction;
    }
    const axis = (name: keyof Axes): number => ramp(this.#axes[name], wanted[name], passedS);
    this.#axes = { roll: axis('roll'), pitch: axis('pitch'), yaw: axis('yaw'), throttle: axis('throttle') };
    return this.#axes;
  }
}

function ramp(from: number, to: number, passedS: number): number {
  // Toward the middle, or through it, is the quick way.
  const isFalling = to === 0 || from * to < 0;
  const step = (isFalling ? FALL_PER_S : RISE_PER_S) * passedS;
  return Math.abs(to - from) <= step ? to : from + Math.sign(to - from) * step;
}
