// A plot as a file.
import {saveFile} from './dom.js';
import {changesOf} from './figures.js';
import {cssColor, styleOf} from './palette.js';

const MARGIN = 12;  // CSS px
const LINE = 18;

/** RFC 4180. */
export function quoted(text) {
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** Time and every visible line over the stretch shown; empty where there is no number. */
export function csvOf(panel) {
  const {view} = panel.shared;
  const shown = panel.lines.map((line, i) => ({line, i})).filter(({line}) => !panel.hidden.has(line.label));
  const headed = (line) => {
    const unit = line.signal?.unit || panel.definition.unit;
    return unit ? `${line.label} (${unit})` : line.label;
  };
  const rows = [['time (s)', ...shown.map(({line}) => headed(line))].map(quoted).join(',')];
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

/** "push_double_support, without balancing: fall, 2026-11-24T14:22:14Z", a line for each run. */
function captions({run, overlay}) {
  return [run, overlay].filter(Boolean).map(({meta: {run: r}}, i) => `${overlay ? `${['first', 'second'][i]} run: ` : ''}`
    + `${[r.scenario, ...changesOf(r)].join(', ')} (${[r.log?.replace(/\/run\.lcm$/, ''), r.started_at].filter(Boolean).join(', ')})`);
}

/** The plot with its title, its legend and the names of its runs. */
export function pngOf(panel) {
  const source = panel.plot.ctx.canvas;
  const scale = source.width / panel.plot.width;
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('2d');
  const {figure, title} = panel.definition;
  const entries = panel.lines.filter((line) => !panel.hidden.has(line.label) && line.constant === undefined);
  context.font = '12px system-ui, sans-serif';
  const width = panel.plot.width;
  let x = MARGIN, rows = 1;
  const places = entries.map((line) => {
    const size = 30 + context.measureText(line.label).width + 16;
    if (x + size > width && x > MARGIN) {
      x = MARGIN;
      ++rows;
    }
    const at = {x, row: rows};
    x += size;
    return at;
  });
  const top = LINE + MARGIN, names = captions(panel.shared);
  canvas.width = source.width;
  canvas.height = Math.round((top + panel.plot.height + LINE * (rows + names.length) + MARGIN) * scale);
  context.scale(scale, scale);
  context.fillStyle = cssColor('--panel');
  context.fillRect(0, 0, width, canvas.height);
  context.fillStyle = cssColor('--ink');
  context.font = '600 13px system-ui, sans-serif';
  context.fillText((figure ? `Fig. ${figure}  ` : '') + title, MARGIN, LINE, width - 2 * MARGIN);
  context.drawImage(source, 0, top, width, panel.plot.height);
  context.font = '12px system-ui, sans-serif';
  entries.forEach((line, i) => {
    const style = styleOf(line.role, line.overlay);
    const y = top + panel.plot.height + LINE * places[i].row - 4;
    context.strokeStyle = style.color();
    context.lineWidth = 2;
    context.setLineDash(style.dash ?? []);
    context.beginPath();
    context.moveTo(places[i].x, y - 4);
    context.lineTo(places[i].x + 22, y - 4);
    context.stroke();
    context.fillText(line.label, places[i].x + 28, y);
  });
  context.fillStyle = cssColor('--ink-soft');
  names.forEach((name, i) => context.fillText(name, MARGIN, top + panel.plot.height + LINE * (rows + 1 + i) - 4, width - 2 * MARGIN));
  return new Promise((done, failed) => canvas.toBlob((blob) => blob ? done(blob)
    : failed(new Error('the browser cannot write this plot as PNG')), 'image/png'));
}

export function savePanel(panel, ending, blob) {
  const {figure, title} = panel.definition;
  const name = `${panel.shared.run.meta.run.scenario} ${figure ? `fig ${figure} ` : ''}${title}`.toLowerCase().normalize('NFKD')
    .replace(/[^a-z0-9]+/g, '-').replace(/^-|-$/g, '').slice(0, 80);
  saveFile(`${name || 'plot'}.${ending}`, blob);
}
