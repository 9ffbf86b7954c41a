/** The worker that reads a recorded flight, so that a page with a long one stays quick. */

import { fetchFlight, MAX_FLIGHT_BYTES } from './flight_fetch';
import { FlightReader } from './flight_reader';
import type { FromWorker, ToWorker } from './worker_messages';

const FILE_PIECE_BYTES = 4 * 1024 * 1024;
const SAY_EVERY_MS = 150;

const reader = new FlightReader();
const say = (message: FromWorker, transfer: Transferable[] = []): void => self.postMessage(message, { transfer });

/** At once: pieces that wait for the garbage collector are as large as the flight. `transfer(0)` would not do: what the
 * browser fetched keeps its memory as long as its object. A message to nobody takes the memory along. */
function free({ buffer }: Uint8Array<ArrayBuffer>): void {
  const { port1, port2 } = new MessageChannel();
  port2.close();
  port1.postMessage(null, [buffer]);
  port1.close();
}

let saidMs = -Infinity;
function report(totalBytes: number, isLast = false): void {
  const nowMs = performance.now();
  if (!isLast && nowMs - saidMs < SAY_EVERY_MS) return;
  saidMs = nowMs;
  say({ type: 'progress', progress: reader.progress(totalBytes) });
}

async function openUrl(url: string): Promise<void> {
  let total = 0;
  await fetchFlight(url, (piece, totalBytes) => {
    total = totalBytes;
    reader.take(piece);
    free(piece);
    report(totalBytes);
  });
  finish(total);
}

async function openFile(file: Blob): Promise<void> {
  if (file.size > MAX_FLIGHT_BYTES) throw new Error('This file is too large to be replayed in the browser.');
  for (let at = 0; at < file.size; at += FILE_PIECE_BYTES) {
    const piece = new Uint8Array(await file.slice(at, at + FILE_PIECE_BYTES).arrayBuffer());
    reader.take(piece);
    free(piece);
    report(file.size);
  }
  finish(file.size);
}

/** Raises Error with words for people. */
function finish(totalBytes: number): void {
  reader.end();
  if (reader.log.end === 0) throw new Error('There is no telemetry in this file: it is no .tlog, or it is empty.');
  report(totalBytes, true);
}

const fail = (error: unknown): void => {
  const words = error instanceof Error ? error.message : String(error);
  say({ type: 'problem', words: words === 'Failed to fetch' ? 'The tower could not be reached.' : words });
};

self.onmessage = ({ data }: MessageEvent<ToWorker>): void => {
  if (data.type === 'open-url') void openUrl(data.url).catch(fail);
  else if (data.type === 'open-file') void openFile(data.file).catch(fail);
  else if (data.type === 'piece') {
    const piece = reader.piece(data.number);
    const parts = piece ? [piece.before, piece.frames] : [];
    say(
      { type: 'piece', id: data.id, piece },
      parts.flatMap(({ times, ends, bytes }) => [times.buffer, ends.buffer, bytes.buffer]),
    );
  } else {
    const series = reader.series(data.request);
    say({ type: 'series', id: data.id, series }, [series.times.buffer, series.values.buffer]);
  }
};
