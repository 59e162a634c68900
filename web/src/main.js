// Builds the page from the run that it holds.
import {KEYS, playerBar} from './bar.js';
import {Control} from './live/control.js';
import {CONTROL_KEYS, controlPanel} from './live/control_panel.js';
import {embeddedRuns} from './data.js';
import {checkbox, element, saveNamed} from './dom.js';
import {changesOf, figuresFor, measuredName} from './figures.js';
import {FOOTSTEPS} from './footsteps.js';
import {grabbing} from './live/grab.js';
import {linkButton} from './link.js';
import {LiveFeed, firstTicks, followGrowth, showEnd} from './live/live.js';
import {NoPicture, has3D} from './no_picture.js';
import {findPhases} from './phases.js';
import {COLORS} from './palette.js';
import {Player} from './player.js';
import {PanelGrid, TimeView} from './plots.js';
import {Printer} from './print.js';
import {robotPage} from './robot_page.js';
import {SceneView} from './picture/scene.js';
import {signalSearch} from './search.js';
import {EventList, Readout, storyText} from './side.js';
import {TRACE} from './steps_view.js';
import {liveTables, stateBadges, tables} from './table.js';
import {quantity} from './units.js';
import {videoButton} from './video.js';

const READOUT_PERIOD = 80;  // ms

const WIDE = matchMedia('(min-width: 900px)');  // as in style.css: there is a column beside the plots

/** "poise 0.1.0 (0b2aa3d58986, x86-64-v3)": which build ran it. */
function buildOf({versions, poise_commit: commit, instruction_set: instructions}) {
  const [hash, ...changes] = (commit ?? '').split('+');
  const known = [[hash.slice(0, 12), ...changes].filter(Boolean).join('+'), instructions].filter(Boolean);
  return `poise ${versions.poise}${known.length ? ` (${known.join(', ')})` : ''}`;
}

const CHIPS = 4;  // changes of a run that are each shown

/** What the run has besides its scenario; the last ones, where there are many, under the mouse. */
function changeChips(changes) {
  const chip = (text, title) => element('span', {class: 'badge change', title}, text);
  const rest = changes.slice(CHIPS);
  return [...changes.slice(0, CHIPS).map((text) => chip(text)),
    rest.length > 0 ? chip(`${rest.length} more change${rest.length === 1 ? '' : 's'}`, rest.join('\n')) : ''];
}

/** A run in the header: its names, how it ended and its story. `several`: it is one of several. */
function runHead({run, several, feed, player}) {
  const {run: r} = run.meta;
  const changes = changesOf(r);
  const variant = (run.scenario.variant ?? []).find((v) => v.name === r.variant);
  const state = element('span', {class: 'badges'}), story = element('div', {class: 'story-place'});
  const update = () => {
    state.replaceChildren(...stateBadges(run, feed));
    const text = (feed ? feed.status.story : run.meta.story) || '';
    if (text !== story.dataset.text) story.replaceChildren(text ? storyText(text, player) : '');
    story.dataset.text = text;
  };
  for (const event of feed ? ['state', 'status', 'control', 'restart'] : []) feed.addEventListener(event, update);
  update();
  return element('section', {class: `run-head${run.index > 0 ? ' second' : ''}`},
    several ? element('span', {class: 'which'}, run.called) : '', element(run.index > 0 ? 'h2' : 'h1', {}, r.scenario), ...changeChips(changes), state,
    element('p', {class: 'description'}, variant?.description ? `${variant.description} (a variant of: ${run.scenario.description ?? ''})`
      : run.scenario.description ?? ''),
    r.paper_section ? element('span', {class: 'badge'}, changes.length ? `changed from the paper's section ${r.paper_section}`
      : `paper, section ${r.paper_section}`) : '',
    element('span', {class: 'soft about'}, [`robot ${run.robot.name}`, feed ? '' : folderOf(r), r.started_at, buildOf(r)].filter(Boolean).join(', ')), story);
}

/** "stands", of its log's "stands/run.lcm"; of a log on its own its name. */
const folderOf = ({log}) => log.replace(/\/run\.lcm$/, '');

function header(runs, feed, player) {
  document.title = `${runs.map(({meta}) => [meta.run.scenario, ...changesOf(meta.run).slice(0, CHIPS)].join(', ')).join(' and ')} – Poise`;
  document.getElementById('header').append(...runs.map((run) => runHead({run, several: runs.length > 1, feed, player})));
}

function sceneToolbar(scene) {
  const box = (name, label) => checkbox(label, scene.show[name], (on) => scene.setShow(name, on));
  return scene.toolbar(box('forces', 'forces'), box('moments', 'moments'), box('pressure', 'CoP'), box('com', 'COM'),
    box('steps', 'steps'));
}

/** The picture as a file. */
function savingToolbar(scene, {run, player}) {
  const name = () => `${run.meta.run.scenario} ${player.time.toFixed(3)} s`;
  return element('div', {class: 'toolbar saving'}, scene.pngButton(name),
    videoButton(scene, player, (blob) => saveNamed(name(), 'webm', blob)));
}

/** What the regions about the standing foot leave out. */
function regionsNote(run) {
  if (!run.find(FOOTSTEPS, 'stance')) return '';
  return element('details', {class: 'soft regions-note'}, element('summary', {}, 'Regions of 0, 1, 2 steps'), 'About the standing foot (Koolen et al. 2012). Approximated: a '
    + 'pendulum of the COM\'s height; the legs\' reach with the COM above the sole; feet parallel; each step in its least or planned time '
    + 'from beside the sole, the one under way to where it is planned, as far as that can still be moved; the hull of 16 directions.');
}

/** What the picture's signs mean, beneath it; folded where there is little room. */
function sceneKey(run, others) {
  const entry = (name, symbol, text) => {
    const mark = element('span', {class: 'symbol'}, symbol);
    mark.style.color = `light-dark(${COLORS[name]})`;
    return element('li', {}, mark, text);
  };
  const key = element('details', {class: 'scene-key', open: WIDE.matches}, element('summary', {}, 'Signs in the picture'),
    element('ul', {class: 'key'}, entry('computed', '○↑', 'computed CoP, ground force'),
      entry('measured-mark', '●↑', measuredName(run)), entry('desired', '◇', 'O_d, while balancing'),
      entry('limit', '╌', 'acceptable region'), entry('support', '▭', 'soles, support polygon'),
      entry('capture', '●', `capture point; ─ last ${TRACE} s; ○ step needed`),
      entry('support', '▰', 'footprints, when they came down; ╌ planned'),
      run.find(FOOTSTEPS, 'stance') ? entry('reach', '⬠', 'at rest in 0, ╌ 1, 2 steps (approximate)') : '',
      entry('com', '✚', 'COM and below it'), entry('push', '↑', 'push'),
      run.meta.ground?.length ? element('li', {class: 'blocks-key'}, element('span', {class: 'symbol'}, '▦'), 'blocks as nothing stands on them; light: soft') : '',
      run.scenario.sim?.crane ? entry('support', '│', 'crane; ↑ its pull') : '',
      others.length > 0 ? entry('desired', '▒', others.map((other) => other.called).join(', ')) : ''));
  WIDE.addEventListener('change', () => { key.open = WIDE.matches; });
  return key;
}

/** Whoever lets the run go on, or takes it back, sees it. */
function followOwnActs(control, player) {
  control.addEventListener('answer', ({detail: act}) => {
    if (act.state === 'accepted' && ['go', 'tick', 'back', 'restart'].includes(act.do)) player.setFollowing(true);
  });
}

/** Puts the picture into the side column, small, while the plots are read; the box that switches this off. */
function dockedScene(scene) {
  let away = false;
  const place = document.getElementById('scene-place'), dock = document.getElementById('dock');
  const box = element('input', {type: 'checkbox', checked: true});
  const update = () => {
    const docked = away && box.checked && WIDE.matches;
    if (docked !== (scene.host.parentElement === dock)) (docked ? dock : place).append(scene.host);
    scene.visible = docked || !away;
    scene.draw();
  };
  box.addEventListener('change', update);
  WIDE.addEventListener('change', update);
  new IntersectionObserver((entries) => {
    away = !entries.at(-1).isIntersecting;
    update();
  }, {threshold: 0.25}).observe(place);
  return element('label', {class: 'soft dock-box'}, box, ' robot beside the plots');
}

/** What a page that cannot hold every tick of its run shows instead. */
function rowsNote(run) {
  if (!run.rows) return '';
  const {largest, count} = run.rows;
  const missing = run.meta.events_without_detail ?? 0;
  return element('p', {class: 'note rows-note'},
    `${count} rows for ${run.meta.run.ticks - run.firstTick} ticks: every tick near the run's ends and its main events`
    + `${missing ? ` (${missing} more events found no room)` : ''}, elsewhere one in up to ${largest} (${quantity(largest * run.period, 's')}). `
    + 'There a curve shows single ticks, and its shade reaches from the least to the largest of all of them. '
    + 'The log has every tick: poise log cut and poise report show any stretch of it.');
}

async function start() {
  const robot = document.querySelector('script.poise-robot');
  if (robot) {
    robotPage(JSON.parse(robot.textContent));
    return;
  }
  const runs = embeddedRuns(document), [run, ...others] = runs;
  if (!run) throw new Error('this page holds no run: write one with poise report');
  const feed = run.meta.live ? new LiveFeed(run) : undefined;
  const player = new Player(run);
  header(runs, feed, player);
  if (feed) await firstTicks(feed);
  const events = run.meta.events ?? [];
  const otherEvents = others.flatMap(({called, meta}) => meta.events.map((event) => ({...event, called})));
  const phasesFound = findPhases(run);  // unpacked while the browser prepares its 3D
  const drawn = has3D(), host = document.getElementById('scene');
  const scene = drawn ? new SceneView(host, run, others) : new NoPicture(host);
  if (drawn) {
    host.append(sceneToolbar(scene), savingToolbar(scene, {run, player}), element('span', {class: 'inset'}, 'soles from above, forward is up'));
    document.getElementById('scene-place').after(sceneKey(run, others));
  }
  const [phases] = await Promise.all([phasesFound, scene.load()]);
  document.documentElement.dataset.picture = String(Math.round(performance.now()));

  const view = new TimeView(run);
  const shared = {run, others, player, view, phases, events, otherEvents, feed};
  const bar = playerBar(document.getElementById('player'), shared);
  const grid = new PanelGrid(document.getElementById('figures'), shared);
  const printer = new Printer(grid, scene);
  const readout = new Readout(runs);
  const lists = runs.map((one) => {
    const shown = new EventList(player, others.length > 0 ? one : undefined);
    shown.show(one.meta.events ?? []);
    return shown;
  });
  const control = feed && new Control(feed);
  const acting = control && controlPanel(control, shared);
  if (control) {
    document.getElementById('player').prepend(acting.stop);
    followOwnActs(control, player);
    if (drawn) {
      const mayPush = () => control.can('push') && player.following && feed.state === 'live';
      player.addEventListener('time', grabbing(scene, control, mayPush));
    }
    control.catchUp();
  }
  const keys = feed && new URL(location.href).searchParams.has('token') ? [...KEYS, ...CONTROL_KEYS] : KEYS;
  document.getElementById('side').append(acting?.element ?? '',
    element('section', {class: 'now'}, element('h2', {}, 'At the time cursor'), others.length > 0 ? element('p', {class: 'soft'}, 'The other runs are beneath the first, in their order.') : '',
      readout.element, regionsNote(run)),
    ...lists.map((list) => list.element), acting?.settings ?? '', element('section', {class: 'keys'}, element('h2', {}, 'Keys'), element('dl', {},
      ...keys.flatMap(([key, what]) => [element('dt', {}, key), element('dd', {}, what)]))));
  document.getElementById('figures-bar').append(signalSearch(run, grid), drawn ? dockedScene(scene) : '', printer.button, element('ul', {class: 'key'},
    element('li', {}, element('span', {class: 'area balancing'}), 'balancing runs'),
    element('li', {}, element('span', {class: 'area single'}), 'single support'),
    element('li', {}, element('span', {class: 'area missing'}), 'no message tells'),
    element('li', {}, element('span', {class: 'area event'}), 'event'),
    element('li', {}, 'drag: zoom; click: time; ctrl + wheel: zoom; double click: all')), rowsNote(run));
  for (const definition of figuresFor(run)) grid.add(definition);
  const live = feed && liveTables(run, feed);
  document.getElementById('tables').append(...(live ? live.elements : tables(run, others)));
  await readout.load();

  let shown = 0;
  const update = (now) => {
    if ((player.playing || player.following) && now - shown < READOUT_PERIOD) return;
    shown = now;
    readout.update(player.time);
    grid.updateValues();
  };
  player.addEventListener('time', () => {
    scene.setRow(player.row);
    if (player.playing || player.following) scene.pace(true);
    update(performance.now());
  });
  player.addEventListener('state', () => {
    scene.pace(player.playing || player.following);
    update(performance.now());
  });
  scene.setRow(player.row);  // the cursor may have moved while this page was being made
  update(performance.now());
  followGrowth(shared, () => {
    bar.refresh();
    view.grow(player.following);
    scene.setRow(player.row);
    update(performance.now());
  });
  if (feed) {
    showEnd(shared);
    const refreshStatus = () => {
      live.refresh();
      shared.events = feed.status.events;
      const {ended, checked_ticks: ticks} = feed.status;
      lists[0].show(shared.events, ended || ticks === 0 ? '' : ` up to ${run.timeOfTick(ticks).toFixed(1)} s`);
      bar.refresh();
      grid.redraw();
    };
    for (const event of ['status', 'restart']) feed.addEventListener(event, refreshStatus);
    refreshStatus();
  }
  printer.button.before(linkButton({...shared, grid}));
  if (!feed) printer.drawWhenIdle(run);
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
  // For whoever looks closer from the browser's console.
  window.poise = {run, runs, player, view, grid, scene, feed, printer, control};
}

start().catch((error) => {
  console.error(error);
  document.getElementById('header').append(element('p', {class: 'failed', role: 'alert'}, `This page cannot be shown: ${error.message}`));
});
