/** Keys as sticks: hold a key to move one, with ramps, because a key is only on or off. */

import { t } from '../languages/text';
import { CENTRED, type Axes, type AxesSource } from './sticks';

/** Stick travel per second while a key is held, and while the stick springs back. */
const RISE_PER_S = 2;
const FALL_PER_S = 5;

/** KeyboardEvent.code: the position of the key, independent of the layout. */
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
  readonly name = t('Keyboard: W S height, A D turn, arrows move');
  readonly #held = new Set<string>();
  #axes: Axes = CENTRED;
  #readMs: number | null = null;

  /** True if the key moves a stick. */
  press(code: string): boolean {
    if (!isStickKey(code)) return false;
    this.#held.add(code);
    return true;
  }

  release(code: string): void {
    this.#held.delete(code);
  }

  /**
   * Releases all sticks. For key releases that may go unreported: macOS reports none for keys released together with
   * Command, and menus (of the browser or the context menu) swallow them.
   */
  letGo(): void {
    this.#held.clear();
  }

  /** Releases every key, including those whose release was not reported. */
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
  // Movement toward or through the centre is faster.
  const isFalling = to === 0 || from * to < 0;
  const step = (isFalling ? FALL_PER_S : RISE_PER_S) * passedS;
  return Math.abs(to - from) <= step ? to : from + Math.sign(to - from) * step;
}
