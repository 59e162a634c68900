// A page that may act: what it sends, and what the receivers have answered. docs/reference/interactive.md says the words.
const REPEAT = 33;        // ms between the pushes of one drag
const HOLD = 0.15;        // s that one push lasts: the hand lets go by itself when its page is gone
const FULL_REACH = 0.4;   // m from the grabbed point to the cursor at which a drag asks for the largest force

/** How an interactive run has ended: as planned, or why. */
export const endText = ({detail}) => (detail ? `ended: ${detail}` : 'ended as planned');

/** Of the robot's answers; fires 'change' when they have, 'answer' with {detail: act} for an act of this page. */
export class Control extends EventTarget {
  /** As the server told it last; undefined: this page only looks. */
  standing;
  /** The last act, if there was no connection to send it by. A stop stays until there is one again, and is sent then. */
  unsent;
  #client = crypto.getRandomValues(new Uint32Array(1))[0];
  #next = 1;
  #waiting = new Map();  // by id: act

  constructor(feed) {
    super();
    this.feed = feed;
    feed.addEventListener('control', () => this.#tell(feed.control));
    // A stop that nobody has answered when the connection is lost may be lost with it.
    feed.addEventListener('state', () => {
      const stop = this.waiting.find((act) => act.do === 'stop');
      if (feed.state === 'waiting' && stop) this.unsent = stop;
    });
  }

  /** What was told before anyone listened: the server tells changes alone. */
  catchUp() { if (this.feed.control) this.#tell(this.feed.control); }

  can(what) { return this.standing?.can?.includes(what) ?? false; }
  setting(field) { return this.standing?.settings?.find((s) => s.field === field); }
  /** Acts of this page that nobody has answered. */
  get waiting() { return [...this.#waiting.values()]; }

  /** Sends an act; its id, or 0 without a connection. It is in force when the receiver says so, not before. */
  act(what, more = {}) {
    const act = {client: this.#client, id: this.#next++, do: what, ...more};
    const sent = this.feed.send(JSON.stringify(act));
    if (what === 'stop' || this.unsent?.do !== 'stop') this.unsent = sent ? undefined : act;
    if (sent && what !== 'push') this.#waiting.set(act.id, act);  // the last push stands for those before it
    this.dispatchEvent(new Event('change'));
    return sent ? act.id : 0;
  }

  #tell(standing) {
    this.standing = standing;
    if (this.unsent?.do === 'stop') this.act('stop');
    for (const act of standing.acts) {
      if (act.client !== this.#client || act.state === 'sent' || !this.#waiting.delete(act.id)) continue;
      this.dispatchEvent(new CustomEvent('answer', {detail: act}));
    }
    const oldest = standing.acts.find((a) => a.client === this.#client)?.id ?? 0;
    for (const id of this.#waiting.keys()) if (id < oldest) this.#waiting.delete(id);  // told of no more
    this.dispatchEvent(new Event('change'));
  }
}

/** N, from `from` to `to` (m, world): in proportion to the distance, and `most` at FULL_REACH and beyond. */
export function springForce(from, to, most) {
  const d = to.map((x, i) => x - from[i]);
  const length = Math.hypot(...d);
  const force = Math.min(1, length / FULL_REACH) * most;
  return length > 1e-6 ? d.map((x) => x / length * force) : [0, 0, 0];
}

/**
 * A hand that holds a point of a body: `pull` again and again while it does. A push lasts HOLD and is renewed every
 * REPEAT ms, at most one unanswered at a time beyond the first few.
 */
export class Hand {
  #timer;
  #force = [0, 0, 0];

  constructor(control) { this.control = control; }

  get holds() { return this.#timer !== undefined; }

  take(body, point) {
    this.letGo();
    Object.assign(this, {body, point});
    this.#timer = setInterval(() => { if (Math.hypot(...this.#force) > 0) this.#push(HOLD); }, REPEAT);
  }

  pull(force) { this.#force = force; }

  letGo() {
    if (!this.holds) return;
    clearInterval(this.#timer);
    this.#timer = undefined;
    this.#force = [0, 0, 0];
    this.#push(0);
  }

  #push(duration) { this.control.act('push', {body: this.body, point: this.point, force: this.#force, duration}); }
}

/** Settings as they were before changes that the receivers took, newest last. */
export class Undo {
  #stack = [];
  #undoing = 0;  // id of the act, or none

  constructor(control) {
    this.control = control;
    this.before = new Map();  // by field, in force
    control.addEventListener('change', () => this.#look());
    control.addEventListener('answer', ({detail: {state, id}}) => {
      if (state === 'refused' && id === this.#undoing) this.#undoing = 0;
    });
  }

  get next() { return this.#stack.at(-1); }

  #look() {
    for (const {field, value} of this.control.standing?.settings ?? []) {
      const before = this.before.get(field);
      this.before.set(field, value);
      if (before === undefined || before === value) continue;
      if (this.next && this.next.field === field && this.next.value === value && this.#undoing > 0) {
        this.#undoing = 0;
        this.#stack.pop();
      } else {
        this.#stack.push({field, value: before});
      }
    }
  }

  undo() {
    if (!this.next || this.#undoing > 0) return;
    this.#undoing = this.control.act('set', this.next);
  }
}
