// The page of charts: sets of results (docs/reference/charts.md), one or several laid over each other.
import {chartOf, commandOf, layersOf} from './data.js';
import {Chart} from './plot.js';
import {button, element} from '../dom.js';
import {onThemeChange, setPaper} from '../palette.js';
import {formatNumber} from '../units.js';

const FORMAT = 1;
const FEW_CHARTS = 4;  // are not folded away
const MOST_RUNS = 12;  // of one mark, that are listed

const main = document.querySelector('main');
const sets = [];
let charts = [];

/** Adds the data of a file. Throws when `data` is none of a program that this page knows. */
function addSet(data) {
  if (data?.format !== FORMAT || !Array.isArray(data.parts)) throw new Error(`is no charts.json of format ${FORMAT}`);
  sets.push(data);
}

/** What a mark says: under the pointer, and after a click until the next one, with the runs' pages and commands. */
class Tip {
  constructor() {
    this.box = element('div', {id: 'tip', role: 'status', hidden: true});
    document.body.append(this.box);
    this.kept = false;
    document.addEventListener('keydown', (e) => { if (e.key === 'Escape') this.hide(true); });
    document.addEventListener('click', (e) => { if (!e.target.closest('#tip, .chart-host')) this.hide(true); });
    document.addEventListener('scroll', () => this.hide(true), {passive: true});
  }

  show(lines, mark, event, keep) {
    if (this.kept && !keep) return;
    this.kept = keep;
    this.box.classList.toggle('kept', keep);
    this.box.replaceChildren(...lines.map((line) => element('div', {}, line)), ...(keep ? this.#runs(mark) : []));
    this.box.hidden = false;
    const {width, height} = this.box.getBoundingClientRect();
    const below = event.clientY + 18;
    this.box.style.left = `${Math.max(4, Math.min(event.clientX + 14, document.documentElement.clientWidth - width - 4))}px`;
    this.box.style.top = `${below + height > innerHeight ? Math.max(4, event.clientY - height - 12) : below}px`;
  }

  hide(all = false) {
    if (this.kept && !all) return;
    this.kept = false;
    this.box.hidden = true;
  }

  #runs({set, part, rows}) {
    const {folder} = sets[set];
    const runs = rows.slice(0, MOST_RUNS).flatMap((row) => {
      const command = commandOf(part, row);
      const log = row.log && folder !== undefined && (folder ? `${folder}/${row.log}` : row.log);
      return [rows.length > 1 && element('div', {class: 'run'}, `run ${row.run}: ${row.told}`),
        log && element('div', {}, element('a', {href: `${log.split('/').map(encodeURIComponent).join('/')}/report.html`, target: '_blank'}, 'the run’s page'),
          ', which this command writes, given from the page’s folder:'),
        log && copyable(`poise report ${/^[\w./-]+$/.test(log) ? log : `'${log.replaceAll("'", "'\\''")}'`}`),
        command && element('div', {}, 'The command that makes it again:'), command && copyable(command)].filter(Boolean);
    });
    if (rows.length > MOST_RUNS) runs.push(element('div', {}, `and ${rows.length - MOST_RUNS} more`));
    return runs;
  }
}

function copyable(text) {
  const code = element('code', {}, text);
  const copy = button('Copy', null, async () => {
    getSelection().selectAllChildren(code);  // so that it can be copied by hand where the page may not
    const done = await navigator.clipboard.writeText(text).then(() => true, () => document.execCommand('copy'));
    copy.textContent = done ? 'Copied' : 'Selected';
  });
  return element('div', {class: 'command'}, code, copy);
}

const tip = new Tip();

/** Name of a set, another than those of the others. */
function nameOf(i) {
  const {title, folder} = sets[i];
  const alone = sets.every((other, k) => k === i || other.title !== title);
  return alone ? title : `${title} (${folder && folder !== '.' ? folder : i + 1})`;
}

async function openFiles(files) {
  const problems = [];
  for (const file of files) {
    try {
      // The browser does not say where it lies: its runs' pages are not known.
      addSet({...JSON.parse(await file.text()), folder: undefined});
    } catch (error) {
      problems.push(element('p', {class: 'failed', role: 'alert'}, `${file.name}: ${error.message}`));
    }
  }
  render();
  main.prepend(...problems);
}

function header() {
  const input = element('input', {type: 'file', accept: '.json,application/json', multiple: true, hidden: true, change: () => openFiles(input.files)});
  return element('header', {id: 'header'},
    ...sets.map((set, i) => element('div', {class: 'run-head'}, element(i ? 'h2' : 'h1', {}, sets.length > 1 ? nameOf(i) : set.title),
      set.description ? element('span', {class: 'soft'}, set.description) : '',
      sets.length > 1 ? element('button', {type: 'button', 'aria-label': `Take ${nameOf(i)} away`, click: () => {
        sets.splice(i, 1);
        render();
      }}, '×') : '')),
    element('p', {class: 'soft'}, 'Each mark is what was run; nothing is known between two marks. Under the pointer it tells its values; '
      + 'a click keeps them, with the run’s page or the command that makes the run again. A stretch that is drawn over with the pointer is zoomed; a double click shows all.'),
    element('p', {}, button('Lay another charts.json over this…', null, () => input.click()), input));
}

function grid(list) {
  const made = list.map((chart) => new Chart(chart, sets.map((_, i) => nameOf(i)), tip));
  charts.push(...made);
  return element('div', {class: 'charts'}, ...made.map((chart) => chart.element));
}

function sentences(layers) {
  return layers.flatMap(({set, part}) => [sets.length > 1 && part.sentences?.length ? element('p', {class: 'which'}, nameOf(set)) : null,
    ...(part.sentences ?? []).map((text) => element('p', {class: 'edge'}, text))]).filter(Boolean);
}

function section(layers, titled) {
  const {part} = layers[0];
  // Asked for, and what stands; then what the runs measured, folded away where it is much.
  const isFirst = (map) => map.value === undefined || part.kind === 'limit';
  const [first, rest] = [true, false].map((wanted) => part.maps.filter((map) => isFirst(map) === wanted)
    .map((map) => chartOf(layers, map, formatNumber)).filter(Boolean));
  const same = layers.flatMap((layer) => layer.part.same ?? []);
  return element('section', {class: 'part'}, titled && part.title ? element('h2', {}, part.title) : '', ...sentences(layers), grid(first),
    rest.length ? element('details', {open: rest.length <= FEW_CHARTS}, element('summary', {}, `What the runs measured: ${rest.length} chart${rest.length === 1 ? '' : 's'}`), grid(rest)) : '',
    same.length ? element('details', {}, element('summary', {}, 'The same in every run that stands'), ...same.map((text) => element('p', {class: 'soft'}, text))) : '');
}

function render() {
  charts = [];
  tip.hide(true);
  const all = layersOf(sets);
  main.replaceChildren(header(), ...all.map((layers) => section(layers, all.length > 1)),
    ...sets.map((set, i) => (set.text ? element('section', {class: 'table'}, sets.length > 1 ? element('h2', {}, nameOf(i)) : '',
      element('pre', {class: 'scroll'}, set.text)) : '')));
  document.title = sets.map((_, i) => nameOf(i)).join(' | ');
  document.documentElement.dataset.ready = 'true';
  window.poiseCharts = {sets, charts};  // for tests
}

function redraw() { charts.forEach((chart) => chart.redraw()); }

try {
  for (const script of document.querySelectorAll('script.poise-charts')) addSet({folder: '', ...JSON.parse(script.textContent)});
  onThemeChange(redraw);
  const print = (onPaper) => {
    if (onPaper) main.querySelectorAll('details').forEach((details) => { details.open = true; });
    setPaper(onPaper);
    redraw();
  };
  addEventListener('beforeprint', () => print(true));
  addEventListener('afterprint', () => print(false));
  addEventListener('dragover', (e) => e.preventDefault());
  addEventListener('drop', (e) => {
    e.preventDefault();
    openFiles(e.dataTransfer.files);
  });
  if (sets.length > 0) render();
  else main.append(element('p', {role: 'alert'}, 'This page holds no data.'));
} catch (error) {
  console.error(error);
  main.append(element('p', {class: 'failed', role: 'alert'}, `cannot be shown: ${error.message}`));
}
