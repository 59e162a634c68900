// LCM event logs, to make damaged ones.
import {readFileSync, writeFileSync} from 'node:fs';

const MAGIC = 0xEDA1DA01;
const HEADER = 28;

/** [{head, channel, data}]: head is the record's header. */
export function readLog(file) {
  const bytes = readFileSync(file);
  const events = [];
  for (let at = 0; at < bytes.length;) {
    if (bytes.readUInt32BE(at) !== MAGIC) throw new Error(`${file}: no record at ${at}`);
    const channelLength = bytes.readInt32BE(at + 20);
    const dataLength = bytes.readInt32BE(at + 24);
    const data = at + HEADER + channelLength;
    events.push({head: bytes.subarray(at, at + HEADER), channel: bytes.toString('latin1', at + HEADER, data),
      data: Buffer.from(bytes.subarray(data, data + dataLength))});
    at = data + dataLength;
  }
  return events;
}

export function writeLog(file, events) {
  writeFileSync(file, Buffer.concat(events.flatMap(({head, channel, data}) => [head, Buffer.from(channel, 'latin1'), data])));
}
