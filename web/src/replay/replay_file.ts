/** A recorded flight as the page sees it: what is known so far, and questions that its worker answers. */

import type { Series } from '../frames/field_series';
import { t } from '../languages/text';
import { Store } from '../link/store';
import type { Piece } from './key_frames';
import type { FromWorker, Progress, SeriesRequest, ToWorker } from './worker_messages';

/** The part of Worker in use; tests bring their own. */
export interface WorkerLike {
  onmessage: ((event: { data: FromWorker }) => void) | null;
  onerror: ((event: { message?: string }) => void) | null;
  postMessage(message: ToWorker): void;
  terminate(): void;
}

export const openReplayWorker = (): WorkerLike =>
  new Worker(new URL('./replay_worker.ts', import.meta.url), { type: 'module' }) as unknown as WorkerLike;

export class ReplayFile {
  readonly progress = new Store<Progress | null>(null);
  readonly problem = new Store('');
  readonly #worker: WorkerLike;
  readonly #pieces = new Map<number, (piece: Piece | null) => void>();
  readonly #series = new Map<number, (series: Series) => void>();
  #asked = 0;

  constructor(worker: WorkerLike) {
    this.#worker = worker;
    worker.onmessage = ({ data }) => this.#heard(data);
    worker.onerror = ({ message }) => this.problem.set(message || t('The flight could not be read.'));
  }

  openUrl(url: string): void {
    this.#worker.postMessage({ type: 'open-url', url });
  }

  openFile(file: File): void {
    this.#worker.postMessage({ type: 'open-file', file, name: file.name });
  }

  piece(number: number): Promise<Piece | null> {
    const id = ++this.#asked;
    this.#worker.postMessage({ type: 'piece', id, number });
    return new Promise((done) => this.#pieces.set(id, done));
  }

  series(request: SeriesRequest): Promise<Series> {
    const id = ++this.#asked;
    this.#worker.postMessage({ type: 'series', id, request });
    return new Promise((done) => this.#series.set(id, done));
  }

  close(): void {
    this.#worker.onmessage = null;
    this.#worker.terminate();
  }

  #heard(message: FromWorker): void {
    if (message.type === 'progress') this.progress.set(message.progress);
    else if (message.type === 'problem') this.problem.set(message.words);
    else if (message.type === 'piece') {
      this.#pieces.get(message.id)?.(message.piece);
      this.#pieces.delete(message.id);
    } else {
      this.#series.get(message.id)?.(message.series);
      this.#series.delete(message.id);
    }
  }
}
