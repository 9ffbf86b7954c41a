/**
 * Connects the parts: link, gate, decoders, screen, figures. Runs in the worker (player_worker.ts).
 *
 * Draws a picture as soon as it is decoded. If several wait, it decodes all, because each needs the one before it, and
 * draws the newest: a delay never persists.
 */

import type { Clock } from '../link/clock';
import type { SocketLike } from '../link/live';
import type { Done } from './got_cadence';
import type { H264Decoder } from './h264_decoder';
import type { Mpeg1Decoder } from './mpeg1_decoder';
import { PictureStats } from './picture_stats';
import type { Planes, Screen } from './screen';
import { StreamGate } from './stream_gate';
import { TransportStream } from './transport_stream';
import type { Unit } from './unit';
import { VideoLink, type LinkState, type TowerSays, type StreamRequest } from './video_link';
import type { CodecChoice, CodecName, FromPlayer, QualityName, VideoState, VideoStatus } from './video_types';

/** The part of the browser's decoder in use. */
export type FrameDecoder = Pick<H264Decoder, 'decode' | 'close'>;

export interface VideoPlayerOptions {
  readonly clock: Clock;
  readonly quality: QualityName;
  readonly codec: CodecChoice;
  readonly screen: Screen;
  readonly mpeg1: Pick<Mpeg1Decoder, 'decode'>;
  /** Null if the browser has none. */
  readonly openH264:
    | ((
        onPicture: (picture: Planes | VideoFrame, unit: Unit) => void,
        onFault: (words: string) => void,
      ) => FrameDecoder)
    | null;
  readonly openSocket: (request: StreamRequest) => SocketLike;
  readonly emit: (message: FromPlayer) => void;
  /** Calls back after all pending events. */
  readonly afterWaiting: (callback: () => void) => void;
}

const REPORT_MS = 500;
/** After this many H.264 failures of the browser, switches to MPEG-1. */
const H264_FAULTS = 3;

interface Decoded {
  readonly unit: Unit;
  readonly picture: Planes | VideoFrame;
}

export class VideoPlayer {
  readonly #options: VideoPlayerOptions;
  readonly #link: VideoLink;
  readonly #gate = new StreamGate();
  readonly #packets = new TransportStream();
  readonly #h264: FrameDecoder | null;
  readonly #stats: PictureStats;
  /** When the browser began to decode a unit. */
  readonly #begunMs = new WeakMap<Unit, number>();
  #choice: { readonly quality: QualityName; readonly codec: CodecChoice };
  #h264Faults = 0;
  #newest: Decoded | null = null;
  /** The newest unit decoded or not needed that was not yet passed to the link. */
  #done: Done | null = null;
  #isTurnDue = false;
  #isDrawn = false;
  #says: TowerSays | null = null;
  #linkState: LinkState = { phase: 'stopped', failures: 0, retryAtMs: null, why: '' };
  #status: VideoStatus;
  #cancelReport: () => void = () => undefined;

  constructor(options: VideoPlayerOptions) {
    const { clock, quality, codec } = options;
    this.#options = options;
    this.#choice = { quality, codec };
    this.#stats = new PictureStats(clock.monotonicMs());
    this.#h264 =
      options.openH264?.(
        (picture, unit) => this.#frameDecoded(picture, unit),
        () => this.#h264Failed(),
      ) ?? null;
    const request = this.#request([]);
    const { codec: first } = request;
    this.#status = {
      state: 'connecting',
      words: '',
      codecs: [],
      quality,
      codec: first,
      sinceMs: clock.nowMs(),
      retryAtMs: null,
    };
    this.#link = new VideoLink(request, {
      clock,
      openSocket: options.openSocket,
      onLink: (state) => this.#linkChanged(state),
      onTower: (says) => {
        this.#says = says;
        this.#link.want(this.#request(says.codecs));
        this.#reportStatus();
      },
      onUnit: (unit, bytes) => this.#came(unit, bytes),
      onSkipped: (count) => (this.#stats.skipped += count),
    });
    this.#report();
    this.#link.start();
  }

  /** Draws the visible picture once more, for a caller that reads the canvas right after. Returns false without one. */
  drawAgain(): boolean {
    if (this.#isDrawn) this.#options.screen.again();
    return this.#isDrawn;
  }

  want(quality: QualityName, codec: CodecChoice): void {
    this.#choice = { quality, codec };
    this.#link.want(this.#request(this.#says?.codecs ?? this.#status.codecs));
    this.#reportStatus();
  }

  watch(isWatched: boolean): void {
    if (isWatched) this.#link.start();
    else this.#link.stop();
  }

  stop(): void {
    this.#cancelReport();
    this.#link.stop();
    this.#h264?.close();
    this.#keep(null);
  }

  // --- requests ---

  #request(offered: readonly CodecName[]): StreamRequest {
    const { quality, codec } = this.#choice;
    const isAble = this.#h264 !== null && this.#h264Faults < H264_FAULTS;
    const isWanted = codec === 'h264' || (codec === 'auto' && offered.includes('h264'));
    if (isAble && isWanted) return { quality, codec: 'h264' };
    return isAble && codec === 'auto' ? { quality, codec: 'mpeg1', rather: 'h264' } : { quality, codec: 'mpeg1' };
  }

  // --- pictures ---

  #came(unit: Unit, bytes: number): void {
    this.#stats.came(this.#options.clock.monotonicMs(), bytes);
    if (!this.#gate.admits(unit)) this.#isDoneWith(unit);
    else if (unit.codec === 'mpeg1') this.#decodeMpeg1(unit);
    else if (this.#h264) this.#decodeH264(this.#h264, unit);
  }

  #decodeMpeg1(unit: Unit): void {
    const { clock, mpeg1 } = this.#options;
    const beganMs = clock.monotonicMs();
    const planes = mpeg1.decode(this.#packets.pieces(unit.payload));
    this.#isDoneWith(unit);
    if (!planes) {
      this.#gate.shut();
      return;
    }
    this.#stats.decoded(clock.monotonicMs() - beganMs);
    this.#decoded({ unit, picture: planes });
  }

  #decodeH264(decoder: FrameDecoder, unit: Unit): void {
    this.#begunMs.set(unit, this.#options.clock.monotonicMs());
    decoder.decode(unit);
  }

  #frameDecoded(picture: Planes | VideoFrame, unit: Unit): void {
    this.#isDoneWith(unit);
    const nowMs = this.#options.clock.monotonicMs();
    this.#stats.decoded(nowMs - (this.#begunMs.get(unit) ?? nowMs));
    this.#decoded({ unit, picture });
  }

  #h264Failed(): void {
    this.#h264Faults += 1;
    this.#gate.shut();
    this.#link.want(this.#request(this.#says?.codecs ?? []));
    this.#reportStatus();
  }

  #decoded(decoded: Decoded): void {
    this.#keep(decoded);
    this.#takeTurn();
  }

  #isDoneWith(unit: Unit): void {
    const { sequence, captureUs, rateHz } = unit;
    this.#done = { sequence, captureUs, rateHz };
    this.#takeTurn();
  }

  /** Once for all pending units: draws one picture, and reports to the tower once. */
  #takeTurn(): void {
    if (this.#isTurnDue) return;
    this.#isTurnDue = true;
    this.#options.afterWaiting(() => {
      this.#isTurnDue = false;
      if (this.#done !== null) this.#link.got(this.#done);
      this.#done = null;
      this.#draw();
    });
  }

  /** The browser has few frames, so they are released at once. */
  #keep(decoded: Decoded | null): void {
    const before = this.#newest?.picture;
    this.#newest = decoded;
    if (before && 'close' in before) before.close();
  }

  #draw(): void {
    const newest = this.#newest;
    if (!newest) return;
    const { clock, screen } = this.#options;
    const { picture, unit } = newest;
    if ('close' in picture) screen.frame(picture);
    else screen.planes(picture);
    this.#keep(null);
    const isFirst = !this.#isDrawn;
    this.#isDrawn = true;
    const nowMs = clock.monotonicMs();
    const delayMs = unit.captureUs === null ? null : this.#link.clock.ageMs(unit.captureUs, nowMs);
    this.#stats.drawn(nowMs, delayMs, unit.width, unit.height);
    if (isFirst) {
      // The page shows its age, and lets it be saved, from now on.
      this.#cancelReport();
      this.#report();
    }
  }

  // --- state ---

  #linkChanged(state: LinkState): void {
    if (state.phase !== 'open') this.#says = null;
    if (state.phase === 'connecting') {
      this.#gate.restart();
      this.#stats.restart(this.#options.clock.monotonicMs());
    }
    this.#linkState = state;
    this.#reportStatus();
  }

  #reportStatus(): void {
    const { state, words } = this.#situation();
    const { quality, codec } = this.#link.request;
    const before = this.#status;
    this.#status = {
      state,
      words,
      codecs: this.#says?.codecs ?? before.codecs,
      quality,
      codec,
      sinceMs: state === before.state ? before.sinceMs : this.#options.clock.nowMs(),
      retryAtMs: this.#linkState.retryAtMs,
    };
    this.#options.emit({ type: 'status', status: this.#status });
  }

  #situation(): { state: VideoState; words: string } {
    const { phase, failures, why } = this.#linkState;
    if (phase === 'open' && this.#says) return this.#says;
    if (phase === 'refused') return { state: 'refused', words: why };
    if (phase === 'stopped') return { state: 'paused', words: '' };
    return { state: failures > 0 ? 'cut-off' : 'connecting', words: '' };
  }

  #report(): void {
    const { clock, emit } = this.#options;
    emit({ type: 'stats', stats: this.#stats.report(clock.monotonicMs(), this.#gate.lost) });
    this.#cancelReport = clock.after(REPORT_MS, () => this.#report());
  }
}
