// A TCP connection that says what no browser would.
import {randomBytes} from 'node:crypto';
import {connect} from 'node:net';

/** {socket, closed}: `closed` gives all that came, when the other side has ended it. */
export function open(port) {
  const socket = connect(port, '127.0.0.1');
  const parts = [];
  socket.on('data', (data) => parts.push(data));
  socket.on('error', () => {});  // a reset ends it as well
  const closed = new Promise((done) => { socket.on('close', () => done(Buffer.concat(parts))); });
  return {socket, closed};
}

/** Sends `bytes` and gives the answer's first line. */
export async function ask(port, bytes) {
  const {socket, closed} = open(port);
  socket.write(bytes);
  return (await closed).toString('latin1').split('\r\n')[0];
}

export function upgrade(port, {host = `127.0.0.1:${port}`, origin = `http://127.0.0.1:${port}`, target = '/stream'} = {}) {
  return `GET ${target} HTTP/1.1\r\nHost: ${host}\r\n${origin ? `Origin: ${origin}\r\n` : ''}Connection: Upgrade\r\n`
    + `Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ${randomBytes(16).toString('base64')}\r\n\r\n`;
}

/** Opens the stream and waits for its first bytes. */
export async function openStream(port, options) {
  const stream = open(port);
  const first = new Promise((done) => { stream.socket.once('data', done); });
  stream.socket.write(upgrade(port, options));
  stream.answer = (await Promise.race([first, stream.closed])).toString('latin1').split('\r\n')[0];
  return stream;
}
