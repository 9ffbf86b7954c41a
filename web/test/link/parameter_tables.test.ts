import { describe, expect, it } from 'vitest';

import type { Operations } from '../../src/link/operations';
import { ParameterTables } from '../../src/link/parameter_tables';
import { Rest, RestError } from '../../src/link/rest';

const FILE = { version: 1, parameters: [{ name: 'ALPHA' }] };

function tablesOf(status: number, body: unknown): { tables: ParameterTables; asked: string[] } {
  const asked: string[] = [];
  const rest = new Rest((path) => {
    asked.push(path);
    return Promise.resolve(new Response(JSON.stringify(body), { status }));
  });
  return { tables: new ParameterTables(rest, {} as Operations), asked };
}

describe('what a vehicle says of its own parameters', () => {
  it('is what the tower has', async () => {
    const { tables, asked } = tablesOf(200, FILE);
    expect(await tables.metadata(7)).toEqual(FILE);
    expect(asked).toEqual(['/api/v1/drones/7/parameters/metadata']);
  });

  it('is nothing where the tower has none, or is too old to know of it', async () => {
    expect(await tablesOf(404, { type: 'urn:tower:no-metadata', title: 'None' }).tables.metadata(7)).toBeNull();
  });

  it('is a failure where the tower fails', async () => {
    await expect(tablesOf(500, { title: 'Broken' }).tables.metadata(7)).rejects.toBeInstanceOf(RestError);
  });
});
