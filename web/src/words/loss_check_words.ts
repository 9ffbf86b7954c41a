/** The check before flight in a few words, with the tone they are shown in. Pure. */

import { plural, t } from '../languages/text';
import { mustBeRead, type LossCheck } from '../link/safety_types';

export interface LossCheckSummary {
  readonly words: string;
  readonly tone: 'danger' | 'warning' | 'good' | 'unknown';
}

export function lossCheckSummary(check: LossCheck): LossCheckSummary {
  if (check.dangerous)
    return { words: mustBeRead(check) ? t('DANGEROUS, not read yet') : t('dangerous, acknowledged'), tone: 'danger' };
  const warnings = check.sentences.filter(({ severity }) => severity === 'warning').length;
  if (warnings > 0) {
    const words = plural(warnings, { one: 'no danger, {n} warning', other: 'no danger, {n} warnings' });
    return { words, tone: 'warning' };
  }
  return check.complete ? { words: t('no danger found'), tone: 'good' } : { words: t('incomplete'), tone: 'unknown' };
}
