// JSMpeg's transport for live video: MPEG-TS arrives by HTTP POST, and each piece is sent at once to every WebSocket. It
// has no queues, no key pictures for late joiners, and no limit for a viewer that does not read.
//
//   node relay.js ADDRESS SECRET    prints {"stream": PORT, "viewers": PORT}; ffmpeg posts to http://ADDRESS:PORT/SECRET
'use strict';

const http = require('node:http');
const { WebSocket, WebSocketServer } = require('ws');

const [address, secret] = process.argv.slice(2);

const viewers = new WebSocketServer({ host: address, port: 0, perMessageDeflate: false });
const stream = http.createServer((request, response) => {
  if (request.url.slice(1).split('/')[0] !== secret) {
    response.writeHead(404).end();
    return;
  }
  request.socket.setTimeout(0);
  request.on('data', (piece) => {
    for (const viewer of viewers.clients) {
      if (viewer.readyState === WebSocket.OPEN) viewer.send(piece);
    }
  });
  request.on('end', () => response.end());
});
stream.requestTimeout = 0; // by default Node ends a stream after five minutes

viewers.on('listening', () => {
  stream.listen(0, address, () => {
    console.log(JSON.stringify({ stream: stream.address().port, viewers: viewers.address().port }));
  });
});
