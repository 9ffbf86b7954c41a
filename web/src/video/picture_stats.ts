/** Counts pictures received and drawn, and reports twice a second on the last moments. Times are monotonic. */

import type { VideoStats } from './video_types';

/** Window of the rates: short enough to follow, long enough to be stable. */
const WINDOW_MS = 2_000;

interface Came {
  readonly atMs: number;
  readonly bytes: number;
}

export class PictureStats {
  #beganMs: number;
  #came: Came[] = [];
  #drawnMs: number[] = [];
  #delaysMs: number[] = [];
  #lastDelayMs: number | null = null;
  #decodingMs: number[] = [];
  #lastDrawnMs: number | null = null;
  #width = 0;
  #height = 0;
  /** Skipped by the tower for us, since the view began. */
  skipped = 0;

  constructor(nowMs: number) {
    this.#beganMs = nowMs;
  }

  /** Rates start again; losses stay counted. */
  restart(nowMs: number): void {
    this.#beganMs = nowMs;
    this.#came = [];
    this.#drawnMs = [];
    this.#delaysMs = [];
    this.#decodingMs = [];
  }

  came(nowMs: number, bytes: number): void {
    this.#came.push({ atMs: nowMs, bytes });
  }

  decoded(tookMs: number): void {
    this.#decodingMs.push(tookMs);
  }

  /** `delayMs`: from the camera until now; null if unknown. */
  drawn(nowMs: number, delayMs: number | null, width: number, height: number): void {
    this.#drawnMs.push(nowMs);
    this.#lastDrawnMs = nowMs;
    this.#width = width;
    this.#height = height;
    this.#lastDelayMs = delayMs;
    if (delayMs !== null) this.#delaysMs.push(delayMs);
  }

  report(nowMs: number, lost: number): VideoStats {
    const since = Math.max(nowMs - WINDOW_MS, this.#beganMs);
    this.#came = this.#came.filter(({ atMs }) => atMs > since);
    this.#drawnMs = this.#drawnMs.filter((atMs) => atMs > since);
    const seconds = Math.max(nowMs - since, 1) / 1000;
    const bytes = this.#came.reduce((sum, one) => sum + one.bytes, 0);
    const delays = this.#delaysMs.sort((a, b) => a - b);
    const decodings = this.#decodingMs;
    this.#delaysMs = [];
    this.#decodingMs = [];
    return {
      delayMs: delays[delays.length >> 1] ?? this.#lastDelayMs,
      worstDelayMs: delays.at(-1) ?? this.#lastDelayMs,
      stillMs: this.#lastDrawnMs === null ? null : nowMs - this.#lastDrawnMs,
      rateHz: this.#drawnMs.length / seconds,
      bitsPerS: (bytes * 8) / seconds,
      lost: Math.max(0, lost - this.skipped),
      skipped: this.skipped,
      decodeMs: decodings.length > 0 ? decodings.reduce((sum, one) => sum + one, 0) / decodings.length : null,
      width: this.#width,
      height: this.#height,
    };
  }
}
