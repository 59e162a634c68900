// A plot as a file.
import {pngOf, shape} from './dom.js';
import {changesOf} from './figures.js';
import {cssColor, styleOf} from './palette.js';

const MARGIN = 12, LINE = 18;      // units of the picture, as all below
const WIDTH = 900, HEIGHT = 300;   // of the picture, and of its plot
const AXIS = {left: 66, below: 34};
const SWATCH = 28;

/** RFC 4180. */
export function quoted(text) {
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** Time and every visible line over the stretch shown; empty where there is no number. */
export function csvOf(panel) {
  const {view} = panel.shared;
  const shown = panel.lines.map((line, i) => ({line, i})).filter(({line}) => !panel.hidden.has(line.label));
  const headed = ({label}, unit) => (unit ? `${label} (${unit})` : label);
  const rows = [['time (s)', ...shown.map(({line}) => headed(line, panel.unitOf(line)))].map(quoted).join(',')];
  const times = panel.data[0];
  for (let k = 0; k < times.length; ++k) {
    if (times[k] < view.min - 1e-9 || times[k] > view.max + 1e-9) continue;
    rows.push([Number(times[k].toPrecision(9)), ...shown.map(({i}) => {
      const v = panel.data[i + 1][k];
      return Number.isFinite(v) ? Number(v.toPrecision(8)) : '';
    })].join(','));
  }
  return rows.join('\r\n') + '\r\n';
}

/** [name, where and when it ran, of several which] of each run: "push_double_support, without balancing". */
const runsOf = ({run, others}) => [run, ...others].map(({called, meta: {run: r}}) => [[r.scenario, ...changesOf(r)].join(', '),
  [r.log?.replace(/\/run\.lcm$/, ''), r.started_at].filter(Boolean).join(', '), others.length > 0 ? `${called}: ` : '']);

/** Rows from the first to the last shown, and one more at each side, in stretches of which every one has a number. */
function stretches(times, values, {min, max}, bridged) {
  const result = [[]];
  for (let i = 0; i < times.length; ++i) {
    if (times[i + 1] < min || times[i - 1] > max) continue;
    if (Number.isFinite(values[i])) result.at(-1).push(i);
    else if (!bridged) result.push([]);
  }
  return result.filter((rows) => rows.length > 0);
}

/** "x,y x,y": of the points within half a unit the first, the least, the largest and the last, in order. */
function pointsOf(rows, x, y) {
  const groups = Object.values(Object.groupBy(rows, (row) => Math.round(2 * x(row) + 1e4)));
  return groups.flatMap((group) => {
    const by = [...group].sort((a, b) => y(a) - y(b));
    return [...new Set([group[0], by[0], by.at(-1), group.at(-1)])].sort((a, b) => a - b);
  }).map((row) => `${x(row).toFixed(2)},${y(row).toFixed(2)}`);
}

/** The stretch shown, with a title of run, signal and unit, and a legend that names each run. */
export function svgOf(panel) {
  const {plot, data, definition, shared, lines} = panel;
  const {min, max} = plot.scales.x, {min: low, max: high} = plot.scales.y;
  const box = {x: AXIS.left, y: LINE + 2 * MARGIN, width: WIDTH - AXIS.left - MARGIN, height: HEIGHT};
  const bottom = box.y + HEIGHT, right = box.x + box.width;
  const xAt = (time) => box.x + (time - min) / (max - min) * box.width;
  const yAt = (value) => bottom - (value - low) / (high - low) * HEIGHT;
  const pen = document.createElement('canvas').getContext('2d');
  const text = (content, x, y, more) => shape('text', {x, y, fill: 'var(--ink-soft)', ...more}, content);
  const full = (content, y, font) => {  // as wide as there is room at the most
    pen.font = `${font} system-ui, sans-serif`;
    const room = WIDTH - 2 * MARGIN;
    return text(content, MARGIN, y, {style: `font: ${font} system-ui, sans-serif`, fill: 'var(--ink)',
      ...(pen.measureText(content).width > room && {textLength: room, lengthAdjust: 'spacingAndGlyphs'})});
  };
  const look = ({color, dash}) => ({stroke: color(), 'stroke-dasharray': (dash ?? ['none']).join(' ')});
  const rule = (x1, y1, x2, y2, more) => shape('line', {x1, y1, x2, y2, stroke: 'var(--grid)', ...more});
  const ticks = (axis) => axis._splits.map((at, i) => [at, axis._values[i] ?? '']);  // as uPlot has chosen and written them
  const shown = lines.map((line, i) => ({...line, values: data[i + 1], style: styleOf(line.role, line.overlay)}))
    .filter((line) => !panel.hidden.has(line.label));
  const rows = (line) => stretches(data[0], line.values, {min, max}, line.signal?.channel.sparse);
  const band = (line) => {
    const [most, least] = panel.boundsOf(line.signal);
    const edge = (values, part) => pointsOf(part, (row) => xAt(data[0][row]), (row) => yAt(values[row]));
    return stretches(data[0], most, {min, max}).map((part) => shape('polygon', {points: [...edge(most, part), ...edge(least, part).reverse()].join(' '),
      fill: line.style.color(), 'fill-opacity': 0.3}));
  };
  const curve = (line) => rows(line).flatMap((part) => {
    const points = pointsOf(part, (row) => xAt(data[0][row]), (row) => yAt(line.values[row]));
    const {width, color} = line.style;
    const dot = (point) => {
      const [cx, cy] = point.split(',');
      return shape('circle', {cx, cy, r: 2.5, fill: color()});
    };
    return [shape('polyline', {points: points.join(' '), fill: 'none', 'stroke-width': width, ...look(line.style)}),
      ...(line.signal?.channel.sparse || part.length === 1 ? points.map(dot) : [])];
  });
  const areas = panel.areas().flatMap(([list, color]) => list.filter(({from, to}) => to > min && from < max).map(({from, to}) =>
    shape('rect', {x: xAt(from), y: box.y, width: Math.max(1, xAt(to) - xAt(from)), height: HEIGHT, fill: `var(${color})`})));

  const legend = [], unit = plot.axes[1].label(plot);
  let y = bottom + AXIS.below + LINE;
  runsOf(shared).forEach(([name, where, called], k) => {
    legend.push(full(`${called}${name} (${where})`, y, '12px'));
    let x = WIDTH;
    for (const {label, style} of shown.filter((line) => line.constant === undefined && (line.overlay ?? 0) === k)) {
      const width = SWATCH + pen.measureText(label).width + 2 * MARGIN;
      if (x + width > WIDTH) [x, y] = [MARGIN, y + LINE];
      legend.push(rule(x, y - 4, x + 22, y - 4, {'stroke-width': 2, ...look(style)}), text(label, x + SWATCH, y));
      x += width;
    }
    y += LINE + 4;
  });
  const {figure, title} = definition;
  return shape('svg', {viewBox: `0 0 ${WIDTH} ${y}`, width: WIDTH, height: y, 'font-family': 'system-ui, sans-serif', 'font-size': 12},
    shape('rect', {width: WIDTH, height: y, fill: 'var(--panel)'}), shape('clipPath', {id: 'plot'}, shape('rect', box)),
    full(`${runsOf(shared).map(([name]) => name).join(' and ')}: ${figure ? `Fig. ${figure} ` : ''}${title}${unit ? ` (${unit})` : ''}`, LINE + 4, '600 13px'),
    ...ticks(plot.axes[0]).flatMap(([at, word]) => [rule(xAt(at), box.y, xAt(at), bottom), text(word, xAt(at), bottom + 15, {'text-anchor': 'middle'})]),
    ...ticks(plot.axes[1]).flatMap(([at, word]) => [rule(box.x, yAt(at), right, yAt(at)), text(word, box.x - 6, yAt(at) + 4, {'text-anchor': 'end'})]),
    text('time (s)', (box.x + right) / 2, bottom + 30, {'text-anchor': 'middle'}),
    text(unit, 0, 0, {'text-anchor': 'middle', transform: `translate(16 ${(box.y + bottom) / 2}) rotate(-90)`}),
    shape('g', {'clip-path': 'url(#plot)'}, ...areas, ...shared.events.filter(({time}) => time >= min && time <= max).map(({time}) =>
      rule(xAt(time), box.y, xAt(time), bottom, {stroke: 'var(--event)', 'stroke-dasharray': '2 3'})),
    ...shown.filter((line) => panel.boundsOf(line.signal)).flatMap(band), ...shown.flatMap(curve)), ...legend);
}

/** A picture's text, light or dark as it is now. */
function sourceOf(svg) {
  const [, , width, height] = svg.getAttribute('viewBox').split(' ');
  const sized = svg.cloneNode(true);
  sized.setAttribute('width', width);
  sized.setAttribute('height', height);
  return new XMLSerializer().serializeToString(sized).replace(/var\((--[a-z-]+)\)/g, (_, name) => cssColor(name));
}

export const svgFile = (svg) => new Blob([sourceOf(svg)], {type: 'image/svg+xml'});

export function pngFile(svg) {
  const {width, height} = svg.viewBox.baseVal;
  return pngOf(sourceOf(svg), width, height, cssColor('--panel'));
}
