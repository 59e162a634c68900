// Checks, assumptions, latencies, channels and the run's information.
import {element, table} from './dom.js';
import {endText} from './live/control.js';
import {latencyFigure, latencyTable} from './live/latency.js';
import {formatNumber, withUnit} from './units.js';

/** Of a check without a limit none; passed is null until the run has ended. */
function verdict(check) {
  if (check.limit === null) return '';
  const [kind, text] = isUnknown(check) ? ['soft', unknownText(check)] : check.passed === null ? ['soft', 'pending']
    : check.passed ? ['ok', 'ok'] : ['failed', 'FAILED'];
  return element('span', {class: kind}, text);
}

/** Whether nobody can say if it holds, for want of what `missing` lists. */
const isUnknown = ({missing}) => missing?.length > 0;
const unknownText = ({missing}) => `not known: needs ${missing.join(' and ')}`;

/** "the part from 1.2 s to 3.4 s of a run", or '' of a whole one. */
function partOf(run) {
  const {cut} = run.meta.run;
  const seconds = (tick) => `${formatNumber(run.timeOfTick(tick), 6)} s`;
  return cut ? `part of a run: ${seconds(cut.first_tick)} to ${seconds(cut.last_tick + 1)}` : '';
}

function checkTable(run, others, caption = partOf(run) ? `Checks of this part of the run (${partOf(run)})` : 'Checks') {
  const pending = run.meta.run.checks.some((c) => c.passed === null && !isUnknown(c));
  const same = (other, {name, label}) => other.meta.run.checks.find((c) => c.name === name && c.label === label);
  const measured = (c) => isUnknown(c) ? 'not known' : c.measured !== null ? withUnit(c.measured, c.unit) : pending ? 'none yet' : 'none';
  return table(caption, ['what', pending ? 'so far' : 'measured', ...others.map((other) => other.called), 'limit', 'paper', 'verdict'],
    run.meta.run.checks.map((c) => [c.label || c.name, measured(c),
      ...others.map((other) => otherValue(same(other, c))), c.limit ?? '', c.paper ?? '', verdict(c)]),
    {numbers: [run, ...others].map((_, k) => k + 1)});
}

const otherValue = (check) => !check || check.measured === null ? '–' : withUnit(check.measured, check.unit);

function assumptionTable(run) {
  const {assumptions} = run.meta.run;
  return assumptions.length === 0 ? '' : table('Not given by the paper', ['field', 'value', 'kind', 'reason'],
    assumptions.map((a) => [element('code', {}, a.field), element('code', {}, a.value), a.kind, a.reason]));
}

const COUNTS = ['messages', 'missing', 'duplicate', 'out_of_order', 'refused'];

const channelTable = (run) => table('Channels in the log',
  ['channel', ...COUNTS.map((key) => key.replaceAll('_', ' '))],
  run.meta.run.channels.map((c) => [element('code', {}, c.name), ...COUNTS.map((key) => formatNumber(c[key]))]),
  {numbers: [1, 2, 3, 4, 5]});

function ticksOf(run) {
  const {run: r, live} = run.meta;
  const rate = `${formatNumber(1 / r.tick_period)} per second`;
  const planned = r.planned_ticks > 0 ? `, ${r.planned_ticks} planned` : '';
  if (live && !r.ended) return `${rate}${planned}`;
  return r.cut ? `${r.cut.first_tick} to ${r.cut.last_tick}; ${rate}${planned} for the whole run` : `${r.ticks}; ${rate}${planned}`;
}

function information(run, title) {
  const {run: r} = run.meta;
  const rows = [['scenario', r.scenario], ['description', run.scenario.description ?? ''],
    ['paper section', r.paper_section], ['run id', r.run_id], ['started', r.started_at], ['seed', String(r.seed)],
    ['robot', `${run.robot.name}, ${formatNumber(run.robot.mass)} kg, ${run.robot.joints.length} joints`],
    ['ticks', ticksOf(run)],
    ['paced by', r.realtime ? 'the wall clock' : 'lockstep'], ['messages dropped on purpose', `${100 * r.drop_rate} %`],
    ['log', r.log], ['places of the log without a record', run.meta.live && !r.ended ? '' : String(r.damages)],
    ['commit', r.poise_commit || 'not known'], ['instruction set of the build', r.instruction_set || 'not known'],
    ...Object.entries(r.versions).map(([name, version]) => [name, version])];
  return element('section', {class: 'table'}, element('h2', {}, title),
    element('div', {class: 'scroll'}, element('table', {}, element('tbody', {}, ...rows.filter(([, v]) => v)
      .map(([name, value]) => element('tr', {}, element('th', {scope: 'row'}, name), element('td', {}, value)))))),
    element('details', {}, element('summary', {}, 'Scenario as it was run, overrides applied'),
      element('pre', {}, run.meta.scenario_text)));
}

/** All tables below the plots. */
export function tables(run, others) {
  const {components} = run.meta.run;
  return [checkTable(run, others), assumptionTable(run), latencyFigure(components), latencyTable(components),
    channelTable(run), information(run, 'This run'),
    ...others.map((other) => information(other, `The ${other.called}`))].filter(Boolean);
}

/** Those of a run in progress, and of its end; `refresh()` brings what the feed has told since. */
export function liveTables(run, feed) {
  const place = element('div', {class: 'tables'});
  const checks = element('div', {}), latencies = element('div', {});
  const going = [checks, assumptionTable(run), latencies, information(run, 'This run')].filter(Boolean);
  return {
    elements: [place],
    refresh: () => {
      const {ended, checks: found, components, checked_ticks: ticks, problem} = feed.status;
      run.meta.run.checks = found;
      if (checks.parentElement !== place) place.replaceChildren(...going);
      if (problem) {
        checks.replaceChildren(element('p', {class: 'failed', role: 'status'}, `checks and events cannot be told: ${problem}`));
      } else if (ended) {
        run.meta.run.ended = true;
        place.replaceChildren(...tables(run, []));
      } else {
        const caption = `Checks up to ${formatNumber(run.timeOfTick(ticks))} s: pending until the run's end`;
        checks.replaceChildren(found.length ? checkTable(run, [], caption) : '');
        latencies.replaceChildren(latencyFigure(components), latencyTable(components));
      }
    },
  };
}

/** "all 31 checks hold", or how many failed, by name under the mouse. */
function verdictBadge(run) {
  const checks = run.meta.run.checks.filter((c) => c.limit !== null);
  const unknown = checks.filter(isUnknown), limited = checks.filter((c) => !isUnknown(c));
  const failed = limited.filter((c) => !c.passed);
  const where = partOf(run) ? ' in this part' : '';
  if (limited.length === 0) return element('a', {href: '#tables', class: 'badge'}, 'no check has a limit');
  return element('a', {href: '#tables', class: `badge ${failed.length ? 'failed' : 'ok'}`,
    title: [...failed.map((c) => c.label || c.name), ...unknown.map((c) => `${c.label || c.name}: ${unknownText(c)}`)].join('\n')},
  (failed.length ? `${failed.length} of ${limited.length} checks FAILED${where}` : `all ${limited.length} checks hold${where}`)
    + (unknown.length ? `, ${unknown.length} not known` : ''));
}

/** What is known of the run's end: of a run in progress, what its feed says. */
export function stateBadges(run, feed) {
  const badge = (text, kind = '') => element('span', {class: `badge ${kind}`}, text);
  const fallBadge = (events) => {
    const fall = events.find((e) => e.name === 'fall');
    return fall ? badge(`fell at ${fall.time.toFixed(3)} s`, 'failed') : '';
  };
  if (!feed) return [partOf(run) ? badge(partOf(run)) : '', fallBadge(run.meta.events ?? []), verdictBadge(run)];
  const {status, state, control} = feed;
  if (status.ended) return [fallBadge(status.events), status.problem ? badge('ended; its checks cannot be told') : verdictBadge(run)];
  if (control?.run?.ended) return [badge(endText(control.run), control.run.detail ? 'failed' : '')];
  return [badge({connecting: 'connecting', live: 'in progress', ended: 'ended; its log is being checked',
    waiting: 'connection lost: whether it goes on is not known'}[state])];
}
