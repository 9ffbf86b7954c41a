/**
 * The page's side of a video: transfers the canvas to the worker, sends it requests, and receives its state. No picture
 * passes through the page.
 */

import type { Clock } from '../link/clock';
import { Store, type Readable } from '../link/store';
import type { CodecChoice, FromPlayer, QualityName, ToPlayer, VideoStats, VideoStatus } from './video_types';

/** The player reports twice a second. After several checks without a report it counts as dead. */
const LOOK_MS = 1_000;
const SILENT_LOOKS = 8;

/** The part of Worker in use; a page without workers that draw brings an equivalent. */
export interface PlayerPort {
  onmessage: ((event: { data: FromPlayer }) => void) | null;
  postMessage(message: ToPlayer, transfer?: Transferable[]): void;
  terminate(): void;
}

export interface VideoSessionOptions {
  readonly clock: Clock;
  readonly player: PlayerPort;
  readonly canvas: OffscreenCanvas;
  readonly page: { readonly protocol: string; readonly host: string };
  readonly droneId: number;
  readonly quality: QualityName;
  readonly codec: CodecChoice;
  /** The player no longer answers; its canvas is lost with it. */
  readonly onDead: () => void;
}

export class VideoSession {
  readonly #options: VideoSessionOptions;
  readonly #status: Store<VideoStatus>;
  readonly #stats = new Store<VideoStats | null>(null);
  readonly #snapshots = new Map<number, (picture: Blob | null) => void>();
  #keys = 0;
  #silentLooks = 0;
  #isWatched = true;
  #cancelLook: () => void = () => undefined;

  constructor(options: VideoSessionOptions) {
    const { player, canvas, page, droneId, quality, codec, clock } = options;
    this.#options = options;
    this.#status = new Store<VideoStatus>({
      state: 'connecting',
      words: '',
      codecs: [],
      quality,
      codec: codec === 'h264' ? 'h264' : 'mpeg1',
      sinceMs: clock.nowMs(),
      retryAtMs: null,
    });
    player.onmessage = ({ data }) => this.#receive(data);
    player.postMessage(
      { type: 'open', canvas, page: { protocol: page.protocol, host: page.host }, droneId, quality, codec },
      [canvas],
    );
    this.#look();
  }

  get status(): Readable<VideoStatus> {
    return this.#status;
  }

  get stats(): Readable<VideoStats | null> {
    return this.#stats;
  }

  want(quality: QualityName, codec: CodecChoice): void {
    this.#options.player.postMessage({ type: 'want', quality, codec });
  }

  /** Requests nothing while the video is not visible. */
  watch(isWatched: boolean): void {
    if (isWatched === this.#isWatched) return;
    this.#isWatched = isWatched;
    this.#options.player.postMessage({ type: 'watch', isWatched });
  }

  /** The visible picture as PNG; null without one. */
  snapshot(): Promise<Blob | null> {
    const key = ++this.#keys;
    const taken = new Promise<Blob | null>((resolve) => this.#snapshots.set(key, resolve));
    this.#options.player.postMessage({ type: 'snapshot', key });
    return taken;
  }

  stop(): void {
    this.#cancelLook();
    this.#options.player.onmessage = null;
    this.#options.player.postMessage({ type: 'stop' });
    this.#options.player.terminate();
    for (const resolve of this.#snapshots.values()) resolve(null);
    this.#snapshots.clear();
  }

  #receive(message: FromPlayer): void {
    this.#silentLooks = 0;
    if (message.type === 'status') {
      this.#status.set(message.status);
      if (message.status.state === 'unplayable') this.#cancelLook(); // a new player could not either
    } else if (message.type === 'stats') this.#stats.set(message.stats);
    else {
      this.#snapshots.get(message.key)?.(message.picture);
      this.#snapshots.delete(message.key);
    }
  }

  #look(): void {
    this.#cancelLook = this.#options.clock.after(LOOK_MS, () => {
      this.#silentLooks = this.#isWatched ? this.#silentLooks + 1 : 0;
      if (this.#silentLooks < SILENT_LOOKS) this.#look();
      else {
        this.stop();
        this.#options.onDead();
      }
    });
  }
}
