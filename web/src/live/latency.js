// How long each component took: a histogram on a logarithmic axis, and its counters.
import {element, saveFile, shape, signButton, table} from '../dom.js';
import {pngFile, quoted} from '../export.js';
import {formatNumber} from '../units.js';

const WIDTH = 900, NAMES = 200, RIGHT = 20;  // of the picture, in its own units
const ROW = 46, BARS = 34, AXIS = 34;

const us = (value) => value >= 1000 ? `${formatNumber(value / 1000)} ms` : `${formatNumber(value)} µs`;
const timed = (components) => components.filter((c) => c.latency_us.histogram?.length > 0);

/** Rows component, from (µs), to (µs), count. */
function latencyCsv(components) {
  const rows = timed(components).flatMap(({name, latency_us: {histogram}}) =>
    histogram.map(({from, to, count}) => [quoted(name), from, to, count].join(',')));
  return ['component,from (us),to (us),count', ...rows].join('\r\n') + '\r\n';
}

/** Where the axis, which all components share, begins and ends, and its decades; µs. */
function latencyAxis(components) {
  const bins = components.flatMap((c) => c.latency_us.histogram);
  const from = Math.min(...bins.map((bin) => bin.from)), to = Math.max(...bins.map((bin) => bin.to));
  const decades = [];
  for (let e = Math.ceil(Math.log10(from) - 1e-9); 10 ** e <= to * (1 + 1e-9); ++e) decades.push(10 ** e);
  return {from, to, decades, place: (value) => Math.log(Math.max(value, from) / from) / Math.log(to / from)};
}

function picture(components) {
  const axis = latencyAxis(components);
  const x = (value) => NAMES + (WIDTH - NAMES - RIGHT) * Math.min(1, axis.place(value));
  const height = ROW * components.length + AXIS;
  const text = (content, more) => shape('text', {'font-size': 12, fill: 'var(--ink-soft)', ...more}, content);
  const vertical = (value, y1, y2, more) => shape('line', {x1: x(value), x2: x(value), y1, y2, ...more});
  const row = ({name, latency_us: {median, p99, max, histogram}}, i) => {
    const base = ROW * i + BARS + 6;
    const most = Math.log(1 + Math.max(...histogram.map((bin) => bin.count)));
    const bar = ({from, to, count}) => {
      const tall = BARS * Math.log(1 + count) / most;
      return shape('rect', {x: x(from), width: Math.max(1, x(to) - x(from) - 1), y: base - tall, height: tall,
        fill: 'var(--accent)'}, shape('title', {}, `${us(from)} to ${us(to)}: ${count}`));
    };
    const mark = (value, dash) => vertical(value, base - BARS, base + 3,
      {stroke: 'var(--cursor)', 'stroke-width': 1.5, 'stroke-dasharray': dash});
    return shape('g', {}, text(name, {x: 0, y: base - 10, fill: 'var(--ink)'}),
      ...histogram.filter((bin) => bin.count > 0).map(bar),
      shape('line', {x1: NAMES, x2: WIDTH - RIGHT, y1: base, y2: base, stroke: 'var(--line)'}),
      mark(median, 'none'), mark(p99, '4 3'), mark(max, '1 2'));
  };
  const words = ({name, latency_us: {median, p99, max, histogram}}) => `${name}: median ${us(median)}, `
    + `99 % within ${us(p99)}, largest ${us(max)}, of ${histogram.reduce((sum, bin) => sum + bin.count, 0)}`;
  return shape('svg', {viewBox: `0 0 ${WIDTH} ${height}`, role: 'img', class: 'latencies',
    'aria-label': `Latencies. ${components.map(words).join('; ')}`, 'font-family': 'system-ui, sans-serif'},
  ...axis.decades.flatMap((value) => [vertical(value, 0, height - AXIS, {stroke: 'var(--grid)'}),
    text(us(value), {x: x(value), y: height - AXIS + 16, 'text-anchor': 'middle'})]),
  ...components.map(row));
}

/** Histograms of all components that were timed; '' when none was. */
export function latencyFigure(components) {
  const shown = timed(components);
  if (shown.length === 0) return '';
  const svg = picture(shown);
  const saveCsv = () => saveFile('latency.csv', new Blob([latencyCsv(shown)], {type: 'text/csv'}));
  const savePng = async () => saveFile('latency.png', await pngFile(svg));
  return element('section', {class: 'table'},
    element('header', {class: 'panel-head'},
      element('h2', {}, 'Latency of each stage, from its last input to its outputs sent'),
      element('span', {class: 'panel-buttons'}, signButton('CSV', 'Save the latencies as CSV', saveCsv),
        signButton('PNG', 'Save the latencies as PNG', savePng))),
    svg, element('p', {class: 'note'}, 'Both axes logarithmic: time, and how often. Lines: median, 99th percentile '
      + '(dashed), largest (dotted).'));
}

const COUNTERS = ['ticks', 'received', 'refused', 'duplicates', 'dropped', 'gaps', 'resends', 'publish_errors'];
const REAL_TIME = ['deadline_misses', 'lateness_max_us', 'ticks_skipped', 'restarts'];

/** Latencies in numbers and counters; those of real time where there is any of it. */
export function latencyTable(components) {
  if (components.length === 0) return '';
  const real = components.some((c) => c.scheduling.length > 0 || REAL_TIME.some((key) => c[key] > 0));
  const keys = [...COUNTERS, ...(real ? REAL_TIME : [])];
  const columns = ['component', 'median (µs)', 'p99 (µs)', 'largest (µs)',
    ...keys.map((key) => key.replace(/_us$/, ' (µs)').replaceAll('_', ' ')), ...(real ? ['scheduling'] : [])];
  return table('Components', columns, components.map((c) => [c.name,
    ...[c.latency_us.median, c.latency_us.p99, c.latency_us.max].map((v) => formatNumber(v, 3)),
    ...keys.map((key) => formatNumber(c[key])), ...(real ? [c.scheduling.join(', ') || 'ordinary'] : [])]),
  {numbers: Array.from({length: 3 + keys.length}, (_, i) => i + 1)});
}
