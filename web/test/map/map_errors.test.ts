import { describe, expect, it } from 'vitest';

import { faultOf, MISSING_TILE, UNREACHED_TILE } from '../../src/map/map_errors';
import { reached } from '../../src/map/tile_source';

/** As MapLibre puts an error together that came from one of its workers. */
const fromWorker = (parts: object): Error => Object.assign(Object.create(Error.prototype) as Error, parts);

describe('errors of the map', () => {
  it('reports an error from a worker with its words', () => {
    const raised = fromWorker({ message: 'Unable to parse the tile' });
    expect(Object.prototype.toString.call(raised)).toBe('[object Object]'); // a browser would say "Error" alone
    const fault = faultOf(raised);
    expect(Object.prototype.toString.call(fault)).toBe('[object Error]');
    expect(fault).toMatchObject({ message: 'Map: Unable to parse the tile', cause: raised });
  });

  it('never reports without words', () => {
    expect(faultOf(fromWorker({ message: '' }))?.message).toBe('Map: Error');
  });

  it.each([
    ['a missing tile', new Error(MISSING_TILE)],
    ['a tile not wanted any more', fromWorker({ name: 'AbortError', message: 'signal is aborted without reason' })],
    ['a server that is away', fromWorker({ message: 'AJAXError: (503)', status: 503 })],
    ['a tower out of reach', fromWorker({ message: 'AJAXError: Failed to fetch (0): land.json', status: 0 })],
    ['a map file out of reach', fromWorker({ message: UNREACHED_TILE })],
    ['a map file that is away', fromWorker({ message: 'Bad response code: 503' })],
  ])('says nothing of %s', (_, raised) => {
    expect(faultOf(raised)).toBeNull();
  });

  it('reports other answers of a server', () => {
    expect(faultOf(fromWorker({ message: 'Bad response code: 500' }))?.message).toBe('Map: Bad response code: 500');
    expect(faultOf(fromWorker({ message: 'AJAXError: (404): land.json', status: 404 }))).not.toBeNull();
  });

  it('knows a map file out of reach from other faults of reading it', async () => {
    const raising = (error: Error) =>
      reached({ getKey: () => 'land', getBytes: () => Promise.reject(error) }).getBytes(0, 16);
    await expect(raising(new TypeError('Failed to fetch'))).rejects.toThrow(UNREACHED_TILE);
    await expect(raising(new Error('Bad response code: 500'))).rejects.toThrow('Bad response code: 500');
  });
});
