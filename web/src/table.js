// Checks, assumptions, latencies, channels and the run's information.
import {element, formatNumber, withUnit} from './dom.js';

function table(caption, columns, rows, {numbers = []} = {}) {
  return element('section', {class: 'table'}, element('h2', {}, caption),
    element('div', {class: 'scroll'}, element('table', {},
      element('thead', {}, element('tr', {}, ...columns.map((c, i) =>
        element('th', {scope: 'col', class: numbers.includes(i) ? 'number' : null}, c)))),
      element('tbody', {}, ...rows.map((row) => element('tr', {}, ...row.map((cell, i) =>
        element('td', {class: numbers.includes(i) ? 'number' : null}, cell))))))));
}

const verdict = (check) => check.limit === null ? ''
  : element('span', {class: check.passed ? 'ok' : 'failed'}, check.passed ? 'ok' : 'FAILED');

export function checkTable(run, overlay) {
  const other = new Map((overlay?.meta.run.checks ?? []).map((c) => [`${c.name}|${c.label}`, c]));
  return table('Checks', ['what', 'measured', ...(overlay ? ['second run'] : []), 'limit', 'paper', 'verdict'],
    run.meta.run.checks.map((c) => [c.label || c.name, c.measured === null ? 'none' : withUnit(c.measured, c.unit),
      ...(overlay ? [secondValue(other.get(`${c.name}|${c.label}`))] : []), c.limit ?? '', c.paper ?? '', verdict(c)]),
    {numbers: overlay ? [1, 2] : [1]});
}

const secondValue = (check) => !check || check.measured === null ? '–' : withUnit(check.measured, check.unit);

function assumptionTable(run) {
  const {assumptions} = run.meta.run;
  return assumptions.length === 0 ? '' : table('Not given by the paper', ['field', 'value', 'kind', 'reason'],
    assumptions.map((a) => [element('code', {}, a.field), element('code', {}, a.value), a.kind, a.reason]));
}

/** Bars of median, 99th percentile and largest, on one logarithmic scale. */
function latencyTable(run) {
  const {components} = run.meta.run;
  if (components.length === 0) return '';
  const largest = Math.max(1, ...components.map((c) => c.latency_us.max));
  const width = (us) => `${100 * Math.log10(1 + us) / Math.log10(1 + largest)}%`;
  const bar = ({median, p99, max}) => {
    const parts = [['max', max], ['p99', p99], ['median', median]].map(([name, us]) => {
      const part = element('span', {class: `bar ${name}`, title: `${name}: ${formatNumber(us)} µs`});
      part.style.width = width(us);
      return part;
    });
    return element('div', {class: 'bars'}, ...parts);
  };
  const result = table('Latency of each component (last input of a stage to its outputs sent) and its counters',
    ['component', 'median, p99, largest (log scale)', 'median (µs)', 'p99 (µs)', 'largest (µs)', 'ticks', 'received', 'refused',
      'duplicates', 'dropped', 'gaps', 'resends', 'publish errors'],
    components.map((c) => [c.name, bar(c.latency_us),
      ...[c.latency_us.median, c.latency_us.p99, c.latency_us.max].map((v) => formatNumber(v, 3)),
      ...['ticks', 'received', 'refused', 'duplicates', 'dropped', 'gaps', 'resends', 'publish_errors']
        .map((key) => formatNumber(c[key]))]), {numbers: [2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]});
  return result;
}

const channelTable = (run) => table('Channels in the log',
  ['channel', 'messages', 'missing', 'duplicate', 'out of order', 'refused'],
  run.meta.run.channels.map((c) => [element('code', {}, c.name),
    ...['messages', 'missing', 'duplicate', 'out_of_order', 'refused'].map((key) => formatNumber(c[key]))]),
  {numbers: [1, 2, 3, 4, 5]});

function information(run, title) {
  const {run: r} = run.meta;
  const rows = [['scenario', r.scenario], ['description', run.scenario.description ?? ''],
    ['paper section', r.paper_section], ['run id', r.run_id], ['started', r.started_at], ['seed', String(r.seed)],
    ['robot', `${run.robot.name}, ${formatNumber(run.robot.mass)} kg, ${run.robot.joints.length} joints`],
    ['ticks', `${run.meta.live ? '' : `${r.ticks} of `}${formatNumber(1 / r.tick_period)} per second${r.planned_ticks > 0
      ? `, ${r.planned_ticks} planned` : ''}`],
    ['paced by', r.realtime ? 'the wall clock' : 'lockstep'], ['messages dropped on purpose', `${100 * r.drop_rate} %`],
    ['log', r.log], ['places of the log without a record', run.meta.live ? '' : String(r.damages)],
    ...Object.entries(r.versions).map(([name, version]) => [name, version])];
  return element('section', {class: 'table'}, element('h2', {}, title),
    element('div', {class: 'scroll'}, element('table', {}, element('tbody', {}, ...rows.filter(([, v]) => v)
      .map(([name, value]) => element('tr', {}, element('th', {scope: 'row'}, name), element('td', {}, value)))))),
    element('details', {}, element('summary', {}, 'Scenario as it was run, overrides applied'),
      element('pre', {}, run.meta.scenario_text)));
}

/** All tables below the plots; a live run's checks and counters are those of its report. */
export function tables(run, overlay) {
  if (run.meta.live) return [assumptionTable(run), information(run, 'This run')].filter(Boolean);
  return [checkTable(run, overlay), assumptionTable(run), latencyTable(run), channelTable(run),
    information(run, 'This run'), overlay ? information(overlay, 'The second run') : ''].filter(Boolean);
}

/** "31 of 31 checks hold" with the failed ones. */
export function verdictBadge(run) {
  const limited = run.meta.run.checks.filter((c) => c.limit !== null);
  const failed = limited.filter((c) => !c.passed);
  return element('a', {href: '#tables', class: `badge ${failed.length ? 'failed' : 'ok'}`,
    title: failed.map((c) => c.label || c.name).join('\n')},
  failed.length ? `${failed.length} of ${limited.length} checks FAILED` : `all ${limited.length} checks hold`);
}
