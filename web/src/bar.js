// The bar at the bottom: play, speed, scrub, zoom, and the keys.
import {button, element, icon, onKeys, signButton} from './dom.js';
import {SPEEDS} from './player.js';

const LONG_STEP = 0.1;  // s
const ZOOM_STEP = 1.5;

export const KEYS = [['space', 'play or pause'], ['← →', 'one tick'], ['shift ← →', '0.1 s'], ['home end', 'start, end'],
  ['[ ]', 'slower, faster'], ['+ −', 'zoom the plots at the cursor'], ['0', 'all of it in the plots'], ['/', 'search signals']];

function track(shared) {
  const {run, phases, events, otherEvents} = shared;
  // A live run lets go of its beginning, and another one may be longer.
  const inSight = (list) => list.filter((e) => e.time >= run.start - run.period && e.time <= run.end + run.period);
  const length = Math.max(run.end - run.start, run.period);
  const share = (t) => 100 * Math.min(1, Math.max(0, (t - run.start) / length));
  const mark = (name, {from, to}) => {
    const result = element('span', {class: name});
    result.style.left = `${share(from)}%`;
    if (to !== undefined) result.style.width = `max(2px, ${share(to) - share(from)}%)`;
    return result;
  };
  return element('div', {class: 'track', 'aria-hidden': 'true'},
    ...phases.support.filter((p) => p.value !== 'both feet').map((p) => mark('single', p)),
    ...phases.balancing.map((p) => mark('balancing', p)),
    ...phases.missing.map((p) => mark('missing', p)),
    ...inSight([...events, ...otherEvents])
      .map((e) => mark(`event${e.called ? ' second' : ''}${e.name === 'fall' ? ' fall' : ''}`, {from: e.time})));
}

const NEAR = 0.008;  // of the bar, from the pointer to an event that it is told of

/** Which events there are about a time, a line each. */
function eventsNear(time, {run, events, otherEvents}) {
  const length = NEAR * Math.max(run.end - run.start, run.period);
  return [...events, ...otherEvents].filter((e) => Math.abs(e.time - time) <= length)
    .map((e) => `${e.time.toFixed(3)} s: ${e.name.replaceAll('_', ' ')}${e.called ? ` (${e.called})` : ''}`).join('\n');
}

export const LAG_PERIOD = 200;  // ms between looks at how far the page is behind
const LIVE_TEXTS = {connecting: '○ connecting', live: '● live', ended: '■ run ended',
  waiting: '○ no connection: trying again'};

/** Whether the run goes on; pressed: the page follows it. */
function liveButton({player, feed}) {
  const follow = button('', 'Follow the end of the run', () => player.setFollowing(true), {id: 'live'});
  const update = () => {
    const missed = feed.lost > 0 ? `, ${feed.lost} messages missed` : '';
    const [state, text] = liveText(feed);
    follow.textContent = text + missed;
    follow.dataset.state = state;
    follow.setAttribute('aria-pressed', String(player.following));
  };
  for (const event of ['state', 'control']) feed.addEventListener(event, update);
  player.addEventListener('state', update);
  setInterval(update, LAG_PERIOD);
  update();
  return follow;
}

/** [state, words]: live only when the page is; else how far it is behind, or up to where the run is made again. */
export function liveText(feed) {
  const again = feed.control?.run?.again ?? -1;
  if (feed.state !== 'live') return [feed.state, LIVE_TEXTS[feed.state]];
  if (again >= 0) return ['again', `○ made again, up to ${feed.run.timeOfTick(again).toFixed(3)} s`];
  if (feed.run.numRows === 0) return ['connecting', '○ no tick yet'];  // of a run that has just gone back, too
  if (feed.live) return ['live', LIVE_TEXTS.live];
  return ['behind', Number.isFinite(feed.behind) ? `◐ ${feed.behind.toFixed(1)} s behind` : LIVE_TEXTS.connecting];
}

/** Fills `host`; `shared` as for panels, `feed` when the run is live. Returns {refresh}, for a run that has grown. */
export function playerBar(host, shared) {
  const {player, view, run} = shared;
  const play = signButton(icon('play'), 'Play or pause (space)', () => player.toggle());
  play.id = 'play';
  const speed = element('select', {id: 'speed', 'aria-label': 'Speed',
    change: () => player.setSpeed(Number(speed.value))},
  ...SPEEDS.map((s) => element('option', {value: s, selected: s === 1}, `${s}×`)));
  const scrub = element('input', {type: 'range', id: 'scrub', step: 1,
    'aria-label': 'Time', input: () => player.seek(run.timeOfTick(Number(scrub.value))),
    keydown: (e) => e.preventDefault(),  // the page's own keys step
    pointermove: (e) => {
      const box = scrub.getBoundingClientRect();
      scrub.title = eventsNear(run.start + (e.clientX - box.left) / box.width * (run.end - run.start), shared);
    }});
  const time = element('output', {id: 'time'});
  const scale = () => {
    scrub.min = run.firstTick;
    scrub.max = run.tickOf(Math.max(0, run.numRows - 1));
  };
  scale();
  const marks = element('div', {class: 'marks'}, track(shared));
  host.append(shared.feed ? liveButton(shared) : '', signButton('|◂', 'Start (home)', () => player.seek(run.start)),
    signButton('◂', 'One tick back (←)', () => player.step(-1)), play,
    signButton('▸', 'One tick on (→)', () => player.step(1)), speed,
    element('div', {class: 'scrub'}, marks, scrub), time,
    signButton('−', 'Zoom the plots out (−)', () => view.zoom(ZOOM_STEP, player.time)),
    signButton('+', 'Zoom the plots in at the cursor (+)', () => view.zoom(1 / ZOOM_STEP, player.time)),
    signButton('all', 'Show all that the page holds in the plots (0)', () => view.reset()));
  const showTime = () => {
    scrub.value = player.tick;
    if (player.tick < run.firstTick) return time.replaceChildren();  // nothing has come yet, or again
    const stride = run.strideOf(player.row);  // a row may hold several ticks
    time.replaceChildren(`${player.time.toFixed(3)} s`,
      element('span', {class: 'tick'}, `  tick ${player.tick}${stride > 1 ? ` of ${stride}` : ''}`));
  };
  player.addEventListener('time', showTime);
  player.addEventListener('state', () => {
    play.replaceChildren(icon(player.playing ? 'pause' : 'play'));
    speed.value = player.speed;
  });
  showTime();
  listenToKeys(shared);
  return {refresh: () => {
    scale();
    marks.replaceChildren(track(shared));
    showTime();
  }};
}

function listenToKeys({player, view, run, feed}) {
  const long = Math.max(1, Math.round(LONG_STEP / run.period));
  onKeys({
    ' ': () => player.toggle(), ArrowLeft: (e) => player.step(e.shiftKey ? -long : -1),
    ArrowRight: (e) => player.step(e.shiftKey ? long : 1), Home: () => player.seek(run.start),
    End: () => feed ? player.setFollowing(true) : player.seek(run.end),
    '[': () => player.changeSpeed(-1), ']': () => player.changeSpeed(1), '0': () => view.reset(),
    '+': () => view.zoom(1 / ZOOM_STEP, player.time), '=': () => view.zoom(1 / ZOOM_STEP, player.time),
    '-': () => view.zoom(ZOOM_STEP, player.time), '/': () => document.getElementById('signal-search').focus(),
  });
  // What the mouse has pressed does not keep the keys; what the tab key has reached does.
  const release = (e) => {
    const control = e.target.closest?.('button, summary, a, label, select, input:not([type=search])');
    if (control && document.activeElement?.matches('button, summary, a, select, input:not([type=search])')) {
      document.activeElement.blur();
    }
  };
  document.addEventListener('click', (e) => { if (e.detail > 0 && !e.target.matches('select')) release(e); });
  document.addEventListener('change', (e) => { if (e.target.matches('select, [type=range]')) release(e); });
}
