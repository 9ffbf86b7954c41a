/** How many examples a property tries: fewer in the short tier of the tests, as Hypothesis does in Python. */

import { configureGlobal } from 'fast-check';

const isLong = process.env['TEST_TIER'] === '--long';

/** For a property whose examples are dearer, or need to be more, than others'. */
export const examples = (commit: number, long: number): number => (isLong ? long : commit);

configureGlobal({
  numRuns: examples(40, 400),
  // CI tries the same examples in every run; elsewhere each run tries new ones.
  ...(process.env['CI'] && !isLong ? { seed: 20_261_123 } : {}),
});
