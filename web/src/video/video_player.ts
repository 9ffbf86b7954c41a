/** Puts the parts together: link, decoders, screen, figures. Runs in the worker (player_worker.ts). */

import type { Clock } from '../link/clock';
import type { SocketLike } from '../link/live';
import { PictureStats } from './picture_stats';
import { StreamGate } from './stream_gate';
import { VideoLink, type LinkState, type TowerSays, type Wish } from './video_link';
import type { CodecChoice, FromPlayer, QualityName, VideoState, VideoStatus } from './video_types';

export interface VideoPlayerOptions {
  readonly clock: Clock;
  readonly quality: QualityName;
  readonly codec: CodecChoice;
  readonly openSocket: (wish: Wish) => SocketLike;
  readonly tell: (message: FromPlayer) => void;
}

const REPORT_MS = 500;

export class VideoPlayer {
  readonly #options: VideoPlayerOptions;
  readonly #link: VideoLink;
  readonly #gate = new StreamGate();
  readonly #stats: PictureStats;
  #says: TowerSays | null = null;
  #linkState: LinkState = { phase: 'stopped', failures: 0, retryAtMs: null, why: '' };
  #status: VideoStatus;

  constructor(options: VideoPlayerOptions) {
    const { clock, quality, codec } = options;
    this.#options = options;
    this.#stats = new PictureStats(clock.monotonicMs());
    const wish: Wish = { quality, codec: codec === 'h264' ? 'h264' : 'mpeg1' };
    this.#status = { state: 'connecting', words: '', codecs: [], ...wish, sinceMs: clock.nowMs(), retryAtMs: null };
    this.#link = new VideoLink(wish, {
      clock,
      openSocket: options.openSocket,
      onLink: (state) => {
        if (state.phase !== 'open') this.#says = null;
        this.#linkState = state;
        this.#gate.restart();
        this.#tellStatus();
      },
      onTower: (says) => {
        this.#says = says;
        this.#tellStatus();
      },
      onUnit: (unit, bytes) => {
        this.#stats.came(clock.monotonicMs(), bytes);
        this.#gate.admits(unit);
        this.#link.got(unit.sequence);
      },
      onSkipped: (count) => (this.#stats.skipped += count),
    });
    this.#report();
    this.#link.start();
  }

  want(quality: QualityName, codec: CodecChoice): void {
    this.#link.want({ quality, codec: codec === 'h264' ? 'h264' : 'mpeg1' });
    this.#tellStatus();
  }

  watch(isWatched: boolean): void {
    if (isWatched) this.#link.start();
    else this.#link.stop();
  }

  stop(): void {
    this.#link.stop();
  }

  #tellStatus(): void {
    const { state, words } = this.#situation();
    const before = this.#status;
    this.#status = {
      state,
      words,
      codecs: this.#says?.codecs ?? before.codecs,
      ...this.#link.wish,
      sinceMs: state === before.state ? before.sinceMs : this.#options.clock.nowMs(),
      retryAtMs: this.#linkState.retryAtMs,
    };
    this.#options.tell({ type: 'status', status: this.#status });
  }

  #situation(): { state: VideoState; words: string } {
    const { phase, failures, why } = this.#linkState;
    if (phase === 'open' && this.#says) return this.#says;
    if (phase === 'refused') return { state: 'refused', words: why };
    if (phase === 'stopped') return { state: 'paused', words: '' };
    return { state: failures > 0 ? 'cut-off' : 'connecting', words: '' };
  }

  #report(): void {
    const { clock, tell } = this.#options;
    tell({ type: 'stats', stats: this.#stats.report(clock.monotonicMs(), this.#gate.lost) });
    clock.after(REPORT_MS, () => this.#report());
  }
}
