/** The worker that owns the connection and the canvas of one video: a busy page never delays a picture. */

import { realClock } from '../link/clock';
import type { SocketLike } from '../link/live';
import { SUBPROTOCOL, videoUrl } from './video_link';
import { VideoPlayer } from './video_player';
import type { FromPlayer, ToPlayer } from './video_types';

interface Scope {
  onmessage: ((event: { data: ToPlayer }) => void) | null;
  postMessage(message: FromPlayer): void;
}

const scope = globalThis as unknown as Scope;
let player: VideoPlayer | null = null;

scope.onmessage = ({ data }) => {
  if (data.type === 'open') {
    const { page, droneId, quality, codec } = data;
    player = new VideoPlayer({
      clock: realClock,
      quality,
      codec,
      openSocket: (wish) => new WebSocket(videoUrl(page, droneId, wish), [SUBPROTOCOL]) as SocketLike,
      tell: (message) => scope.postMessage(message),
    });
  } else if (data.type === 'want') player?.want(data.quality, data.codec);
  else if (data.type === 'watch') player?.watch(data.isWatched);
  else if (data.type === 'snapshot') scope.postMessage({ type: 'snapshot', key: data.key, picture: null });
  else player?.stop();
};
