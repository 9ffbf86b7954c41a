import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';

import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { comparedWith, packedPlan, planHash } from '../../src/plan/plan_hash';
import type { PlanKind } from '../../src/plan/plan_types';
import { itemOfRow } from '../../src/plan/wire_items';
import { anyItem } from './plan_arbitraries';

interface Golden {
  readonly name: string;
  readonly kind: PlanKind;
  readonly items: readonly unknown[];
  readonly packed: string;
  readonly hash: string;
}

/** The same file that the tower's and the agent's tests read: made with Python's struct and hashlib. */
const GOLDEN = JSON.parse(
  readFileSync(new URL('../../../tests/unit/wire/golden/plans.json', import.meta.url), 'utf8'),
) as Golden[];

describe('the packing of a plan', () => {
  it.each(GOLDEN.map((one) => [one.name, one] as const))('is the same everywhere: %s', (_name, golden) => {
    const items = golden.items.map((row, seq) => itemOfRow(row, `Item ${seq + 1}`));
    expect(Buffer.from(packedPlan(golden.kind, items)).toString('hex')).toBe(golden.packed);
    expect(planHash(golden.kind, items)).toBe(golden.hash);
  });

  it('hashes as another implementation of SHA-256 does', () => {
    fc.assert(
      fc.property(
        fc.array(anyItem, { maxLength: 20 }),
        fc.constantFrom<PlanKind>('mission', 'fence', 'rally'),
        (items, kind) => {
          const expected = createHash('sha256').update(packedPlan(kind, items)).digest('hex').slice(0, 16);
          expect(planHash(kind, items)).toBe(expected);
        },
      ),
    );
  });

  it('tells kinds, orders and the least of changes apart', () => {
    const [first, second] = GOLDEN.find((one) => one.name === 'mission')!.items.map((row) => itemOfRow(row, 'Item'));
    const items = [first!, second!];
    const hashes = new Set([
      planHash('mission', items),
      planHash('fence', items),
      planHash('mission', [second!, first!]),
      planHash('mission', [first!]),
      planHash('mission', [{ ...first!, x: first!.x + 1 }, second!]),
      planHash('mission', [{ ...first!, autocontinue: 1 - first!.autocontinue }, second!]),
      planHash('mission', [{ ...first!, params: [null, null, null, null] }, second!]),
    ]);
    expect(hashes.size).toBe(7);
  });

  it('says how the plan on the screen stands to the one on board', () => {
    const items = [itemOfRow([16, 3, [0, 0, 0, null], 1, 2, 30, 1], 'Item')];
    expect(comparedWith(null, 'mission', items)).toBe('unknown');
    expect(comparedWith(planHash('mission', items), 'mission', items)).toBe('on the drone');
    expect(comparedWith(planHash('mission', []), 'mission', items)).toBe('changed');
  });
});

describe('an item from elsewhere', () => {
  it.each([
    [[16, 3, [0, 0, 0, null], 1, 2, 30], 'seven fields'],
    [[65_536, 3, [0, 0, 0, null], 1, 2, 30, 1], 'command'],
    [[16, 256, [0, 0, 0, null], 1, 2, 30, 1], 'frame'],
    [[16, 3, [0, 0, 0], 1, 2, 30, 1], 'four numbers'],
    [[16, 3, [0, 0, 0, 1e39], 1, 2, 30, 1], 'four numbers'],
    [[16, 3, [0, 0, 0, 'x'], 1, 2, 30, 1], 'four numbers'],
    [[16, 3, [0, 0, 0, 0], 1.5, 2, 30, 1], 'whole 1e-7 degrees'],
    [[16, 3, [0, 0, 0, 0], 1, 2 ** 31, 30, 1], 'whole 1e-7 degrees'],
    [[16, 3, [0, 0, 0, 0], 1, 2, null, 1], 'height'],
    [[16, 3, [0, 0, 0, 0], 1, 2, 30, 256], 'autocontinue'],
  ])('is refused in words: %j', (row, words) => {
    expect(() => itemOfRow(row, 'Item 4')).toThrow(RangeError);
    expect(() => itemOfRow(row, 'Item 4')).toThrow(words);
    expect(() => itemOfRow(row, 'Item 4')).toThrow('Item 4');
  });

  it('is rounded to what the wire carries', () => {
    const item = itemOfRow([16, 3, [0.1, -0, 0, null], 1, 2, 30.1, 1], 'Item');
    expect(item.params[0]).toBe(Math.fround(0.1));
    expect(item.params[1]).toBe(0);
    expect(item.z).toBe(Math.fround(30.1));
  });
});
