/** The quality of links by place in words. */

import { t } from '../languages/text';
import { gradeOf, type GradeRange, type LinkMeasure, type LinkPlace } from '../link/link_places';
import { fixed, UNKNOWN } from './format';
import { GRADE_WORDS } from './link_words';

export const MEASURE_WORDS: Record<LinkMeasure, string> = { loss: t('Loss'), latency: t('Round trip') };

/** `4.2 %`, `180 ms`. */
export function measureWords(measure: LinkMeasure, value: number | null): string {
  if (value === null) return UNKNOWN;
  return measure === 'loss' ? `${fixed(value, 1)} %` : `${fixed(value)} ms`;
}

/** `up to 2 %`, `2 to 8 %`, `over 20 %`. */
export function rangeWords(measure: LinkMeasure, { above, upTo }: GradeRange): string {
  const unit = measure === 'loss' ? '%' : 'ms';
  if (upTo === null) return t('over {above} {unit}', { above, unit });
  return above === null
    ? t('up to {limit} {unit}', { limit: upTo, unit })
    : t('{above} to {limit} {unit}', { above, limit: upTo, unit });
}

/** The figure inside a large cell: whole numbers, as there is little room. */
export function cellWords(measure: LinkMeasure, place: LinkPlace): string {
  const value = measure === 'loss' ? place.lossPercent : place.rttMs;
  if (value === null) return '';
  return measure === 'loss' ? `${fixed(value)} %` : `${fixed(value)} ms`;
}

/** Where the link was only lost, there is nothing to grade. */
export function placeGradeWords(measure: LinkMeasure, place: LinkPlace): string {
  const grade = gradeOf(place, measure);
  if (grade) return GRADE_WORDS[grade];
  return place.losses > 0 ? t('Link lost') : UNKNOWN;
}
