import { describe, expect, it } from 'vitest';

import { faultOf } from '../../src/map/map_errors';
import { MISSING_TILE } from '../../src/map/missing_tile';

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
    ['a map file that is away', fromWorker({ message: 'Bad response code: 503' })],
  ])('says nothing of %s', (_, raised) => {
    expect(faultOf(raised)).toBeNull();
  });

  it('reports other answers of a server', () => {
    expect(faultOf(fromWorker({ message: 'Bad response code: 500' }))?.message).toBe('Map: Bad response code: 500');
    expect(faultOf(fromWorker({ message: 'AJAXError: (404): land.json', status: 404 }))).not.toBeNull();
  });
});
