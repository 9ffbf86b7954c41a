import { expect, it } from 'vitest';

import type { Rest } from '../../src/link/rest';
import { Zones } from '../../src/link/zones';

type Answer = (value: unknown) => void;

it('shows the newest answer, whatever the order, and nothing after signing out', async () => {
  const answers: Answer[] = [];
  const call = (): Promise<unknown> => new Promise((resolve) => answers.push(resolve));
  const zones = new Zones({ call } as unknown as Pick<Rest, 'call'>);
  const [first, second] = [zones.read(), zones.read()];
  answers[1]!([{ id: 2 }]);
  answers[0]!([{ id: 1 }]);
  await Promise.all([first, second]);
  expect(zones.list.get()).toEqual([{ id: 2 }]);
  const late = zones.read();
  zones.forget();
  answers[2]!([{ id: 3 }]);
  await late;
  expect(zones.list.get()).toEqual([]);
});
