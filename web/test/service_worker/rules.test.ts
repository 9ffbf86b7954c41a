import { describe, expect, it } from 'vitest';

import { cacheOf, isCatalogue, isDown, outdated, wayOf, type Way } from '../../service_worker/rules';

const SCOPE = 'https://tower.example.org/';
const FILES = new Set(['index.html', 'assets/index-1.js', 'basemap/land.json', 'icon.svg']);

describe('where an answer comes from', () => {
  const cases: [string, string, string, Way][] = [
    ['GET', 'navigate', '', 'page'],
    ['GET', 'navigate', 'index.html', 'page'],
    ['GET', 'navigate', 'anything', 'page'],
    ['GET', 'navigate', 'icon.svg', 'leave'],
    ['GET', 'navigate', 'api/v1/audit.csv', 'leave'],
    ['GET', 'navigate', 'metrics', 'leave'],
    ['GET', 'cors', 'assets/index-1.js', 'kept'],
    ['GET', 'cors', 'assets/of-the-version-before-9.js', 'kept'],
    ['GET', 'cors', 'basemap/land.json', 'kept'],
    ['GET', 'cors', 'sw.js', 'leave'],
    ['HEAD', 'cors', 'assets/index-1.js', 'leave'],
    ['POST', 'cors', 'api/v1/session', 'leave'],
    ['GET', 'cors', 'api', 'leave'],
    ['GET', 'cors', 'api/v1/me', 'leave'],
    ['GET', 'cors', 'api/v1/live', 'leave'],
    ['GET', 'cors', 'api/v1/map/tiles.pmtiles', 'leave'],
  ];
  it.each(cases)('%s (%s) %s', (method, mode, path, way) => {
    expect(wayOf({ method, mode, url: SCOPE + path }, SCOPE, FILES)).toBe(way);
  });

  it('is left to the browser elsewhere', () => {
    const url = 'https://tiles.example.org/assets/1.png';
    expect(wayOf({ method: 'GET', mode: 'cors', url }, SCOPE, FILES)).toBe('leave');
  });

  it('is the same below a path', () => {
    const scope = 'https://example.org/tower/';
    const way = (path: string): Way => wayOf({ method: 'GET', mode: 'cors', url: scope + path }, scope, FILES);
    expect(way('assets/index-1.js')).toBe('kept');
    expect(way('api/v1/me')).toBe('leave');
  });
});

describe('what has had its day', () => {
  it('is all but this version and the one before it', () => {
    const names = ['console-a', 'console-b', 'somebody-elses', 'console-c', cacheOf('d')];
    expect(outdated(names, 'd')).toEqual(['console-a', 'console-b']);
  });

  it('is nothing at the first visit, nor when nothing is new', () => {
    expect(outdated([cacheOf('a')], 'a')).toEqual([]);
    expect(outdated([cacheOf('a'), cacheOf('b')], 'b')).toEqual([]);
  });
});

it('takes a proxy without a tower for no tower, and an error of the tower for an answer', () => {
  expect([502, 503, 504].every(isDown)).toBe(true);
  expect([200, 304, 401, 404, 500].some(isDown)).toBe(false);
});

it('knows the catalogues of languages, which are kept only when they were used', () => {
  expect(isCatalogue('assets/portuguese-DbBB99ic.js')).toBe(true);
  expect(isCatalogue('assets/portuguese_labels-DbBB99ic.js')).toBe(true);
  expect(['assets/Console-DMOmoEbD.js', 'assets/portuguese-a/b.js', 'portuguese-a.js'].some(isCatalogue)).toBe(false);
});
