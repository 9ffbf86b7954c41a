/** Reassembles STATUSTEXT messages that arrive in chunks. */

import type { MessageFields } from './generated/mavlink.gen';

const CHUNK_BYTES = 50;
/** A chunk that is missing after this time is lost. */
const CHUNK_WAIT_MS = 3_000;
const GAP = ' […] ';

export interface StatusText {
  readonly key: number;
  readonly atMs: number;
  readonly severity: number;
  readonly compid: number;
  readonly text: string;
}

interface Unfinished {
  readonly entry: StatusText;
  readonly nextChunk: number;
}

const utf8 = new TextEncoder();

/** Each chunk yields the whole entry as known so far; later chunks yield the same key with a longer text. */
export class StatusTextAssembler {
  readonly #unfinished = new Map<string, Unfinished>();
  #nextKey = 1;

  receive(from: { sysid: number; compid: number }, fields: MessageFields['STATUSTEXT'], nowMs: number): StatusText {
    const { severity, text, id, chunk_seq: chunk } = fields;
    const { compid } = from;
    const source = `${from.sysid}/${compid}/${id}`;
    const begun = this.#unfinished.get(source);
    const goesOn =
      id !== 0 && begun && chunk >= begun.nextChunk && chunk > 0 && nowMs - begun.entry.atMs < CHUNK_WAIT_MS;
    let entry: StatusText;
    if (goesOn) {
      const between = chunk === begun.nextChunk ? '' : GAP;
      entry = { ...begun.entry, text: begun.entry.text + between + text };
    } else {
      const missing = chunk > 0 ? GAP.trimStart() : '';
      entry = { key: this.#nextKey++, atMs: nowMs, severity, compid, text: missing + text };
    }
    const isLast = id === 0 || utf8.encode(text).length < CHUNK_BYTES;
    if (isLast) this.#unfinished.delete(source);
    else this.#unfinished.set(source, { entry, nextChunk: chunk + 1 });
    return entry;
  }
}
