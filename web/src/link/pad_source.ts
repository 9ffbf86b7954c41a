/** A gamepad (or a radio transmitter that reports itself as one) as a pilot's sticks. */

import { axesOf, SLOTS, type Slot } from './stick_modes';
import {
  isCalibratedBefore,
  isKnownId,
  padKey,
  padSettingsOf,
  STANDARD,
  type ButtonAction,
  type PadLayout,
  type PadSettings,
  type StickSettings,
} from './stick_settings';
import { shaped, travelled } from './stick_shaping';
import type { Axes, AxesSource } from './sticks';

/** The part of a browser's Gamepad in use. */
export interface PadLike extends PadLayout {
  readonly index: number;
  readonly connected: boolean;
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

/** Why a device must be set up before it flies; null once it may. */
export type Unready =
  /** Its axes are in an order that only moving them shows. */
  | 'unknown-layout'
  /** A device of this name was set up, with other axes or before anybody noted them. */
  | 'other-layout'
  /** Two sticks are read from one axis. */
  | 'shared-axis'
  /** A stick is read from an axis that is none in the standard layout. */
  | 'no-stick';

/** In the standard layout; what follows, if anything does, are triggers and hats. */
const STANDARD_STICKS = 4;

export function unready(pad: PadLayout, settings: StickSettings): Unready | null {
  const { slots, isCalibrated } = padSettingsOf(settings, pad);
  const axes = SLOTS.map((name) => slots[name].axis);
  if (new Set(axes).size < axes.length) return 'shared-axis';
  if (isCalibrated) return null;
  if (isCalibratedBefore(settings, pad)) return 'other-layout';
  if (pad.mapping !== STANDARD) return isKnownId(settings, pad) ? 'other-layout' : 'unknown-layout';
  return axes.some((axis) => axis >= STANDARD_STICKS) ? 'no-stick' : null;
}

/** What the drone would be told with these settings. */
export function axesWith(pad: PadLike, padSettings: PadSettings, settings: StickSettings): Axes | null {
  const sticks = padSticks(pad, padSettings);
  if (!sticks) return null;
  const { roll, pitch, yaw, throttle } = axesOf(settings.mode, sticks);
  const { shapes } = padSettings;
  return {
    roll: shaped(roll, shapes.roll),
    pitch: shaped(pitch, shapes.pitch),
    yaw: shaped(yaw, shapes.yaw),
    throttle: shaped(throttle, shapes.throttle),
  };
}

/** The pad's commands to the drone; null for a pad that must be set up first. */
export const padAxes = (pad: PadLike, settings: StickSettings): Axes | null =>
  unready(pad, settings) ? null : axesWith(pad, padSettingsOf(settings, pad), settings);

/**
 * Reads only this pad, until it disappears once or becomes one of another layout. The settings are fixed at the start:
 * a change meanwhile, here or in another tab, must not make the drone jump.
 */
export function padSource(
  first: PadLike,
  pads: Pads,
  settings: StickSettings,
  onButton: (action: ButtonAction) => void = () => undefined,
): AxesSource {
  const { buttons } = padSettingsOf(settings, first);
  const edges = new ButtonEdges();
  // A browser may put another device into the same object.
  const [{ id, index }, key] = [first, padKey(first)];
  let isGone = false;
  return {
    name: id,
    read() {
      const pad = pads().find((one) => one?.index === index && padKey(one) === key && one.connected);
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
