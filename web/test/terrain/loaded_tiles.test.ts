import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';

import { AGAIN_MS, LoadedTiles } from '../../src/terrain/loaded_tiles';

describe('tiles that are loaded when they are asked for', () => {
  beforeEach(() => vi.useFakeTimers());
  afterEach(() => vi.useRealTimers());

  /** What is asked for is answered by `answers`, one after the other. */
  function tilesOf(answers: (string | null | Error)[], maxTiles = 4) {
    const asked: string[] = [];
    const changed = vi.fn();
    const load = async (x: number, y: number): Promise<string | null> => {
      asked.push(`${x}/${y}`);
      const answer = answers.shift();
      if (answer === undefined || answer instanceof Error) throw answer ?? new Error('not expected');
      return Promise.resolve(answer);
    };
    return { tiles: new LoadedTiles(load, changed, maxTiles), asked, changed };
  }
  const settle = () => vi.advanceTimersByTimeAsync(0);

  it('are asked for once, and announced when they have come', async () => {
    const { tiles, asked, changed } = tilesOf(['hills', null]);
    expect([tiles.at(1, 2), tiles.at(1, 2), tiles.at(3, 4)]).toEqual([undefined, undefined, undefined]);
    expect(changed).not.toHaveBeenCalled();
    await settle();
    expect(changed).toHaveBeenCalledTimes(2);
    expect([tiles.at(1, 2), tiles.at(3, 4)]).toEqual(['hills', null]);
    expect(asked).toEqual(['1/2', '3/4']);
  });

  it('are asked for again 5 s after they failed to load, as often as that happens', async () => {
    const { tiles, asked, changed } = tilesOf([new Error('no answer'), new Error('no answer'), 'hills']);
    changed.mockImplementation(() => void tiles.at(1, 2)); // as a derived value does
    tiles.at(1, 2);
    for (const times of [1, 2]) {
      await vi.advanceTimersByTimeAsync(AGAIN_MS - 1);
      tiles.at(1, 2);
      expect(asked).toHaveLength(times);
      await vi.advanceTimersByTimeAsync(1);
      expect(asked).toHaveLength(times + 1);
    }
    expect(tiles.at(1, 2)).toBe('hills');
    expect(changed).toHaveBeenCalledTimes(3);
    await vi.advanceTimersByTimeAsync(10 * AGAIN_MS);
    expect(asked).toHaveLength(3);
  });

  it('are not asked for again if nobody reads them any more', async () => {
    const { tiles, asked, changed } = tilesOf([new Error('no answer')]);
    tiles.at(1, 2);
    await vi.advanceTimersByTimeAsync(10 * AGAIN_MS);
    expect(changed).toHaveBeenCalledTimes(1);
    expect(asked).toHaveLength(1);
  });

  it('make room: the oldest goes', async () => {
    const { tiles, asked } = tilesOf(['one', 'two', 'three', 'one again'], 2);
    for (const x of [1, 2, 3]) {
      tiles.at(x, 0);
      await settle();
    }
    expect([tiles.at(3, 0), tiles.at(2, 0), tiles.at(1, 0)]).toEqual(['three', 'two', undefined]);
    expect(asked).toHaveLength(4);
  });
});
