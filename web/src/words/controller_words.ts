/** Controllers on board, in words: the question before the start, the time that is left, what was found. */

import { t } from '../languages/text';
import type { ControllerStart } from '../link/controllers';
import type { Finding } from '../link/findings';
import type { Operation } from '../link/operation_types';
import type { Sighting } from '../link/sightings';
import { duration, fixed } from './format';
import { measured, type Quantity, type UnitSystem } from './units';

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
