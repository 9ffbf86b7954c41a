/** Reads one recorded flight into memory and answers questions about it. Runs in the worker; knows no worker. */

import { definitionOf } from '../frames/definitions';
import { fieldReader, seriesOf, type Series } from '../frames/field_series';
import { FrameLog } from '../frames/frame_log';
import { TlogReader } from '../frames/tlog_reader';
import { KeyFrames, type Piece } from './key_frames';
import { OverviewReader } from './overview';
import type { Progress, SeriesRequest } from './worker_messages';

const NO_SERIES: Series = { times: new Float64Array(0), values: new Float64Array(0) };

export class FlightReader {
  readonly #log = new FrameLog();
  readonly #tlog = new TlogReader(this.#log);
  readonly #keyFrames = new KeyFrames(this.#log);
  readonly #overview = new OverviewReader(this.#log);
  #readBytes = 0;
  #isWhole = false;

  /** The log, for readers of other formats. */
  get log(): FrameLog {
    return this.#log;
  }

  take(piece: Uint8Array): void {
    this.#readBytes += piece.length;
    this.#tlog.take(piece);
    this.#update();
  }

  end(): void {
    this.#tlog.end();
    this.#isWhole = true;
    this.#update();
  }

  progress(totalBytes: number): Progress {
    return {
      readBytes: this.#readBytes,
      totalBytes,
      isWhole: this.#isWhole,
      frames: this.#log.end,
      skippedBytes: this.#tlog.skipped,
      fromMs: this.#log.firstMs ?? 0,
      toMs: this.#log.lastMs ?? 0,
      begins: this.#keyFrames.begins,
      kinds: this.#log.kinds,
      overview: this.#overview.overview,
    };
  }

  piece(number: number): Piece | null {
    return this.#keyFrames.piece(number);
  }

  series({ kind, field, index, fromMs, toMs, maxPoints }: SeriesRequest): Series {
    const found = definitionOf(this.#log.kinds[kind]?.msgid ?? -1)?.fields.find(({ name }) => name === field);
    if (!found) return NO_SERIES;
    return seriesOf(this.#log, kind, fieldReader(found, index), fromMs, toMs, maxPoints);
  }

  #update(): void {
    this.#keyFrames.update();
    this.#overview.update();
  }
}
