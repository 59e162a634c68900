// What becomes of a page's acts when its connection is lost; the feed is a fake.
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {Control} from '../../web/src/live/control.js';

class Feed extends EventTarget {
  open = true;
  got = [];
  state = 'live';

  send(text) {
    if (this.open) this.got.push(JSON.parse(text).do);
    return this.open;
  }

  lose() {
    this.open = false;
    this.state = 'waiting';
    this.dispatchEvent(new Event('state'));
  }

  /** The server's first word after that. */
  greet() {
    this.open = true;
    this.control = {can: ['stop', 'push'], acts: []};
    this.dispatchEvent(new Event('control'));
  }
}

const PUSH = {body: 'trunk', point: [0, 0, 0], force: [1, 0, 0], duration: 0.1};

function lost() {
  const feed = new Feed();
  const control = new Control(feed);
  feed.lose();
  return {feed, control};
}

test('a stop that could not be sent outlives what is asked for after it', () => {
  const {feed, control} = lost();
  control.act('stop');
  control.act('push', PUSH);
  control.act('walk', {velocity: [0, 0, 0]});
  assert.equal(control.unsent.do, 'stop');
  feed.greet();
  assert.deepEqual(feed.got, ['stop']);
  assert.equal(control.unsent, undefined);
});

test('a stop that could not be sent is sent though a drag goes on before the server says a word', () => {
  const {feed, control} = lost();
  control.act('stop');
  feed.open = true;
  control.act('push', PUSH);
  feed.greet();
  assert.deepEqual(feed.got, ['push', 'stop']);
});

test('a stop without an answer is sent again though a push found no connection first', () => {
  const feed = new Feed();
  const control = new Control(feed);
  control.act('stop');
  feed.open = false;
  control.act('push', PUSH);
  feed.lose();
  feed.greet();
  assert.deepEqual(feed.got, ['stop', 'stop']);
});

test('nothing but a stop is sent again, and an answered stop is not', () => {
  const {feed, control} = lost();
  control.act('push', PUSH);
  assert.equal(control.unsent.do, 'push');
  feed.greet();
  assert.deepEqual(feed.got, []);
  control.act('stop');
  assert.equal(control.unsent, undefined);
  const {client, id} = control.waiting[0];
  feed.control = {can: [], acts: [{client, id, do: 'stop', state: 'accepted'}]};
  feed.dispatchEvent(new Event('control'));
  feed.lose();
  feed.greet();
  assert.deepEqual(feed.got, ['stop']);
});
