// The one time cursor.

export const SPEEDS = [0.1, 0.2, 0.5, 1, 2];

/** Fires 'time' when the cursor moves, 'state' when it starts, stops or changes speed. */
export class Player extends EventTarget {
  time = 0;
  playing = false;
  speed = 1;
  #last = 0;

  constructor(run) {
    super();
    this.run = run;
  }

  get tick() { return this.run.tickAt(this.time); }

  seek(time) {
    this.time = Math.min(this.run.duration, Math.max(0, time));
    this.dispatchEvent(new Event('time'));
  }

  /** By ticks; stops the playing. */
  step(ticks) {
    this.pause();
    this.seek((this.tick + ticks) * this.run.period);
  }

  play() {
    if (this.playing || this.run.duration === 0) return;
    if (this.time >= this.run.duration) this.seek(0);
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
    if (this.time >= this.run.duration) this.pause();
    else requestAnimationFrame((t) => this.#frame(t));
  }
}
