/** The limits of a loan, in words. */

import type { LoanTerms } from '../link/admin_types';

export function loanLimits({ may_arm, max_height_m, radius_m }: LoanTerms): string {
  const limits = [
    ...(may_arm ? [] : ['may not arm']),
    ...(max_height_m === null ? [] : [`up to ${max_height_m} m high`]),
    ...(radius_m === null ? [] : [`up to ${radius_m} m away`]),
  ];
  return limits.join(', ') || 'no limits';
}
