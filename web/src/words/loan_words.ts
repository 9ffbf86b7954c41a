/** The limits of a loan, in words. */

import { t } from '../languages/text';
import type { LoanTerms } from '../link/admin_types';

export function loanLimits({ may_arm, max_height_m, radius_m }: LoanTerms): string {
  const limits = [
    ...(may_arm ? [] : [t('may not arm')]),
    ...(max_height_m === null ? [] : [t('up to {maxHeight} m high', { maxHeight: max_height_m })]),
    ...(radius_m === null ? [] : [t('up to {radius} m away', { radius: radius_m })]),
  ];
  return limits.join(', ') || t('no limits');
}
