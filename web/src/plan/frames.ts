/** The coordinate frames (MAV_FRAME) of plans: the reference of a height. */

import { t } from '../languages/text';

export const FRAME = {
  GLOBAL: 0,
  /** No place: x and y are plain numbers. */
  MISSION: 2,
  GLOBAL_RELATIVE_ALT: 3,
  GLOBAL_INT: 5,
  GLOBAL_RELATIVE_ALT_INT: 6,
  GLOBAL_TERRAIN_ALT: 10,
  GLOBAL_TERRAIN_ALT_INT: 11,
} as const;

export type Datum = 'sea' | 'home' | 'terrain';

const DATUM: ReadonlyMap<number, Datum> = new Map([
  [FRAME.GLOBAL, 'sea'],
  [FRAME.GLOBAL_INT, 'sea'],
  [FRAME.GLOBAL_RELATIVE_ALT, 'home'],
  [FRAME.GLOBAL_RELATIVE_ALT_INT, 'home'],
  [FRAME.GLOBAL_TERRAIN_ALT, 'terrain'],
  [FRAME.GLOBAL_TERRAIN_ALT_INT, 'terrain'],
] as const);

/** `null`: not a geographic frame. */
export const datumOf = (frame: number): Datum | null => DATUM.get(frame) ?? null;

/** The selectable frames; the _INT variants mean the same and are kept unchanged. */
export const FRAME_CHOICES: readonly { readonly frame: number; readonly label: string }[] = [
  { frame: FRAME.GLOBAL_RELATIVE_ALT, label: t('above home') },
  { frame: FRAME.GLOBAL, label: t('above sea level') },
  { frame: FRAME.GLOBAL_TERRAIN_ALT, label: t('above terrain') },
];

const DATUM_WORDS: Record<Datum, string> = {
  home: t('above home'),
  sea: t('above sea level'),
  terrain: t('above terrain'),
};

export function frameWords(frame: number): string {
  const datum = datumOf(frame);
  if (datum) return DATUM_WORDS[datum];
  return frame === FRAME.MISSION ? t('no place') : t('frame {frame}', { frame });
}
