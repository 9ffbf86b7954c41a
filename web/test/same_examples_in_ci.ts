/** CI tries the same examples in every run, as Hypothesis does there; elsewhere each run tries new ones. */

import { configureGlobal } from 'fast-check';

if (process.env['CI']) configureGlobal({ seed: 20_261_123 });
