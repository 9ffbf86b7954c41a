import { readFileSync } from 'node:fs';
import { describe, expect, it } from 'vitest';

import { MESSAGES } from '../../src/link/generated/mavlink.gen';
import { decode, encode, frameLengthAt, type Message } from '../../src/link/mavlink';
import { definitionByName } from '../../src/link/mavlink_fields';

interface Vector {
  name: Message['name'];
  case: string;
  version: 1 | 2;
  signed: boolean;
  sysid: number;
  compid: number;
  seq: number;
  fields: Record<string, unknown>;
  frame: string;
}

const vectors = JSON.parse(
  readFileSync(new URL('../golden/mavlink_vectors.json', import.meta.url), 'utf8'),
) as Vector[];
const bytesOf = (hex: string): Uint8Array => Uint8Array.from(Buffer.from(hex, 'hex'));

/** 64-bit integers travel as text in the vectors. */
function expected({ name, fields }: Vector): Record<string, unknown> {
  const result = { ...fields };
  for (const { name: field, type } of definitionByName.get(name)!.fields) {
    if (type !== 'u64' && type !== 'i64') continue;
    const value = fields[field];
    result[field] = Array.isArray(value) ? value.map((one) => BigInt(one as string)) : BigInt(value as string);
  }
  return result;
}

describe('golden frames made by pymavlink', () => {
  it('cover each message of the table', () => {
    expect(new Set(vectors.map((vector) => vector.name))).toEqual(new Set(MESSAGES.map(([, name]) => name)));
  });

  it.each(vectors.map((vector) => [`${vector.name} ${vector.case} v${vector.version}`, vector] as const))(
    '%s decodes to its fields',
    (_, vector) => {
      const message = decode(bytesOf(vector.frame));
      expect(message?.name).toBe(vector.name);
      if (vector.version === 2) expect(message?.fields).toEqual(expected(vector));
      else expect(message?.fields).toMatchObject(withoutExtensions(vector, message!));
      expect(message?.header).toMatchObject({
        version: vector.version,
        signed: vector.signed,
        sysid: vector.sysid,
        compid: vector.compid,
        seq: vector.seq,
      });
    },
  );

  it.each(
    vectors
      .filter(({ version, signed }) => version === 2 && !signed)
      .map((vector) => [`${vector.name} ${vector.case}`, vector] as const),
  )('%s encodes to the same bytes', (_, vector) => {
    const frame = encode(vector.name, expected(vector), vector, vector.seq);
    expect(Buffer.from(frame).toString('hex')).toBe(vector.frame);
  });
});

/** Version 1 does not carry extension fields: they read as zero. */
function withoutExtensions(vector: Vector, message: Message): Record<string, unknown> {
  const payloadLength = bytesOf(vector.frame)[1]!;
  const carried = definitionByName.get(message.name)!.fields.filter(({ offset }) => offset < payloadLength);
  const all = expected(vector);
  return Object.fromEntries(carried.map(({ name }) => [name, all[name]]));
}

describe('bytes from outside', () => {
  const good = encode('HEARTBEAT', { custom_mode: 4 }, { sysid: 1, compid: 1 }, 9);

  it('with one bit wrong are not believed', () => {
    for (let bit = 8; bit < good.length * 8; bit++) {
      const bad = good.slice();
      bad[bit >> 3]! ^= 1 << (bit & 7);
      expect(decode(bad), `bit ${bit}`).toBeNull();
    }
  });

  it('cut short are no frame', () => {
    for (let length = 0; length < good.length; length++) expect(decode(good.subarray(0, length))).toBeNull();
  });

  it('of any kind never make the decoder throw', () => {
    let seed = 12345;
    let decoded = 0;
    const random = (below: number): number => {
      seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
      return seed % below;
    };
    for (let round = 0; round < 20_000; round++) {
      const bytes = Uint8Array.from({ length: random(300) }, () => random(256));
      if (round % 2 && bytes.length) bytes[0] = round % 4 === 1 ? 0xfd : 0xfe;
      // Called directly: an exception fails the test, and an assertion on each of so many is slow.
      frameLengthAt(bytes, random(10));
      if (decode(bytes)) decoded++;
    }
    expect(decoded).toBeLessThan(100);
  });
});
