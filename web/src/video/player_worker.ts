/** The worker that owns the connection and the canvas of one video: a busy page never delays a picture. */

import { realClock } from '../link/clock';
import type { SocketLike } from '../link/live';
import { H264Decoder, hasH264 } from './h264_decoder';
import { Mpeg1Decoder } from './mpeg1_decoder';
import decoderAddress from 'virtual:mpeg1-decoder';
import { plainScreen } from './plain_screen';
import { SUBPROTOCOL, videoUrl } from './video_link';
import { VideoPlayer } from './video_player';
import type { FromPlayer, ToPlayer, VideoStatus } from './video_types';
import { webglScreen } from './webgl_screen';

interface Scope {
  onmessage: ((event: { data: ToPlayer }) => void) | null;
  postMessage(message: FromPlayer): void;
}

const scope = globalThis as unknown as Scope;
const emit = (message: FromPlayer): void => scope.postMessage(message);

// After events that have already arrived, and before anything on a timer.
const turns: (() => void)[] = [];
const { port1, port2 } = new MessageChannel();
port1.onmessage = () => turns.shift()?.();
const afterWaiting = (callback: () => void): void => {
  turns.push(callback);
  port2.postMessage(null);
};

type Opening = Extract<ToPlayer, { type: 'open' }>;

/** Messages that arrived while the decoder was loading. */
const waiting: ToPlayer[] = [];
let canvas: OffscreenCanvas | null = null;
let player: VideoPlayer | null = null;
let isStopped = false;

async function open({ canvas: given, page, droneId, quality, codec }: Opening): Promise<void> {
  canvas = given;
  const [module, canH264] = await Promise.all([WebAssembly.compileStreaming(fetch(decoderAddress)), hasH264()]);
  const screen = webglScreen(given) ?? plainScreen(given);
  if (!screen) throw new Error('It cannot draw in a worker.');
  if (isStopped) return;
  player = new VideoPlayer({
    clock: realClock,
    quality,
    codec,
    screen,
    mpeg1: new Mpeg1Decoder(module),
    openH264: canH264 ? (onPicture, onFault) => new H264Decoder(onPicture, onFault) : null,
    openSocket: (request) => new WebSocket(videoUrl(page, droneId, request), [SUBPROTOCOL]) as SocketLike,
    emit,
    afterWaiting,
  });
  for (const message of waiting.splice(0)) void reported(message);
}

function cannotPlay({ quality, codec }: Opening, why: unknown): void {
  const words = why instanceof Error ? why.message : String(why);
  const base = { codecs: [], quality, codec: codec === 'h264' ? codec : 'mpeg1', retryAtMs: null } as const;
  const status: VideoStatus = { state: 'unplayable', words, sinceMs: Date.now(), ...base };
  emit({ type: 'status', status });
}

async function reported(message: ToPlayer): Promise<void> {
  if (message.type === 'open') await open(message).catch((error: unknown) => cannotPlay(message, error));
  else if (message.type === 'snapshot') await snapshot(message.key);
  else if (message.type === 'stop') {
    isStopped = true;
    player?.stop();
  } else if (!player) waiting.push(message);
  else if (message.type === 'want') player.want(message.quality, message.codec);
  else player.watch(message.isWatched);
}

async function snapshot(key: number): Promise<void> {
  let picture: Blob | null = null;
  try {
    if (player?.drawAgain() && canvas) picture = await canvas.convertToBlob({ type: 'image/png' });
  } finally {
    emit({ type: 'snapshot', key, picture });
  }
}

scope.onmessage = ({ data }) => void reported(data);
