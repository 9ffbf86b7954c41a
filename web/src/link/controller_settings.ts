/** The settings that a controller on board describes: the values of a form, what is wrong with them, what is sent. Pure. */

import { t } from '../languages/text';
import type { ControllerSettings } from './controllers';
import type { Schemas } from './rest_types';

export type ControllerSetting = Schemas['ControllerSettingView'];

/** By the setting's name: a number in metric units, or a text. Null: a number that is missing. */
export type SettingValues = Readonly<Record<string, string | number | null>>;

export const defaultsOf = (settings: readonly ControllerSetting[]): Record<string, string | number | null> =>
  Object.fromEntries(settings.map(({ name, default: value }) => [name, value]));

/** A field in feet rounds. */
const ROUNDING = 1e-6;

/** Whether a number is within the setting's range. */
export function isInRange({ least, most }: ControllerSetting, value: number): boolean {
  return (least === null || value >= least - ROUNDING) && (most === null || value <= most + ROUNDING);
}

/**
 * Why this value cannot be sent; empty if it can. As `fault_of` of wire/controller_settings.py. `range`: that of a
 * number, in the user's units.
 */
export function settingFault(setting: ControllerSetting, value: string | number | null, range: string): string {
  if (setting.kind === 'number') {
    if (typeof value !== 'number' || !Number.isFinite(value)) return t('A number is needed.');
    return isInRange(setting, value) ? '' : range;
  }
  const text = String(value ?? '');
  if (setting.kind !== 'text') {
    return setting.choices.length === 0 || setting.choices.includes(text) ? '' : t('Choose one of the list.');
  }
  // As Python counts them.
  if ([...text].length > setting.most_characters) {
    return t('At most {count} characters.', { count: setting.most_characters });
  }
  const other = [...text].find((one) => setting.characters !== '' && !setting.characters.includes(one));
  return other === undefined ? '' : t('“{character}” cannot be in it.', { character: other });
}

/** What is sent: the values that are not the controller's own defaults. Numbers stay within their range. */
export function changedSettings(settings: readonly ControllerSetting[], values: SettingValues): ControllerSettings {
  const changed: Record<string, string | number> = {};
  for (const { name, default: usual, least, most } of settings) {
    const value = values[name] ?? usual;
    if (value === usual) continue;
    changed[name] = typeof value === 'number' ? Math.min(Math.max(value, least ?? value), most ?? value) : value;
  }
  return changed;
}
