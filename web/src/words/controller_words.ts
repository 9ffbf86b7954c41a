/** Controllers on board, in words: the question before the start, the time that is left, what was found. */

import { inLanguage, t } from '../languages/text';
import { towerText } from '../languages/tower_text';
import type { ControllerSetting } from '../link/controller_settings';
import type { ControllerStart } from '../link/controllers';
import type { Finding } from '../link/findings';
import type { Operation } from '../link/operation_types';
import type { Sighting } from '../link/sightings';
import { duration, fixed } from './format';
import { measured, unitOf, type Quantity, type UnitSystem } from './units';

/** What `name` will do, what bounds it, and what ends it. */
export function startWords(name: string, start: ControllerStart, system: UnitSystem): string {
  const height = (metres: number): string => measured(system, 'height', metres);
  return [
    t('{controller} flies {name} by itself, for at most {time}.', {
      controller: start.controller,
      name,
      time: duration(start.for_s * 1000),
    }),
    start.may_take_off
      ? t('It may arm the motors and take off. Is everybody clear of it?')
      : t('It neither arms nor takes off.'),
    t('Its limits: {speed}, {low} to {high} above home, {distance} from where it begins.', {
      speed: measured(system, 'speed', start.max_speed_m_s),
      low: height(start.min_height_m),
      high: height(start.max_height_m),
      distance: measured(system, 'distance', start.max_distance_m),
    }),
    t('It stays out of the tower’s zones, unless its agent is older than the tower.'),
    t('Stop, Hold, any command, moved sticks and an admin who takes control end it at once.'),
  ].join(' ');
}

/** The range of a limit; without a quantity it is a time, in minutes. */
export function rangeWords(
  [least, most]: readonly [number, number],
  system: UnitSystem,
  quantity: Quantity | undefined,
): string {
  const words = (value: number): string => (quantity ? measured(system, quantity, value) : duration(value * 60_000));
  return t('From {least} to {most}.', { least: words(least), most: words(most) });
}

/** What a setting's number is in the user's units; undefined: it stays as the controller counts. */
export const settingQuantity = ({ unit }: ControllerSetting): Quantity | undefined =>
  unit === 'm' ? 'height' : unit === 'm/s' ? 'speed' : undefined;

function settingNumber(setting: ControllerSetting, system: UnitSystem, value: number): string {
  const quantity = settingQuantity(setting);
  const { symbol, inMetric } = quantity ? unitOf(system, quantity) : { symbol: setting.unit, inMetric: 1 };
  // At most two decimals, as the field shows them.
  return `${inLanguage(String(Number((value / inMetric).toFixed(2))))} ${symbol}`.trim();
}

/** The range of a setting's number; empty without bounds. */
export function settingRange(setting: ControllerSetting, system: UnitSystem): string {
  const [least, most] = [setting.least, setting.most].map((one) =>
    one === null ? '' : settingNumber(setting, system, one),
  ) as [string, string];
  if (least && most) return t('From {least} to {most}.', { least, most });
  if (least) return t('At least {least}.', { least });
  return most ? t('At most {most}.', { most }) : '';
}

/** Range and default of a setting. */
export function settingHint(setting: ControllerSetting, system: UnitSystem): string {
  const { default: usual } = setting;
  const words = typeof usual === 'number' ? settingNumber(setting, system, usual) : usual;
  return [settingRange(setting, system), words ? t('Default: {words}.', { words }) : ''].filter(Boolean).join(' ');
}

/** What the tower refused of a setting: its label, and why. */
export const refusedWords = ({ label }: ControllerSetting, message: string): string =>
  t('{label}: {message}', { label: towerText(label), message });

/** How long it still may fly; empty before its first report. */
export function timeLeft({ done, total }: Operation): string {
  return total > 0 ? t('{time} left', { time: duration(Math.max(0, total - done) * 1000) }) : '';
}

/** One character for the map. */
export const letterOf = ({ letter }: Finding): string => letter || '?';

export const findingTitle = (finding: Finding): string =>
  finding.letter ? t('Target {letter}', { letter: finding.letter }) : t('Target without a letter');

export const confidenceWords = ({ confidence }: Finding): string =>
  t('confidence {percent} %', { percent: fixed(confidence * 100) });

/** Beside its box in the live video: letter, confidence, age of the picture. */
export const sightingWords = ({ letter, confidence }: Sighting, ageMs: number): string =>
  t('{letter}, {percent} %, {seconds} s', {
    letter: letter || '?',
    percent: fixed(confidence * 100),
    seconds: fixed(ageMs / 1000, 1),
  });
