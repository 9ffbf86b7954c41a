/** A gamepad (or a radio transmitter that reports itself as one) as a pilot's sticks. */

import { axesOf, SLOTS, type Slot } from './stick_modes';
import { padSettingsOf, type ButtonAction, type PadSettings, type StickSettings } from './stick_settings';
import { shaped, travelled } from './stick_shaping';
import type { Axes, AxesSource } from './sticks';

/** The part of a browser's Gamepad in use. */
export interface PadLike {
  readonly id: string;
  readonly index: number;
  readonly connected: boolean;
  readonly axes: readonly number[];
  readonly buttons: readonly { readonly pressed: boolean }[];
}

export type Pads = () => readonly (PadLike | null)[];

const MIN_AXES = 4;

/** Connected pads with two sticks. */
export const usablePads = (pads: Pads): PadLike[] =>
  pads().filter((pad): pad is PadLike => pad !== null && pad.connected && pad.axes.length >= MIN_AXES);

/**
 * The stick positions, before dead zone and expo; null if the pad lacks such an axis or reports a value that is not a
 * number.
 */
export function padSticks(pad: PadLike, settings: PadSettings): Record<Slot, number> | null {
  const sticks: Partial<Record<Slot, number>> = {};
  for (const name of SLOTS) {
    const { axis, isInverted, ...travel } = settings.slots[name];
    const raw = pad.axes[axis];
    if (raw === undefined || !Number.isFinite(raw)) return null;
    const value = travelled(raw, travel);
    sticks[name] = isInverted ? 0 - value : value; // 0 - x avoids -0
  }
  return sticks as Record<Slot, number>;
}

/** The pad's commands to the drone. */
export function padAxes(pad: PadLike, settings: StickSettings): Axes | null {
  const own = padSettingsOf(settings, pad.id);
  const sticks = padSticks(pad, own);
  if (!sticks) return null;
  const { roll, pitch, yaw, throttle } = axesOf(settings.mode, sticks);
  const { shapes } = own;
  return {
    roll: shaped(roll, shapes.roll),
    pitch: shaped(pitch, shapes.pitch),
    yaw: shaped(yaw, shapes.yaw),
    throttle: shaped(throttle, shapes.throttle),
  };
}

/**
 * Reads only this pad, until it disappears once. The settings are fixed at the start: a change meanwhile, here or in
 * another tab, must not make the drone jump.
 */
export function padSource(
  first: PadLike,
  pads: Pads,
  settings: StickSettings,
  onButton: (action: ButtonAction) => void = () => undefined,
): AxesSource {
  const { buttons } = padSettingsOf(settings, first.id);
  const edges = new ButtonEdges();
  let isGone = false;
  return {
    name: first.id,
    read() {
      const pad = pads().find((one) => one?.index === first.index && one.id === first.id && one.connected);
      const axes = isGone || !pad ? null : padAxes(pad, settings);
      isGone = axes === null;
      if (pad && axes) for (const number of edges.pressed(pad)) onButton(buttons[number] ?? 'none');
      return axes;
    },
  };
}

/** Which buttons were pressed since the last call. A button that is down from the start does not count. */
export class ButtonEdges {
  #down: readonly boolean[] | null = null;

  pressed(pad: PadLike): number[] {
    const before = this.#down;
    this.#down = pad.buttons.map(({ pressed }) => pressed);
    if (!before) return [];
    return [...this.#down.keys()].filter((number) => this.#down![number] && before[number] === false);
  }
}
