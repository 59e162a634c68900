// The one time cursor.

export const SPEEDS = [0.1, 0.2, 0.5, 1, 2];

/** Fires 'time' when the cursor moves, 'state' when it starts, stops, follows a live run or changes speed. */
export class Player extends EventTarget {
  time = 0;
  playing = false;
  following = false;  // the end of a live run
  speed = 1;
  #last = 0;

  constructor(run) {
    super();
    this.run = run;
    this.time = run.start;
    run.addEventListener('append', () => this.#grow());
  }

  /** Of the run's values at the cursor. */
  get row() { return this.run.rowAt(this.time); }
  get tick() { return this.run.tickOf(this.row); }

  /** Stays there while a live run goes on. */
  seek(time) {
    this.setFollowing(false);
    this.#move(time);
  }

  setFollowing(on) {
    if (on) {
      this.pause();
      this.#move(this.run.end);
    }
    if (on === this.following) return;
    this.following = on;
    this.dispatchEvent(new Event('state'));
  }

  #grow() {
    if (this.following) this.#move(this.run.end);
    else if (this.time < this.run.start || this.time > this.run.end) this.#move(this.time);  // what was there is gone
  }

  #move(time) {
    this.time = Math.min(this.run.end, Math.max(this.run.start, time));
    this.dispatchEvent(new Event('time'));
  }

  /** By ticks; stops the playing. */
  step(ticks) {
    this.pause();
    this.seek(this.run.timeAt(this.row + ticks));
  }

  play() {
    if (this.playing || this.run.end === this.run.start) return;
    if (this.time >= this.run.end) this.seek(this.run.start);
    this.setFollowing(false);
    this.playing = true;
    this.#last = performance.now();
    requestAnimationFrame((now) => this.#frame(now));
    this.dispatchEvent(new Event('state'));
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.dispatchEvent(new Event('state'));
  }

  toggle() { this.playing ? this.pause() : this.play(); }

  setSpeed(speed) {
    this.speed = speed;
    this.dispatchEvent(new Event('state'));
  }

  /** The next faster (+1) or slower (-1) speed. */
  changeSpeed(direction) {
    const i = SPEEDS.indexOf(this.speed) + direction;
    if (SPEEDS[i]) this.setSpeed(SPEEDS[i]);
  }

  #frame(now) {
    if (!this.playing) return;
    this.seek(this.time + Math.max(0, now - this.#last) / 1000 * this.speed);
    this.#last = now;
    if (this.time >= this.run.end) this.pause();
    else requestAnimationFrame((t) => this.#frame(t));
  }
}
