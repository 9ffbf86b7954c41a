/** Two thumbs on a screen as sticks. The page reports their positions; a released stick springs back. */

import { t } from '../languages/text';
import { axesOf, SLOT_OF, type Slot, type StickMode } from './stick_modes';
import { shaped, type Shape } from './stick_shaping';
import type { Axes, AxesSource } from './sticks';

export type Side = 'left' | 'right';
/** Each -1..1; right and up are positive. */
export interface Knob {
  readonly x: number;
  readonly y: number;
}

const MIDDLE: Knob = { x: 0, y: 0 };
/** Thumbs are broad, and a screen has no spring to feel. */
const SHAPE: Shape = { deadZone: 0.1, expo: 0.3 };

export class TouchSticks implements AxesSource {
  readonly name = t('Touch sticks');
  readonly #mode: StickMode;
  readonly #throttleSprings: boolean;
  readonly #thumbs = new Map<number, Side>();
  readonly #knobs: Record<Side, Knob> = { left: MIDDLE, right: MIDDLE };

  constructor({ mode, throttleSprings }: { mode: StickMode; throttleSprings: boolean }) {
    this.#mode = mode;
    this.#throttleSprings = throttleSprings;
  }

  knob(side: Side): Knob {
    return this.#knobs[side];
  }

  /** Ignores a second thumb on the same stick. */
  press(side: Side, pointerId: number, at: Knob): void {
    if ([...this.#thumbs.values()].includes(side)) return;
    this.#thumbs.set(pointerId, side);
    this.move(pointerId, at);
  }

  move(pointerId: number, { x, y }: Knob): void {
    const side = this.#thumbs.get(pointerId);
    if (!side || !Number.isFinite(x) || !Number.isFinite(y)) return;
    // The gate looks round but acts square: both axes reach their ends in a corner.
    this.#knobs[side] = { x: clamp(x), y: clamp(y) };
  }

  release(pointerId: number): void {
    const side = this.#thumbs.get(pointerId);
    if (!side) return;
    this.#thumbs.delete(pointerId);
    const throttle: Slot = SLOT_OF[this.#mode].throttle;
    const keepsY = !this.#throttleSprings && throttle === (side === 'left' ? 'leftY' : 'rightY');
    this.#knobs[side] = { x: 0, y: keepsY ? this.#knobs[side].y : 0 };
  }

  releaseAll(): void {
    this.#thumbs.clear();
    this.#knobs.left = MIDDLE;
    this.#knobs.right = MIDDLE;
  }

  read(): Axes {
    const { left, right } = this.#knobs;
    const axes = axesOf(this.#mode, { leftX: left.x, leftY: left.y, rightX: right.x, rightY: right.y });
    return {
      roll: shaped(axes.roll, SHAPE),
      pitch: shaped(axes.pitch, SHAPE),
      yaw: shaped(axes.yaw, SHAPE),
      throttle: shaped(axes.throttle, { ...SHAPE, expo: 0 }),
    };
  }
}

const clamp = (value: number): number => Math.max(-1, Math.min(1, value));
