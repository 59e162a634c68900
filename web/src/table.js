// Checks, assumptions, latencies, channels and the run's information.
import {element, formatNumber, table, withUnit} from './dom.js';
import {latencyFigure, latencyTable} from './latency.js';

const verdict = (check) => check.limit === null ? ''
  : element('span', {class: check.passed ? 'ok' : 'failed'}, check.passed ? 'ok' : 'FAILED');

function checkTable(run, overlay, caption = 'Checks') {
  const other = new Map((overlay?.meta.run.checks ?? []).map((c) => [`${c.name}|${c.label}`, c]));
  return table(caption, ['what', 'measured', ...(overlay ? ['second run'] : []), 'limit', 'paper', 'verdict'],
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

/** All tables below the plots. */
export function tables(run, overlay) {
  const {components} = run.meta.run;
  return [checkTable(run, overlay), assumptionTable(run), latencyFigure(components), latencyTable(components),
    channelTable(run), information(run, 'This run'),
    overlay ? information(overlay, 'The second run') : ''].filter(Boolean);
}

/** Those of a run in progress; `refresh()` brings what the feed has told since. Channels are counted by its report. */
export function liveTables(run, feed) {
  const checks = element('div', {}), latencies = element('div', {});
  return {
    elements: [checks, assumptionTable(run), latencies, information(run, 'This run')].filter(Boolean),
    refresh: () => {
      const {checks: found, components, checked_ticks: ticks, problem} = feed.status;
      run.meta.run.checks = found;
      if (problem) {
        checks.replaceChildren(element('p', {class: 'failed', role: 'status'},
          `checks and events cannot be told: ${problem}`));
        return;
      }
      checks.replaceChildren(...(found.length ? [checkTable(run, undefined,
        `Checks of the first ${formatNumber(ticks * run.period)} s; what they say may change until the run's end`)] : []));
      latencies.replaceChildren(...[latencyFigure(components), latencyTable(components)].filter(Boolean));
    },
  };
}

/** "31 of 31 checks hold" with the failed ones. */
export function verdictBadge(run) {
  const limited = run.meta.run.checks.filter((c) => c.limit !== null);
  const failed = limited.filter((c) => !c.passed);
  return element('a', {href: '#tables', class: `badge ${failed.length ? 'failed' : 'ok'}`,
    title: failed.map((c) => c.label || c.name).join('\n')},
  failed.length ? `${failed.length} of ${limited.length} checks FAILED` : `all ${limited.length} checks hold`);
}
