/** Controllers on board: what a person chooses before the start, as the tower takes it (docs/controllers.md). Pure. */

import { t } from '../languages/text';
import type { Schemas } from './rest_types';

export type ControllerChoices = Schemas['ControllerChoices'];
export type ControllerStart = Required<Schemas['ControllerStart']>;
export type ControllerSettings = ControllerStart['settings'];

/** Metric. The bounds are the tower's (wire/controllers.py). */
export interface ControllerLimits {
  readonly maxSpeedMS: number;
  readonly minHeightM: number;
  readonly maxHeightM: number;
  readonly maxDistanceM: number;
  readonly minutes: number;
  readonly mayTakeOff: boolean;
}
export type LimitName = Exclude<keyof ControllerLimits, 'mayTakeOff'>;

export const BOUNDS: Readonly<Record<LimitName, readonly [least: number, most: number]>> = {
  maxSpeedMS: [0.5, 15],
  minHeightM: [1, 500],
  maxHeightM: [1, 500],
  maxDistanceM: [5, 2000],
  minutes: [5 / 60, 10],
};

/** The tower's own defaults. */
export const FIRST_LIMITS: ControllerLimits = {
  maxSpeedMS: 5,
  minHeightM: 2,
  maxHeightM: 30,
  maxDistanceM: 100,
  minutes: 5,
  mayTakeOff: false,
};

export const isWithin = (name: LimitName, value: number): boolean => {
  const [least, most] = BOUNDS[name];
  // A field in feet rounds.
  return value >= least - 1e-6 && value <= most + 1e-6;
};

/** Why nothing can be started with these limits; empty if it can. */
export function limitsFault(limits: ControllerLimits): string {
  const names = Object.keys(BOUNDS) as LimitName[];
  if (names.some((name) => !isWithin(name, limits[name]))) return t('A limit is missing, or out of range.');
  if (limits.minHeightM >= limits.maxHeightM) return t('The least height must be below the greatest.');
  return '';
}

const NAME = /^[a-z][a-z0-9_-]{0,39}$/;
const SETTING = /^[a-z][a-z0-9_]{0,39}$/;
const NUMBER = /^-?(\d+(\.\d*)?|\.\d+)$/;
const MAX_SETTINGS = 32;
const MAX_VALUE_CHARS = 400;

export const isControllerName = (name: string): boolean => NAME.test(name);

export type ReadSettings =
  { readonly settings: ControllerSettings; readonly fault: '' } | { readonly settings: null; readonly fault: string };

const bad = (fault: string): ReadSettings => ({ settings: null, fault });

/** Reads one NAME=VALUE a line. A value that is a number is sent as one; the controller knows what it needs. */
export function readSettings(text: string): ReadSettings {
  const settings: Record<string, string | number> = {};
  for (const line of text.split('\n').map((one) => one.trim())) {
    if (line === '') continue;
    const at = line.indexOf('=');
    const name = line.slice(0, Math.max(0, at)).trim();
    const value = line.slice(at + 1).trim();
    if (!SETTING.test(name)) return bad(t('“{line}” is not of the form name=value.', { line }));
    if (name in settings) return bad(t('{name} is there twice.', { name }));
    if (value.length > MAX_VALUE_CHARS) return bad(t('The value of {name} is too long.', { name }));
    settings[name] = NUMBER.test(value) ? Number(value) : value;
  }
  if (Object.keys(settings).length > MAX_SETTINGS) return bad(t('These are too many settings.'));
  return { settings, fault: '' };
}

export function startOf(controller: string, limits: ControllerLimits, settings: ControllerSettings): ControllerStart {
  const clamped = (name: LimitName): number => Math.min(Math.max(limits[name], BOUNDS[name][0]), BOUNDS[name][1]);
  return {
    controller,
    max_speed_m_s: clamped('maxSpeedMS'),
    min_height_m: clamped('minHeightM'),
    max_height_m: clamped('maxHeightM'),
    max_distance_m: clamped('maxDistanceM'),
    may_take_off: limits.mayTakeOff,
    for_s: clamped('minutes') * 60,
    settings,
  };
}
