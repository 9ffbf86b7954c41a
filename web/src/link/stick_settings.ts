/**
 * How to read one pilot's sticks: stick mode, and for each pad its axes, travel, dead zone, expo and buttons. Stored on
 * the tower as the document `sticks`. Every document from there is checked: an incomplete one must not fly a drone.
 */

import { t } from '../languages/text';
import type { Axes } from './sticks';
import { AXIS_NAMES } from './sticks';
import { SLOTS, STICK_MODES, type Slot, type StickMode } from './stick_modes';
import { DEFAULT_SHAPE, MAX_DEAD_ZONE, WHOLE_TRAVEL, type Shape, type Travel } from './stick_shaping';

/** Increases when an older console would misread the document. Version 1 knew a pad by its id only. */
export const SETTINGS_VERSION = 2;
/** The tower stores up to 8 KiB; the settings of a pad take less than one. */
export const MAX_PADS = 6;

const MAX_AXIS = 63;
const MAX_BUTTON = 63;
/** An axis with less travel to a side than this is no stick. */
export const MIN_TRAVEL = 0.3;
/** Some pads exceed 1. */
const MAX_RAW = 2;

export const BUTTON_ACTIONS = ['none', 'hold', 'stop', 'return', 'land', 'arm', 'disarm', 'follow', 'swap'] as const;
export type ButtonAction = (typeof BUTTON_ACTIONS)[number];

export interface SlotSetting extends Travel {
  /** The axis number of the pad. */
  readonly axis: number;
  readonly isInverted: boolean;
}

export interface PadSettings {
  readonly slots: Readonly<Record<Slot, SlotSetting>>;
  readonly shapes: Readonly<Record<keyof Axes, Shape>>;
  /** By button number; unlisted buttons do nothing. */
  readonly buttons: Readonly<Record<number, ButtonAction>>;
  readonly isCalibrated: boolean;
}

export interface StickSettings {
  readonly mode: StickMode;
  /** For the touch screen: whether the throttle returns to the middle on release. */
  readonly touchThrottleSprings: boolean;
  /** By `padKey` (by `Gamepad.id` if an older console wrote it), the last used at the end. */
  readonly pads: Readonly<Record<string, PadSettings>>;
}

const slot = (axis: number, isInverted: boolean): SlotSetting => ({ axis, isInverted, ...WHOLE_TRAVEL });

/** The standard layout of the Gamepad API, where up is -1. */
export const DEFAULT_PAD: PadSettings = {
  slots: { leftX: slot(0, false), leftY: slot(1, true), rightX: slot(2, false), rightY: slot(3, true) },
  shapes: { roll: DEFAULT_SHAPE, pitch: DEFAULT_SHAPE, yaw: DEFAULT_SHAPE, throttle: DEFAULT_SHAPE },
  buttons: {},
  isCalibrated: false,
};

export const DEFAULT_SETTINGS: StickSettings = { mode: 2, touchThrottleSprings: true, pads: {} };

/** What tells one kind of device from another. */
export interface PadLayout {
  readonly id: string;
  /** "standard" if the browser has arranged the axes as the Gamepad API says; else they are in the device's order. */
  readonly mapping: string;
  readonly axes: readonly number[];
}

export const STANDARD = 'standard';

/** The same id has other axes in another browser, on another system, and with another receiver. */
export const padKey = ({ id, mapping, axes }: PadLayout): string => [id, mapping, axes.length].join('\n');

/** Older entries are for a device of this id whose layout nobody noted. */
const isOfId = (key: string, id: string): boolean => key === id || key.startsWith(`${id}\n`);

/**
 * The settings of this device. Those of another layout lend their shapes only: its axes and buttons are others.
 * Settings from before layouts were noted are for the standard one, unless somebody had calibrated them.
 */
export function padSettingsOf({ pads }: StickSettings, pad: PadLayout): PadSettings {
  const [own, older] = [pads[padKey(pad)], pads[pad.id]];
  if (own) return own;
  if (older && !older.isCalibrated && pad.mapping === STANDARD) return older;
  const [, like] = Object.entries(pads).findLast(([key]) => isOfId(key, pad.id)) ?? [];
  return like ? { ...DEFAULT_PAD, shapes: like.shapes } : DEFAULT_PAD;
}

/** Whether a device of this id has been set up, with whatever axes. */
export const isKnownId = ({ pads }: StickSettings, { id }: PadLayout): boolean =>
  Object.entries(pads).some(([key, { isCalibrated }]) => isCalibrated && isOfId(key, id));

/** Somebody calibrated a device of this id, and nobody noted its layout. */
export const isCalibratedBefore = ({ pads }: StickSettings, { id }: PadLayout): boolean =>
  pads[id]?.isCalibrated === true;

/** With this pad's settings as the newest; above the limit, drops the pad unused for longest. */
export function withPad(settings: StickSettings, pad: PadLayout, padSettings: PadSettings): StickSettings {
  const key = padKey(pad);
  const keepsOlder = isCalibratedBefore(settings, pad) && !padSettings.isCalibrated;
  const others = Object.entries(settings.pads).filter(([other]) => other !== key && (other !== pad.id || keepsOlder));
  return { ...settings, pads: Object.fromEntries([...others.slice(-(MAX_PADS - 1)), [key, padSettings]]) };
}

/**
 * With a stick read from another axis. Sticks that trade places keep what was measured; an axis that was no stick has
 * not been measured.
 */
export function withAxis(before: PadSettings, name: Slot, axis: number): PadSettings {
  const { slots } = before;
  if (slots[name].axis === axis) return before;
  const other = SLOTS.find((one) => slots[one].axis === axis);
  if (other) return { ...before, slots: { ...slots, [name]: slots[other], [other]: slots[name] } };
  return {
    ...before,
    slots: { ...slots, [name]: { ...slots[name], axis, ...WHOLE_TRAVEL } },
    isCalibrated: false,
  };
}

export const toDocument = (settings: StickSettings): Record<string, unknown> => ({
  version: SETTINGS_VERSION,
  ...settings,
});

export class UnreadableSettings extends Error {}

/** Throws `UnreadableSettings` for an invalid document: guessed stick settings are worse than not flying. */
export function readDocument(document: unknown): StickSettings {
  if (document === undefined || document === null) return DEFAULT_SETTINGS;
  const { version, mode, touchThrottleSprings, pads } = object(document);
  if (typeof version !== 'number' || version > SETTINGS_VERSION) {
    throw new UnreadableSettings(t('a newer console wrote your stick settings: reload this page'));
  }
  return {
    mode: oneOf(mode, STICK_MODES),
    touchThrottleSprings: truth(touchThrottleSprings),
    pads: Object.fromEntries(
      Object.entries(object(pads))
        .slice(-MAX_PADS)
        .map(([id, pad]) => [id, readPad(object(pad))]),
    ),
  };
}

function readPad({ slots, shapes, buttons, isCalibrated }: Record<string, unknown>): PadSettings {
  const [slotsIn, shapesIn] = [object(slots), object(shapes)];
  return {
    slots: each(SLOTS, (name) => readSlot(object(slotsIn[name]))),
    shapes: each(AXIS_NAMES, (name) => readShape(object(shapesIn[name]))),
    buttons: Object.fromEntries(
      Object.entries(object(buttons)).map(([key, action]) => [
        within(Number(key), 0, MAX_BUTTON),
        oneOf(action, BUTTON_ACTIONS),
      ]),
    ),
    isCalibrated: truth(isCalibrated),
  };
}

function readSlot(value: Record<string, unknown>): SlotSetting {
  const axis = within(value['axis'], 0, MAX_AXIS);
  const centre = within(value['centre'], -MAX_RAW, MAX_RAW);
  return {
    axis: Number.isInteger(axis) ? axis : fail(),
    isInverted: truth(value['isInverted']),
    low: within(value['low'], -MAX_RAW, centre - MIN_TRAVEL),
    centre,
    high: within(value['high'], centre + MIN_TRAVEL, MAX_RAW),
  };
}

const readShape = (value: Record<string, unknown>): Shape => ({
  deadZone: within(value['deadZone'], 0, MAX_DEAD_ZONE),
  expo: within(value['expo'], 0, 1),
});

function fail(): never {
  throw new UnreadableSettings(t('your stick settings on the tower cannot be read: set up your sticks again'));
}

const object = (value: unknown): Record<string, unknown> =>
  typeof value === 'object' && value !== null && !Array.isArray(value) ? (value as Record<string, unknown>) : fail();
const truth = (value: unknown): boolean => (typeof value === 'boolean' ? value : fail());
const within = (value: unknown, least: number, most: number): number =>
  typeof value === 'number' && value >= least && value <= most ? value : fail();
const oneOf = <T>(value: unknown, all: readonly T[]): T => (all.includes(value as T) ? (value as T) : fail());

function each<K extends string, V>(keys: readonly K[], make: (key: K) => V): Record<K, V> {
  return Object.fromEntries(keys.map((key) => [key, make(key)])) as Record<K, V>;
}
