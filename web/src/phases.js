// Stretches of a run in which balancing runs and in which the same feet carry.
const BRIDGED = 0.1;       // s without a message for which a phase goes on as it was

/** Runs of ticks of the same value, as they come; undefined: no message tells. */
class Stretches {
  #list = [];  // {from, to, value}, to included

  add(tick, value) {
    const last = this.#list.at(-1);
    if (last && last.value === value && last.to === tick - 1) last.to = tick;
    else this.#list.push({from: tick, to: tick, value});
  }

  dropBefore(tick) {
    while (this.#list.length > 0 && this.#list[0].to < tick) this.#list.shift();
    if (this.#list.length > 0) this.#list[0].from = Math.max(this.#list[0].from, tick);
  }

  /** Without the gaps of up to `bridged` ticks, which are as what came before them. */
  list(bridged) {
    const result = [];
    for (const {from, to, value: own} of this.#list) {
      const last = result.at(-1);
      const value = own === undefined && last && to - from < bridged ? last.value : own;
      if (last && last.value === value) last.to = to;
      else result.push({from, to, value});
    }
    return result;
  }
}

/**
 * {balancing, support, missing}, lists of {from, to, value} in seconds: where balancing runs; which feet the controller's
 * model stands on; where no message tells, which the other two leave out.
 */
class Phases {
  #active;
  #contact;
  #balancing;
  #support;
  #next;  // tick

  constructor(run) {
    this.run = run;
    const begin = () => {
      this.#balancing = new Stretches();
      this.#support = new Stretches();
      this.#next = 0;
    };
    run.addEventListener('restart', begin);
    begin();
    this.#active = ['active_x', 'active_y'].map((field) => run.find('balance_torque_t', field)).filter(Boolean);
    this.#contact = run.robot.feet.map((_, f) => run.find('support_plan_t', `in_contact[${f}]`)).filter(Boolean);
  }

  async load() {
    await Promise.all([...this.#active, ...this.#contact].map((s) => s.load()));
    this.update();
    return this;
  }

  /** After the run has grown. */
  update() {
    const {run} = this;
    for (let row = Math.max(0, this.#next - run.firstTick); row < run.numRows; ++row) {
      const tick = run.firstTick + row;
      this.#balancing.add(tick, this.#isBalancing(row));
      this.#support.add(tick, this.#supportOf(row));
      this.#next = tick + 1;
    }
    const at = (tick) => run.timeAt(tick - run.firstTick);  // counted as if each row were a tick
    const seconds = ({from, to, value}) => ({from: at(from), to: at(to + 1), value});
    const list = (stretches) => {
      stretches.dropBefore(run.firstTick);
      return stretches.list(run.rows ? 0 : BRIDGED / run.period).map(seconds);
    };
    const support = this.#contact.length ? list(this.#support) : [];
    this.balancing = list(this.#balancing).filter((p) => p.value);
    this.support = support.filter((p) => p.value !== undefined);
    this.missing = support.filter((p) => p.value === undefined);
  }

  #isBalancing(row) {
    const values = this.#active.map((s) => (s.largest ?? s.values)[row]);  // in any of the row's ticks
    return values.length > 0 && values.every(Number.isNaN) ? undefined : values.some((v) => v > 0);
  }

  #supportOf(row) {
    const values = this.#contact.map((s) => s.values[row]);
    if (values.some(Number.isNaN)) return undefined;
    const on = this.run.robot.feet.filter((_, f) => values[f] > 0).map((foot) => foot.name);
    return on.length === values.length ? 'both feet' : on.length ? `${on.join(', ')} foot` : 'no foot';
  }
}

export const findPhases = (run) => new Phases(run).load();
