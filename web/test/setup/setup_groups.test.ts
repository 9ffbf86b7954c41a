import { expect, test } from 'vitest';

import { tableOf } from '../../src/parameters/kinds';
import { foundGroups } from '../../src/setup/setup_groups';

test('only what the drone has is shown, numbers spelled out', () => {
  const table = tableOf(['FLTMODE1', 'FLTMODE2', 'RC7_OPTION'].map((name) => ({ name, value: 0, kind: 2 })));
  const groups = [
    ['Positions', ['FLTMODE#']],
    ['Switches', ['RC#_OPTION', 'SIMPLE']],
    ['None', ['FENCE_ENABLE']],
  ] as const;
  expect(foundGroups(groups, table)).toEqual([
    { title: 'Positions', names: ['FLTMODE1', 'FLTMODE2'] },
    { title: 'Switches', names: ['RC7_OPTION'] },
  ]);
});
