// Plots over time: one zoom and one time cursor for all of them.
import uPlot from 'uplot';
import {element, saveNamed, shape, signButton} from './dom.js';
import {csvOf, pngFile, svgFile, svgOf} from './export.js';
import {findSignal} from './figures.js';
import {cssColor, onThemeChange, styleOf} from './palette.js';
import {formatNumber, leastSpan, limitedEnd, paddedRange, quantity, scaled} from './units.js';

const HEIGHT = 200;       // px
const CLICK_SLACK = 4;    // px that a click may move
const ZOOM_STEP = 1.25;
const SHADE = '4d';       // how opaque a line's colour, #rrggbb, is between its bounds, 30 %

/** The stretch of time that all plots show. Fires 'change', and 'away' when the run's end was put out of sight. */
export class TimeView extends EventTarget {
  #span = Infinity;  // s, that is asked for

  constructor(run) {
    super();
    this.run = run;
    this.reset();
  }
  get end() { return Math.max(this.run.end, this.run.start + this.run.period); }
  reset() {
    this.#span = Infinity;
    this.#show(this.run.start, this.end);
  }
  set(min, max) {
    this.#span = max - min;
    this.#show(min, max);
    if (this.max < this.end) this.dispatchEvent(new Event('away'));
  }
  /** The last `span` seconds. */
  setLast(span) {
    this.#span = span;
    this.#show(this.end - span, this.end);
  }
  /** After the run has grown: all of it again, its last stretch of the same length, or what was shown. */
  grow(following) {
    if (this.#span === Infinity) this.reset();
    else if (following) this.setLast(this.#span);
    else this.#show(this.min, this.max);
  }
  #show(min, max) {
    const least = 4 * this.run.period;
    this.min = Math.max(this.run.start, Math.min(min, this.end - least));
    this.max = Math.min(this.end, Math.max(max, this.min + least));
    this.dispatchEvent(new Event('change'));
  }
  /** Keeps `time` where it is. */
  zoom(factor, time) { this.set(time - (time - this.min) * factor, time + (this.max - time) * factor); }
}

/** Numbers of the rows [from, n) as uPlot wants them: null where there is none. */
function nullable(values, n, from = 0) {
  const result = new Array(n - from);
  for (let i = from; i < n; ++i) result[i - from] = Number.isFinite(values[i]) ? values[i] : null;
  return result;
}

/** Seconds of every row, one array for all plots. */
function timesOf(run) {
  const held = times.get(run);
  if (held?.length !== run.numRows || held[0] !== run.start) {
    times.set(run, Float64Array.from({length: run.numRows}, (_, i) => run.timeAt(i)));
  }
  return times.get(run);
}
const times = new WeakMap();

/** The other run's values at the first run's ticks. */
function resampled(values, run, other) {
  return Array.from({length: run.numRows}, (_, i) => {
    const v = values[other.rowOf(run.timeAt(i))];
    return Number.isFinite(v) ? v : null;
  });
}

/** Whether a line of another run is the first one's of the same series, `lines` being those before it. */
function sameValues({signal, run: other, series}, lines, run) {
  const first = lines.find((line) => line.series === series).signal.values;
  return resampled(signal.values, run, other).every((value, row) => value === null || Number.isNaN(first[row]) || value === first[row]);
}

/** The last number in a few rows: what a channel with few messages said last. */
function lastNumber(values, row) {
  for (let i = row; i >= 0; --i) if (!Number.isNaN(values[i])) return values[i];
  return NaN;
}

/** One plot. `definition` as figures.js gives it; `shared`: {run, others, player, view, phases, events}. */
class Panel {
  constructor(definition, shared, onRemove) {
    Object.assign(this, {definition, shared});
    this.hidden = new Set();
    this.host = element('div', {class: 'plot-host'});
    this.legend = element('div', {class: 'legend'});
    this.cursor = element('div', {class: 'time-cursor'});
    this.element = element('article', {class: 'panel'},
      element('header', {},
        definition.figure ? element('span', {class: 'figure-number'}, `Fig. ${definition.figure}`) : '',
        element('h3', {}, definition.title),
        element('span', {class: 'panel-buttons'},
          signButton('CSV', 'Save the stretch shown as CSV', async () => this.#save('csv', await this.csv())),
          signButton('PNG', 'Save as PNG', async () => this.#save('png', await pngFile(await this.svg()))),
          signButton('SVG', 'Save as SVG', async () => this.#save('svg', svgFile(await this.svg()))),
          onRemove ? signButton('×', 'Remove this plot', () => onRemove(this)) : '')),
      this.host, this.legend, definition.note ? element('p', {class: 'note'}, definition.note) : '');
  }

  /** Loads the signals and draws; once. */
  show() {
    return this.building ??= this.#build();
  }

  /** Shows the plot and then calls `then`; where that fails, the plot's place says why. */
  draw(then) {
    return this.show().then(then).catch((error) => {
      console.error(error);
      this.host.replaceChildren(element('p', {class: 'failed', role: 'alert'}, `cannot be drawn: ${error.message}`));
    });
  }

  async #build() {
    await this.#load();
    this.#create();
    new ResizeObserver(() => this.resize()).observe(this.host);
    this.updateCursor();
  }

  async #load() {
    const {run, others} = this.shared;
    const {definition} = this;
    const lines = definition.series.map((s) => ({...s, series: s, run, signal: s.signal ?? findSignal(run, s)}));
    for (const limit of definition.limits ?? []) lines.push({label: 'limit', role: 'limit', constant: limit});
    for (const other of others) {
      for (const s of definition.series) {
        const signal = findSignal(other, {...s, name: s.name ?? undefined});
        if (signal) lines.push({...s, series: s, signal, run: other, label: `${s.label} (${other.called})`, overlay: other.index});
      }
    }
    await Promise.all(lines.map((line) => line.signal?.load()));
    // The other runs' limits where they differ from the first one's.
    this.lines = lines.filter((line, k) => !(line.overlay && line.role === 'limit' && sameValues(line, lines.slice(0, k), run)));
  }

  /** The lines' values of the rows from `from` on, and after them the bounds of those that have some. */
  #columns(from = 0) {
    const {run} = this.shared;
    return [...this.lines.map((line) => line.constant !== undefined ? new Array(run.numRows - from).fill(line.constant)
      : line.overlay ? resampled(line.signal.values, run, line.run)
        : nullable(line.signal.values, run.numRows, from)),
    ...this.#bounded().flatMap(({signal}) => [nullable(signal.largest, run.numRows), nullable(signal.least, run.numRows)])];
  }

  /** Lines whose rows have a least and a largest value. */
  #bounded() { return this.lines.filter((line) => line.signal?.least && !line.overlay); }

  /** The columns of the largest and the least values of a signal's rows; undefined: it has none. */
  boundsOf(signal) {
    const k = this.#bounded().findIndex((line) => line.signal === signal);
    return k < 0 ? undefined : this.data.slice(this.lines.length + 1 + 2 * k).slice(0, 2);
  }

  #readAll() {
    this.firstTick = this.shared.run.firstTick;
    this.restarts = this.shared.run.restarts;
    this.data = [timesOf(this.shared.run), ...this.#columns()];
  }

  /** Brings the plot to what the run holds. */
  #grow() {
    const {run, others} = this.shared;
    const dropped = run.firstTick - this.firstTick;
    const held = this.data[0].length - dropped;
    const restarted = run.restarts !== this.restarts;  // the ticks that it holds are others
    if (!restarted && dropped === 0 && held === run.numRows) return;
    if (restarted || held <= 0 || others.length > 0) {
      this.#readAll();
    } else {
      const columns = this.data.slice(1);
      this.#columns(held).forEach((more, i) => {
        columns[i].splice(0, dropped);
        for (const value of more) columns[i].push(value);
      });
      this.data = [timesOf(run), ...columns];
      this.firstTick = run.firstTick;
    }
    this.plot.setData(this.data);
  }

  #create() {
    const {view} = this.shared;
    const axis = (more) => ({
      stroke: () => cssColor('--ink-soft'), grid: {stroke: () => cssColor('--grid'), width: 1},
      ticks: {stroke: () => cssColor('--grid'), size: 4}, font: '11px system-ui, sans-serif',
      labelFont: '11px system-ui, sans-serif', ...more});
    const {unit} = this.definition;
    const least = this.definition.added ? 0 : leastSpan(unit);
    const shown = (u) => scaled(Math.max(Math.abs(u.scales.y.min), Math.abs(u.scales.y.max)), unit);
    const limit = this.definition.upToLimits ? this.lines.findIndex((line) => line.role === 'limit') : -1;
    const end = (high) => limit < 0 || high === null ? high ?? NaN : limitedEnd(high, this.data[limit + 1]);
    this.#readAll();
    this.plot = new uPlot({
      width: Math.max(120, this.host.clientWidth), height: HEIGHT, legend: {show: false},
      scales: {x: {time: false, range: () => [view.min, view.max]}, y: {range: (_, low, high) => paddedRange(Math.min(low, end(high)), end(high), least)}},
      axes: [axis({label: 'time (s)', labelSize: 16, size: 26}),
        axis({label: (u) => shown(u).unit, labelSize: 16, size: 62,
          values: (u, splits) => splits.map((v) => formatNumber(Number((v * shown(u).factor).toPrecision(8)), 6))})],
      cursor: {drag: {x: true, y: false, setScale: false}, points: {size: 5}, sync: {key: 'poise', setSeries: false}},
      series: [{}, ...this.lines.map((line) => {
        const style = styleOf(line.role, line.overlay);
        const sparse = line.signal?.channel.sparse === true;  // a few messages a second: each one is shown
        return {label: line.label, stroke: style.color, dash: style.dash, width: style.width,
          points: {show: sparse, size: 5}, spanGaps: sparse, show: !this.hidden.has(line.label)};
      }), ...this.#bounded().flatMap((line) => [0, 1].map(() => ({label: line.label, stroke: 'transparent', width: 0,
        points: {show: false}, show: !this.hidden.has(line.label)})))],
      bands: this.#bounded().map((line, k) => {
        const {color} = styleOf(line.role);
        const first = this.lines.length + 1 + 2 * k;
        return {series: [first, first + 1], fill: () => color() + SHADE};
      }),
      hooks: {
        drawClear: [(u) => this.#shade(u)],
        draw: [() => this.updateCursor()],  // by the scales as they are drawn
        setSelect: [(u) => {
          if (u.select.width > CLICK_SLACK) {
            view.set(u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x'));
          }
          u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
        }],
        setCursor: [(u) => this.updateValues(u.cursor.idx ?? null)],
      },
    }, this.data, this.host);
    const over = this.plot.over;
    over.append(this.cursor);
    let pressed = 0;
    over.addEventListener('pointerdown', (e) => { pressed = e.offsetX; });
    over.addEventListener('click', (e) => {
      if (Math.abs(e.offsetX - pressed) <= CLICK_SLACK) this.shared.player.seek(this.plot.posToVal(e.offsetX, 'x'));
    });
    over.addEventListener('dblclick', () => view.reset());
    over.addEventListener('wheel', (e) => {
      if (!e.ctrlKey && !e.shiftKey) return;  // the page scrolls
      e.preventDefault();
      view.zoom((e.deltaY || e.deltaX) > 0 ? ZOOM_STEP : 1 / ZOOM_STEP, this.plot.posToVal(e.offsetX, 'x'));
    }, {passive: false});
    this.#fillLegend();
  }

  #fillLegend() {
    this.values = this.lines.map(() => element('span', {class: 'value'}));
    const seen = new Set();
    this.legend.replaceChildren(...this.lines.map((line, i) => {
      if (line.constant !== undefined && seen.has('limit')) return '';
      if (line.constant !== undefined) seen.add('limit');
      const style = styleOf(line.role, line.overlay);
      const swatch = shape('svg', {class: 'swatch', viewBox: '0 0 26 2', width: 26, height: 2}, shape('line', {x1: 0, x2: 26, y1: 1, y2: 1,
        stroke: style.color(), 'stroke-width': 2, 'stroke-dasharray': (style.dash ?? []).join(' ')}));
      return element('button', {type: 'button', class: 'entry', title: line.signal?.title ?? 'limit', value: line.label,
        'aria-pressed': String(!this.hidden.has(line.label)), click: () => {
          const others = [...this.hidden].filter((label) => label !== line.label);
          this.hide(this.hidden.has(line.label) ? others : [...others, line.label]);
        }}, swatch, line.label, this.values[i]);
    }).filter(Boolean));
    this.updateValues(null);
  }

  /** Hides the lines of these labels, and shows the others. */
  hide(labels) {
    this.hidden = new Set(labels);
    for (const entry of this.legend.children) entry.setAttribute('aria-pressed', String(!this.hidden.has(entry.value)));
    this.plot?.series.forEach((line, k) => {
      const show = !this.hidden.has(line.label);
      if (k > 0 && line.show !== show) this.plot.setSeries(k, {show});
    });
  }

  /** Values in the row under the pointer, else at the time cursor: the signals', which a plot that has still to grow lacks. */
  updateValues(index = this.plot?.cursor.idx ?? null) {
    if (!this.values) return;
    const {run, player} = this.shared;
    const at = index === null ? player.row : this.firstTick + index - run.firstTick;
    this.lines.forEach((line, i) => {
      if (line.constant !== undefined) return;
      const {values, valueNames, integer, channel} = line.signal;
      const row = line.run.rowOf(run.timeAt(at));
      const value = channel.sparse ? lastNumber(values, row) : values[row] ?? NaN;
      const name = integer ? valueNames?.[value] : undefined;
      this.values[i].textContent = name !== undefined ? `${value} ${name}`
        : quantity(value, this.unitOf(line), 4, !this.definition.added);
    });
  }

  unitOf(line) { return line.signal?.unit || this.definition.unit; }

  /** [stretches of time, the name of their colour]: what lies beneath the lines. */
  areas() {
    const {support, balancing, missing} = this.shared.phases;
    return [[support.filter((p) => p.value !== 'both feet'), '--single-support'], [balancing, '--balancing'], [missing, '--missing']];
  }

  #shade(u) {
    const {ctx, bbox} = u;
    const {events} = this.shared;
    const {min, max} = u.scales.x;
    ctx.save();
    const x = (time) => Math.min(bbox.left + bbox.width, Math.max(bbox.left, u.valToPos(time, 'x', true)));
    for (const [list, color] of this.areas()) {
      ctx.fillStyle = cssColor(color);
      for (const {from, to} of list) {
        if (to > min && from < max) {
          ctx.fillRect(x(from), bbox.top, Math.max(1, x(to) - x(from)), bbox.height);
        }
      }
    }
    ctx.strokeStyle = cssColor('--event');
    ctx.lineWidth = 1;
    ctx.setLineDash([2, 3]);
    for (const {time} of events) {
      if (time >= min && time <= max) ctx.stroke(new Path2D(`M${x(time)} ${bbox.top}v${bbox.height}`));
    }
    ctx.restore();
  }

  updateCursor() {
    if (!this.plot) return;
    const {time} = this.shared.player;
    const {min, max} = this.plot.scales.x;
    this.cursor.hidden = !(time >= min && time <= max);
    if (this.cursor.hidden) return;
    this.cursor.style.transform = `translateX(${this.plot.valToPos(time, 'x')}px)`;
  }

  /** After a zoom, or when the run has grown. */
  redraw() {
    if (!this.plot) return;
    this.#grow();
    this.plot.setScale('x', {min: this.shared.view.min, max: this.shared.view.max});
  }

  /** After a change of theme. */
  restyle() {
    if (!this.plot) return;
    this.plot.redraw(false, true);
    this.#fillLegend();
  }

  /** To `width`, px; default: that of its place. */
  resize(width = this.host.clientWidth) {
    if (this.plot && width > 0) this.plot.setSize({width, height: HEIGHT});
  }

  /** A further line. A plot that is being built is built first; one that is not yet will have it. */
  addLine(line) {
    this.definition.series.push(line);
    if (!this.building) return;
    this.building = this.building.then(async () => {
      await this.#load();
      this.plot.destroy();
      this.#create();
      this.updateCursor();
    });
    this.draw();
  }

  async csv() {
    await this.show();
    this.redraw();
    return new Blob([csvOf(this)], {type: 'text/csv'});
  }

  /** The plot as it is now, to be saved. */
  async svg() {
    await this.show();
    this.redraw();
    await null;  // uPlot chooses its axes' numbers
    return svgOf(this);
  }

  #save(ending, blob) {
    const {figure, title} = this.definition;
    saveNamed(`${this.shared.run.meta.run.scenario} ${figure ? `fig ${figure} ` : ''}${title}`, ending, blob);
  }
}

/** All plots; builds those that come into sight and moves only those. */
export class PanelGrid {
  constructor(host, shared) {
    Object.assign(this, {host, shared});
    this.panels = [];
    this.inSight = new Set();
    this.observer = new IntersectionObserver((entries) => {
      for (const {target, isIntersecting} of entries) {
        const panel = this.panels.find((p) => p.element === target);
        if (!isIntersecting) this.inSight.delete(panel);
        else if (panel) this.#enter(panel);
      }
    }, {rootMargin: '150px'});
    shared.view.addEventListener('change', () => {
      this.inSight.forEach((p) => p.redraw());
      this.panels.forEach((p) => { p.stale = !this.inSight.has(p); });
    });
    shared.player.addEventListener('time', () => {
      // At a live run's end the plots come with the cursor, in their own time.
      if (!shared.player.following) this.inSight.forEach((p) => p.updateCursor());
    });
    onThemeChange(() => this.restyle());
  }

  #enter(panel) {
    this.inSight.add(panel);
    panel.draw(() => {
      if (panel.stale) panel.redraw();
      panel.stale = false;
      panel.updateCursor();
      panel.updateValues();
    });
  }

  updateValues() { this.inSight.forEach((p) => p.updateValues()); }
  restyle() { this.panels.forEach((p) => p.restyle()); }

  /** Those out of sight, too. */
  redrawAll() {
    for (const panel of this.panels) {
      panel.redraw();
      panel.updateValues();
      panel.stale = false;
    }
  }

  /** After the events have changed. */
  redraw() { this.inSight.forEach((p) => p.redraw()); }

  /** At the end, or first when it was asked for. */
  add(definition, first = false) {
    const panel = new Panel(definition, this.shared, definition.added ? (p) => this.remove(p) : null);
    this.panels.push(panel);
    this.host[first ? 'prepend' : 'append'](panel.element);
    this.observer.observe(panel.element);
    return panel;
  }

  remove(panel) {
    this.observer.unobserve(panel.element);
    this.inSight.delete(panel);
    this.panels.splice(this.panels.indexOf(panel), 1);
    panel.plot?.destroy();
    panel.element.remove();
  }
}
