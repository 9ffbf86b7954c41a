/**
 * Which sticks a pilot has moved since the device was plugged in, with the settings that apply. A browser reports zeros
 * until the first input, which look like centred sticks; and only moving a stick shows that it is read rightly.
 */

import { padAxes, padSticks, type PadLike } from './pad_source';
import { SLOTS, type Slot } from './stick_modes';
import { padKey, padSettingsOf, type PadSettings, type StickSettings } from './stick_settings';

/** Far enough that nobody does it by leaning on a stick. */
export const SEEN_MOVED = 0.6;

export class SticksSeen {
  #of = '';
  #slots: PadSettings['slots'] | null = null;
  readonly #moved = new Set<Slot>();

  /** Null if there is no such device now. */
  take(pad: PadLike | null, settings: StickSettings): void {
    const of = pad ? `${pad.index} ${padKey(pad)}` : '';
    const own = pad && padSettingsOf(settings, pad);
    // Buttons, expo and stick mode move no stick to another axis.
    if (of !== this.#of || own?.slots !== this.#slots) this.forget();
    [this.#of, this.#slots] = [of, own?.slots ?? null];
    const sticks = pad && own && padAxes(pad, settings) && padSticks(pad, own);
    for (const slot of SLOTS) if (sticks && Math.abs(sticks[slot]) >= SEEN_MOVED) this.#moved.add(slot);
  }

  /** The device was unplugged. */
  forget(): void {
    this.#of = '';
    this.#moved.clear();
  }

  get unmoved(): Slot[] {
    return SLOTS.filter((slot) => !this.#moved.has(slot));
  }
}
