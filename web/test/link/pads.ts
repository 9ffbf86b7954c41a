/** Pads for tests. */

import type { PadLike } from '../../src/link/pad_source';

export const pad = (axes: number[], more: Partial<PadLike> & { down?: number[] } = {}): PadLike => {
  const { down = [], ...rest } = more;
  const buttons = [...Array(4).keys()].map((number) => ({ pressed: down.includes(number) }));
  return { id: 'P', mapping: 'standard', index: 1, connected: true, axes, buttons, ...rest };
};
