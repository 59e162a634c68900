// A chart in a plot of uPlot's, which has the axes; the marks, the polar grid and the legend are drawn into it.
import uPlot from 'uplot';
import {colorOf, linesOf, rangeOf, ticksTo} from './data.js';
import {svgOf} from './svg.js';
import {element, pngOf, saveNamed} from '../dom.js';
import {cssColor, setPaper, styleOf} from '../palette.js';
import {formatNumber, withUnit} from '../units.js';

const HEIGHT = 340;       // CSS px, of plot and axes
const LEGEND_LINE = 18;
const STRIP = 22;         // above a plot, for what has no value
const NEAR = 14;          // from a mark
const CLICK_SLACK = 4;    // that a click may move
const FEW = 24;           // characters of a text at an axis
const ROTATED = 35;       // degrees
const FONT = '11px system-ui, sans-serif';
const RADIANS = Math.PI / 180;

const cut = (text) => (text.length > FEW ? `${text.slice(0, FEW - 1)}…` : text);
const measure = (() => {
  const context = document.createElement('canvas').getContext('2d');
  return (text) => {
    context.font = FONT;
    return context.measureText(text).width;
  };
})();
const widest = (texts) => Math.max(0, ...texts.map((text) => measure(cut(text))));
const padded = ([low, high]) => (high > low ? [low - 0.05 * (high - low), high + 0.05 * (high - low)] : [low - 1, high + 1]);

/** Outlines of marks, told apart without colour: a set each. */
const SHAPES = [
  (ctx, x, y, r) => ctx.arc(x, y, r, 0, 2 * Math.PI),
  (ctx, x, y, r) => ctx.rect(x - r, y - r, 2 * r, 2 * r),
  polygon([0, -1.4], [1.3, 1], [-1.3, 1]),
  polygon([0, -1.5], [1.5, 0], [0, 1.5], [-1.5, 0]),
];

function polygon(...corners) {
  return (ctx, x, y, r) => corners.forEach(([u, v], i) => ctx[i ? 'lineTo' : 'moveTo'](x + u * r, y + v * r));
}

/** Strokes the path that `trace` makes; `width` and `dash`: canvas px. */
function stroke(ctx, color, width, dash, trace) {
  ctx.setLineDash(dash);
  ctx.beginPath();
  trace();
  ctx.strokeStyle = color;
  ctx.lineWidth = width;
  ctx.stroke();
  ctx.setLineDash([]);
}

const segment = (ctx, from, to) => {
  ctx.moveTo(...from);
  ctx.lineTo(...to);
};

const circle = (ctx, x, y, r) => {
  ctx.arc(x, y, r, 0, 2 * Math.PI);
  ctx.closePath();
};

const drawCross = (ctx, x, y, k, r = 3.5 * k) => stroke(ctx, cssColor('--failed'), 2 * k, [], () => {
  segment(ctx, [x - r, y - r], [x + r, y + r]);
  segment(ctx, [x - r, y + r], [x + r, y - r]);
});

const drawRing = (ctx, x, y, k) =>
  stroke(ctx, cssColor('--ink-soft'), 2 * k, [3 * k, 2 * k], () => circle(ctx, x, y, 4 * k));

const drawPaperLine = (ctx, from, to, y, k) =>
  stroke(ctx, cssColor('--event'), 1.5 * k, [6 * k, 4 * k], () => segment(ctx, [from, y], [to, y]));

/** Draws what says that a mark has no value of the scale, or that some of a cell's runs did not stand. */
function drawState(ctx, mark, x, y, k) {
  if (mark.state === 'untold') drawRing(ctx, x, y, k);
  else if (mark.state === 'fell') drawCross(ctx, x, y, k);
  else if (mark.someFell) drawCross(ctx, x, y, k, 2.5 * k);
}

/** A mark's outline, filled. */
function drawShape(ctx, set, x, y, k, color) {
  ctx.beginPath();
  SHAPES[set % SHAPES.length](ctx, x, y, 3.5 * k);
  ctx.closePath();
  ctx.fillStyle = color;
  ctx.fill();
}

export class Chart {
  /** `sets`: their names; `tip`: {show(lines, mark, event, kept), hide()}. */
  constructor(chart, sets, tip) {
    Object.assign(this, {chart, sets, tip});
    this.spots = [];  // where marks are drawn, canvas px
    this.host = element('div', {class: 'chart-host'});
    const button = (text, action) => element('button', {type: 'button', title: `Save as ${text}`, 'aria-label': `Save ${chart.title} as ${text}`, click: action}, text);
    this.element = element('article', {class: 'panel chart', 'data-kind': chart.kind}, element('header', {}, element('h3', {}, chart.title),
      element('span', {class: 'panel-buttons'}, button('PNG', () => this.save('png')), button('SVG', () => this.save('svg')))), this.host);
    new ResizeObserver(() => this.#fit()).observe(this.host);
  }

  /** Draws when there is room: at first sight, and at each other width. */
  #fit() {
    const width = this.host.clientWidth;
    if (width === 0 || width === this.plot?.width) return;
    if (this.plot) this.plot.setSize({width, height: this.#heightAt(width)});
    else this.#create(width);
  }

  get #many() { return this.sets.length > 1; }
  get #zooms() { return !this.chart.polar && this.chart.kind !== 'cells'; }

  #reset() {
    const {chart} = this;
    const span = (axis, values) => (axis.texts ? [-0.5, axis.texts.length - 0.5] : padded(rangeOf(values)));
    const [low, high] = rangeOf([...chart.marks.map((m) => m.value), chart.paper]);
    const up = high > 0 ? high + 0.05 * (high - Math.min(0, low)) : 0;
    const values = chart.share ? [0, 1] : low === 0 && high === 0 ? [0, 1] : [low < 0 ? low - 0.05 * (Math.max(0, high) - low) : 0, up];
    this.view = {x: span(chart.x, chart.marks.map((m) => m.x)),
      y: chart.kind === 'points' ? values : span(chart.y, chart.marks.map((m) => m.y))};
  }

  #axis(axis, vertical) {
    const {chart} = this;
    const common = {stroke: () => cssColor('--ink-soft'), grid: {show: chart.kind !== 'cells', stroke: () => cssColor('--grid'), width: 1},
      ticks: {stroke: () => cssColor('--grid'), size: 4}, font: FONT, labelFont: FONT, label: axis.label, labelSize: 16, show: !chart.polar};
    if (!axis.texts) {
      return {...common, size: vertical ? 54 : 28, values: (u, splits) => splits.map((v) => formatNumber(Number(v.toPrecision(8)), 6))};
    }
    const room = (u) => (vertical ? u.bbox.height : u.bbox.width) / devicePixelRatio / axis.texts.length;
    const width = widest(axis.texts);
    // Names are all there, aslant where they are long; of numbers as many as have room.
    const rotated = () => !vertical && !axis.numbers && width + 8 > (this.plot?.width ?? this.host.clientWidth) * 0.7 / axis.texts.length;
    const every = (u) => (rotated() ? 1 : Math.ceil((vertical ? 14 : width + 8) / room(u)));
    return {...common, size: () => (vertical ? width + 14 : rotated() ? width * Math.sin(ROTATED * RADIANS) + 24 : 28), rotate: () => (rotated() ? ROTATED : 0),
      splits: () => axis.texts.map((_, i) => i), values: (u, splits) => splits.map((i) => (i % every(u) === 0 ? cut(axis.texts[i] ?? '') : null))};
  }

  #create(width) {
    const {chart} = this;
    this.#reset();
    const strip = chart.kind === 'points' && !chart.polar && chart.marks.some((m) => m.state !== 'value') ? STRIP : 10;
    this.plot = new uPlot({
      width, height: this.#heightAt(width), legend: {show: false},
      padding: [chart.polar ? 0 : strip, 14, (u) => this.#legend(u.width).height, chart.polar ? 14 : 0],
      scales: {x: {time: false, range: () => this.view.x}, y: {range: () => this.view.y}},
      axes: [this.#axis(chart.x, false), this.#axis(chart.y, true)],
      cursor: {x: false, y: false, points: {show: false}, drag: {x: this.#zooms, y: this.#zooms, uni: 20, setScale: false}},
      series: [{}, {show: false}],
      hooks: {draw: [(u) => this.#draw(u)], setSelect: [(u) => this.#select(u)]},
    }, [[0, 1], [0, 1]], this.host);
    this.plot.over.setAttribute('aria-label', chart.title);
    this.plot.over.addEventListener('dblclick', () => {
      this.#reset();
      this.redraw();
    });
    let pressed = [0, 0];
    this.host.addEventListener('pointerdown', (e) => { pressed = [e.clientX, e.clientY]; });
    this.host.addEventListener('pointermove', (e) => this.#point(e, false));
    this.host.addEventListener('pointerleave', () => this.tip.hide());
    this.host.addEventListener('click', (e) => {
      if (Math.hypot(e.clientX - pressed[0], e.clientY - pressed[1]) <= CLICK_SLACK) this.#point(e, true);
    });
  }

  redraw() {
    this.plot?.batch((u) => {
      u.setScale('x', {min: this.view.x[0], max: this.view.x[1]});
      u.setScale('y', {min: this.view.y[0], max: this.view.y[1]});
      u.redraw(false, true);
    });
  }

  #select(u) {
    const {left, top, width, height} = u.select;
    if (width > CLICK_SLACK) this.view.x = [u.posToVal(left, 'x'), u.posToVal(left + width, 'x')];
    if (height > CLICK_SLACK) this.view.y = [u.posToVal(top + height, 'y'), u.posToVal(top, 'y')];
    if (width === 0 && height === 0) return;
    u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
    this.redraw();
  }

  /** The mark at or near a place of the canvas. */
  markAt(x, y) {
    const cell = this.spots.find((spot) => spot.holds?.(x, y));
    if (cell) return cell.mark;
    const near = this.spots.filter((spot) => !spot.holds).map((spot) => [Math.hypot(spot.x - x, spot.y - y), spot])
      .reduce((best, one) => (one[0] < best[0] ? one : best), [NEAR * devicePixelRatio, null]);
    return near[1]?.mark ?? null;
  }

  #point(event, kept) {
    const box = this.plot.ctx.canvas.getBoundingClientRect();
    const zoom = this.plot.ctx.canvas.width / box.width;
    const mark = this.markAt((event.clientX - box.left) * zoom, (event.clientY - box.top) * zoom);
    this.host.classList.toggle('on-mark', mark !== null);
    if (mark) this.tip.show(this.#lines(mark), mark, event, kept);
    else this.tip.hide(kept);
  }

  #lines(mark) {
    const lines = linesOf(mark, this.chart, withUnit);
    return this.#many ? [this.sets[mark.set], ...lines] : lines;
  }

  #color(mark) {
    const {series} = this.chart;
    return styleOf(`hue-${series.findIndex(([set, name]) => set === mark.set && name === mark.series)}`).color();
  }

  // ---- Legend ----

  /** Entries {width, draw(ctx, x, y, k)} in CSS px, around (x, y). */
  #entries() {
    const {chart} = this;
    const text = (ctx, words, x, y) => {
      ctx.fillStyle = cssColor('--ink-soft');
      ctx.textAlign = 'left';
      ctx.textBaseline = 'middle';
      ctx.fillText(words, x, y);
    };
    const entry = (words, sign) => ({width: 34 + measure(words), draw: (ctx, x, y, k) => {
      sign(ctx, x + 8 * k, y, k);
      text(ctx, words, x + 18 * k, y);
    }});
    const plain = (words) => ({width: 16 + measure(words), draw: (ctx, x, y) => text(ctx, words, x, y)});
    const swatch = (words, value) => entry(words, (ctx, x, y, k) => {
      ctx.fillStyle = colorOf(chart, value);
      ctx.fillRect(x - 6 * k, y - 6 * k, 12 * k, 12 * k);
    });
    const some = (state) => chart.marks.some((mark) => mark.state === state);
    const entries = [];
    if (chart.polar) entries.push(plain(`${chart.x.label}; outwards: ${chart.y.label}`));
    if (chart.kind === 'points') {
      chart.series.forEach(([set, name], i) => {
        const words = [this.#many && this.sets[set], name].filter(Boolean).join(': ');
        if (words) entries.push(entry(words, (ctx, x, y, k) => drawShape(ctx, set, x, y, k, styleOf(`hue-${i}`).color())));
      });
    } else {
      if (this.#many && chart.kind === 'cells') entries.push(plain(`in each cell, ${chart.polar ? 'clockwise' : 'left to right'}: ${this.sets.join(' | ')}`));
      else if (this.#many) this.sets.forEach((name, set) => entries.push(entry(name, (ctx, x, y, k) => drawShape(ctx, set, x, y, k, cssColor('--ink-soft')))));
      if (chart.share && chart.marks.every((m) => m.value === undefined || m.value === 0 || m.value === 1)) {
        entries.push(swatch('stands', 1), swatch('does not', 0));
      } else {
        const [low, high] = chart.share ? [0, 1] : chart.range;
        const [from, to] = [formatNumber(low), `${formatNumber(high)}${chart.unit ? ` ${chart.unit}` : ''}`];
        entries.push({width: measure(from) + measure(to) + 148, draw: (ctx, x, y, k) => {
          text(ctx, from, x, y);
          const left = x + (measure(from) + 6) * k;
          for (let i = 0; i < 40; ++i) {
            ctx.fillStyle = colorOf(chart, low + (i + 0.5) / 40 * (high - low));
            ctx.fillRect(left + 3 * i * k, y - 6 * k, 3 * k + 0.5, 12 * k);
          }
          text(ctx, to, left + 126 * k, y);
        }});
      }
    }
    if (chart.paper !== undefined) {
      entries.push(entry('the paper', (ctx, x, y, k) => drawPaperLine(ctx, x - 8 * k, x + 8 * k, y, k)));
    }
    if (some('fell')) entries.push(entry('did not stand', (ctx, x, y, k) => drawCross(ctx, x, y, k)));
    if (chart.kind === 'cells' && chart.marks.some((m) => m.someFell)) entries.push(entry('some did not', (ctx, x, y, k) => drawCross(ctx, x, y, k, 2.5 * k)));
    if (some('untold')) entries.push(entry('does not tell', (ctx, x, y, k) => drawRing(ctx, x, y, k)));
    return entries;
  }

  /** The entries' places in lines of `width` CSS px. */
  #legend(width) {
    if (this.legend?.width === width) return this.legend;
    let x = 8, line = 0;
    const places = this.#entries().map((entry) => {
      if (x > 8 && x + entry.width > width) {
        x = 8;
        ++line;
      }
      const place = {entry, x, line};
      x += entry.width;
      return place;
    });
    this.legend = {width, places, height: places.length ? (line + 1) * LEGEND_LINE + 8 : 0};
    return this.legend;
  }

  #heightAt(width) { return HEIGHT + this.#legend(width).height; }

  // ---- Marks ----

  /** A mark without a value of the scale, or with one. */
  #mark(ctx, mark, x, y, k, color) {
    if (mark.state === 'value') drawShape(ctx, mark.set, x, y, k, color);
    else drawState(ctx, mark, x, y, k);
    this.spots.push({mark, x, y});
  }

  #draw(u) {
    const {ctx, bbox} = u, {chart} = this;
    const k = ctx.canvas.width / u.width;
    ctx.save();
    ctx.font = FONT.replace('11px', `${11 * k}px`);
    this.spots = [];
    if (chart.polar) this.#drawPolar(ctx, bbox, k);
    else if (chart.kind === 'cells') this.#drawCells(u, k);
    else this.#drawPlaces(u, k);
    const {places, height} = this.#legend(u.width);
    const top = ctx.canvas.height - height * k;
    for (const {entry, x, line} of places) entry.draw(ctx, x * k, top + ((line + 0.5) * LEGEND_LINE + 4) * k, k);
    ctx.restore();
  }

  #drawPlaces(u, k) {
    const {ctx, bbox} = u, {chart} = this;
    if (chart.paper !== undefined) drawPaperLine(ctx, bbox.left, bbox.left + bbox.width, u.valToPos(chart.paper, 'y', true), k);
    // The rare ones, which are those of low share, on top.
    const marks = chart.kind === 'places' ? [...chart.marks].sort((a, b) => (b.value ?? Infinity) - (a.value ?? Infinity)) : chart.marks;
    const slack = 1;
    for (const mark of marks) {
      const x = u.valToPos(mark.x, 'x', true);
      const y = mark.y === undefined ? bbox.top - STRIP / 2 * k : u.valToPos(mark.y, 'y', true);
      const inside = x >= bbox.left - slack && x <= bbox.left + bbox.width + slack
        && (mark.y === undefined || (y >= bbox.top - slack && y <= bbox.top + bbox.height + slack));
      if (inside) this.#mark(ctx, mark, x, y, k, chart.kind === 'places' ? colorOf(chart, mark.value) : this.#color(mark));
    }
  }

  #fill(ctx, mark) {
    ctx.fillStyle = mark.state === 'value' ? colorOf(this.chart, mark.value) : cssColor(mark.state === 'fell' ? '--fallen' : '--grid');
    ctx.fill();
  }

  #drawCells(u, k) {
    const {ctx} = u;
    const n = this.sets.length;
    for (const mark of this.chart.marks) {
      const [left, right] = [mark.x - 0.5 + mark.set / n, mark.x - 0.5 + (mark.set + 1) / n].map((v) => u.valToPos(v, 'x', true));
      const [bottom, top] = [mark.y - 0.5, mark.y + 0.5].map((v) => u.valToPos(v, 'y', true));
      ctx.beginPath();
      ctx.rect(left, top, right - left + 0.3, bottom - top + 0.3);
      this.#fill(ctx, mark);
      const [x, y] = [(left + right) / 2, (top + bottom) / 2];
      drawState(ctx, mark, x, y, k);
      this.spots.push({mark, x, y, holds: (px, py) => px >= left && px < right && py >= top && py < bottom});
    }
  }

  // ---- Polar: 0 is up, the world's x, and angles count counter-clockwise, to its y ----

  #drawPolar(ctx, bbox, k) {
    const {chart} = this;
    const size = Math.min(bbox.width, bbox.height) / 2 - 30 * k;
    const center = [bbox.left + bbox.width / 2, bbox.top + bbox.height / 2];
    const place = (degrees, radius) => [center[0] - radius * Math.sin(degrees * RADIANS), center[1] - radius * Math.cos(degrees * RADIANS)];
    const rings = chart.kind === 'cells' ? this.#drawWedges(ctx, center, size, k) : [];
    const most = chart.share ? 1 : Math.max(rangeOf(chart.marks.map((m) => m.value))[1], 1e-12);
    const lines = (trace) => stroke(ctx, cssColor('--grid'), k, [], trace);
    for (const value of chart.kind === 'cells' ? [] : ticksTo(most)) {
      rings.push([value / most * size, formatNumber(value)]);
      lines(() => circle(ctx, ...center, value / most * size));
    }
    ctx.textAlign = 'center';
    ctx.textBaseline = 'middle';
    for (let degrees = 0; degrees < 360; degrees += 45) {
      lines(() => segment(ctx, center, place(degrees, size)));
      ctx.fillStyle = cssColor('--ink-soft');
      ctx.fillText(`${degrees}°`, ...place(degrees, size + 21 * k));
    }
    for (const mark of chart.kind === 'cells' ? [] : chart.marks) {
      if (mark.state !== 'value') {
        this.#mark(ctx, mark, ...place(mark.x, size + 8 * k), k, '');
        continue;
      }
      const at = place(mark.x, Math.max(0, mark.value) / most * size), color = this.#color(mark);
      // Along a direction that was tried, up to what is survived; nothing leads from one direction to the next.
      ctx.globalAlpha = 0.35;
      stroke(ctx, color, k, [], () => segment(ctx, center, at));
      ctx.globalAlpha = 1;
      this.#mark(ctx, mark, ...at, k, color);
    }
    ctx.textAlign = 'left';
    let free = Infinity;
    for (const [radius, text] of rings) {
      const [x, y] = place(0, radius);
      if (y > free) continue;
      free = y - 14 * k;
      ctx.fillStyle = cssColor('--panel');
      ctx.globalAlpha = 0.7;
      ctx.fillRect(x + 2 * k, y - 6 * k, (measure(text) + 4) * k, 12 * k);
      ctx.globalAlpha = 1;
      ctx.fillStyle = cssColor('--ink-soft');
      ctx.fillText(text, x + 4 * k, y);
    }
  }

  /** Cells around the centre, the first of y's texts innermost; gives [radius, text] of each ring. */
  #drawWedges(ctx, center, size, k) {
    const {chart} = this, n = this.sets.length;
    const ring = size / (chart.y.texts.length + 0.5);
    const spreads = this.sets.map((_, set) => {
      const angles = [...new Set(chart.marks.filter((m) => m.set === set).map((m) => m.x))].sort((a, b) => a - b);
      return Math.max(0.1, Math.min(359.9, ...angles.slice(1).map((angle, i) => angle - angles[i])));
    });
    for (const mark of chart.marks) {
      const inner = (mark.y + 0.5) * ring, outer = inner + ring, spread = spreads[mark.set];
      const begin = mark.x + spread / 2 - spread * mark.set / n, end = begin - spread / n;  // clockwise
      const phi = (degrees) => -Math.PI / 2 - degrees * RADIANS;
      ctx.beginPath();
      ctx.arc(...center, outer, phi(begin), phi(end));
      ctx.arc(...center, inner, phi(end), phi(begin), true);
      ctx.closePath();
      this.#fill(ctx, mark);
      const middle = phi((begin + end) / 2), radius = (inner + outer) / 2;
      const [x, y] = [center[0] + radius * Math.cos(middle), center[1] + radius * Math.sin(middle)];
      drawState(ctx, mark, x, y, k);
      this.spots.push({mark, x, y, holds: (px, py) => {
        const r = Math.hypot(px - center[0], py - center[1]);
        const degrees = Math.atan2(center[0] - px, center[1] - py) / RADIANS;
        const behind = (((begin - degrees) % 360) + 360) % 360;
        return r >= inner && r < outer && behind < spread / n;
      }});
    }
    return chart.y.texts.map((text, i) => [(i + 1) * ring, text]);
  }

  // ---- Files ----

  async save(ending) {
    setPaper(true);
    const svg = svgOf(this.plot, this.chart.title, {paper: '#ffffff', ink: cssColor('--ink')});
    setPaper(false);
    this.redraw();
    saveNamed(this.chart.title, ending, ending === 'svg' ? new Blob([svg.text], {type: 'image/svg+xml'})
      : await pngOf(svg.text, svg.width, svg.height, '#ffffff'));
  }
}
