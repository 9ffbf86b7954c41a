import { describe, expect, it } from 'vitest';
import fc from 'fast-check';

import { definitionOf } from '../../src/frames/definitions';
import { fieldReader, seriesOf, thinned } from '../../src/frames/field_series';
import { FrameLog } from '../../src/frames/frame_log';
import { TlogReader } from '../../src/frames/tlog_reader';
import { MESSAGES } from '../../src/link/generated/mavlink.gen';
import { decode } from '../../src/link/mavlink';
import { readFileSync } from 'node:fs';
import { aFlight, BEGAN_MS, entry, said, whole } from './recorded';

function read(bytes: Uint8Array, pieceBytes = bytes.length): { log: FrameLog; reader: TlogReader } {
  const log = new FrameLog();
  const reader = new TlogReader(log);
  for (let at = 0; at < bytes.length; at += pieceBytes) reader.take(bytes.subarray(at, at + pieceBytes));
  reader.end();
  return { log, reader };
}

const lines = (log: FrameLog): string[] =>
  Array.from({ length: log.end }, (_, at) => `${log.timeOf(at)} ${Buffer.from(log.frameOf(at)).toString('hex')}`);

describe('a telemetry log', () => {
  const bytes = aFlight(4);
  const { log } = read(bytes);

  it('is read to its last frame, with times', () => {
    expect(log.end).toBe(4 * 10 * 2 + 4 + 2 + 10);
    expect(log.firstMs).toBe(BEGAN_MS);
    expect(log.lastMs).toBe(BEGAN_MS + 3_900);
    expect(decode(log.frameOf(0))?.name).toBe('HEARTBEAT');
  });

  it('is the same however its bytes come', () => {
    fc.assert(
      fc.property(fc.integer({ min: 1, max: 700 }), (pieceBytes) => {
        expect(lines(read(bytes, pieceBytes).log)).toEqual(lines(log));
      }),
    );
  });

  it('loses only the torn place', () => {
    const torn = bytes.slice();
    torn[40] = torn[40]! ^ 0xff;
    const found = read(torn);
    expect(found.log.end).toBe(log.end - 1);
    expect(found.reader.skipped).toBeGreaterThan(0);
  });

  it('of any bytes raises nothing', () => {
    fc.assert(fc.property(fc.uint8Array({ maxLength: 600 }), (noise) => void read(noise, 100)));
  });

  it('keeps frames of messages that we do not know', () => {
    const strange = Uint8Array.from([0xfd, 1, 0, 0, 0, 1, 1, 0xff, 0xff, 0xee, 9, 0, 0]);
    expect(read(whole([entry(BEGAN_MS, strange), entry(BEGAN_MS + 1, said('HEARTBEAT', {}))])).log.end).toBe(2);
  });
});

describe('a ring of frames', () => {
  it('keeps the last minutes within its bounds, and its numbers go on', () => {
    const ring = new FrameLog({ maxMs: 60_000, maxBytes: 600_000 });
    const frame = said('ATTITUDE', { roll: 1 });
    for (let at = 0; at < 60_000; at++) ring.push(BEGAN_MS + at * 20, frame, 0, frame.length);
    expect(ring.end).toBe(60_000);
    expect(ring.bytes).toBeLessThan(900_000);
    expect(ring.lastMs! - ring.firstMs!).toBeGreaterThan(60_000);
    expect(ring.lastMs! - ring.firstMs!).toBeLessThan(200_000);
    expect(ring.timeOf(ring.entryAt(ring.lastMs! - 1_000))).toBe(ring.lastMs! - 1_000);
    expect(ring.kinds).toMatchObject([{ sysid: 1, compid: 1, msgid: 30, count: 60_000, last: 59_999 }]);
  });

  it('does not mind a clock that was set back', () => {
    const ring = new FrameLog();
    const frame = said('ATTITUDE', { roll: 1 });
    for (const atMs of [10, 20, 5, 30]) ring.push(atMs, frame, 0, frame.length);
    expect([0, 1, 2, 3].map((at) => ring.timeOf(at))).toEqual([10, 20, 20, 30]);
  });
});

describe('a field', () => {
  it('is read as the decoder reads it, for every number of every golden frame', () => {
    const vectors = JSON.parse(readFileSync(new URL('../golden/mavlink_vectors.json', import.meta.url), 'utf8')) as {
      name: string;
      frame: string;
      fields: Record<string, unknown>;
    }[];
    let compared = 0;
    for (const { name, frame, fields } of vectors) {
      const bytes = Uint8Array.from(Buffer.from(`00${frame}`, 'hex')); // not at the beginning of its bytes
      const id = MESSAGES.find((row) => row[1] === name)![0];
      const isV1 = bytes[1] === 0xfe;
      for (const field of definitionOf(id)!.fields) {
        if (field.type === 'c8') continue;
        const value = fields[field.name];
        const all = Array.isArray(value) ? value : [value];
        all.forEach((one, index) => {
          const known = isV1 && fieldReader(field, index)(bytes, 1) === 0 ? 0 : Number(one); // version 1 has no extensions
          expect(fieldReader(field, index)(bytes, 1)).toBe(known);
          compared += 1;
        });
      }
    }
    expect(compared).toBeGreaterThan(1_500);
  });

  it('over time is what was sent, and thinned it keeps its peaks', () => {
    const { log } = read(aFlight(10));
    const kind = log.kinds.findIndex(({ msgid }) => msgid === 33);
    const height = fieldReader(definitionOf(33)!.fields.find(({ name }) => name === 'relative_alt')!);
    const series = seriesOf(log, kind, height, BEGAN_MS + 1_000, BEGAN_MS + 2_000, 1_000);
    expect([...series.values]).toEqual([1000, 1100, 1200, 1300, 1400, 1500, 1600, 1700, 1800, 1900, 2000]);
    const spiky = Array.from({ length: 10_000 }, (_, at) => (at === 7_777 ? 99 : at === 3_333 ? -99 : 0));
    const few = thinned(
      spiky.map((_, at) => at),
      spiky,
      100,
    );
    expect(few.times.length).toBeLessThanOrEqual(100);
    expect(Math.max(...few.values)).toBe(99);
    expect(Math.min(...few.values)).toBe(-99);
    expect([...few.times]).toEqual([...few.times].sort((one, other) => one - other));
  });

  it('thinned has the least and the greatest value of each stretch, in order', () => {
    const series = thinned([0, 1, 2, 3, 4, 5, 6, 7, 8, 9], [5, 1, 9, 4, 2, 7, 7, 7, 3, 8], 4);
    expect([...series.times]).toEqual([1, 2, 8, 9]);
    expect([...series.values]).toEqual([1, 9, 3, 8]);
    const flat = thinned([0, 1, 2, 3, 4, 5], [2, 2, 2, 2, 1, 1], 4);
    expect([...flat.times]).toEqual([0, 3, 4]); // one value where all are the same
    expect(thinned([], [], 4).times).toHaveLength(0);
  });
});
