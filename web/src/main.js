// Builds the page from the run that it holds.
import {KEYS, playerBar} from './bar.js';
import {Control, Hand} from './live/control.js';
import {CONTROL_KEYS, controlPanel} from './live/control_panel.js';
import {embeddedRuns} from './data.js';
import {addDerivedSignals, findPhases} from './derived.js';
import {element} from './dom.js';
import {changesOf, figuresFor} from './figures.js';
import {FOOTSTEPS} from './footsteps.js';
import {grabbing} from './live/grab.js';
import {LiveFeed, firstTicks, followGrowth, showEnd} from './live/live.js';
import {NoPicture, has3D} from './no_picture.js';
import {Player} from './player.js';
import {PanelGrid, TimeView} from './plots.js';
import {Printer} from './print.js';
import {robotPage} from './robot_page.js';
import {COLORS, SceneView} from './scene.js';
import {signalSearch} from './search.js';
import {eventList, Readout} from './side.js';
import {TRACE} from './steps_view.js';
import {liveTables, stateBadges, tables} from './table.js';
import {quantity} from './units.js';

const READOUT_PERIOD = 80;  // ms

const WIDE = matchMedia('(min-width: 900px)');  // as in style.css: there is a column beside the plots

/** "poise 0.1.0 (0b2aa3d58986, x86-64-v3)": which build ran it. */
function buildOf({versions, poise_commit: commit, instruction_set: instructions}) {
  const [hash, ...changes] = (commit ?? '').split('+');
  const known = [[hash.slice(0, 12), ...changes].filter(Boolean).join('+'), instructions].filter(Boolean);
  return `poise ${versions.poise}${known.length ? ` (${known.join(', ')})` : ''}`;
}

function header(run, overlay, feed) {
  const {run: r} = run.meta;
  const changes = changesOf(r);
  const variant = (run.scenario.variant ?? []).find((v) => v.name === r.variant);
  const state = element('span', {class: 'badges'});
  const update = () => state.replaceChildren(...stateBadges(run, feed));
  for (const event of feed ? ['state', 'status'] : []) feed.addEventListener(event, update);
  document.title = `${[r.scenario, ...changes].join(', ')} – Poise`;
  document.getElementById('header').append(
    element('h1', {}, r.scenario), ...changes.map((change) => element('span', {class: 'badge change'}, change)),
    element('p', {}, variant?.description ? `${variant.description} (a variant of: ${run.scenario.description ?? ''})`
      : run.scenario.description ?? ''),
    r.paper_section ? element('span', {class: 'badge'}, changes.length ? `changed from the paper's section ${r.paper_section}`
      : `paper, section ${r.paper_section}`) : '',
    state, element('span', {class: 'soft'}, `${r.started_at}, ${buildOf(r)}`),
    overlay ? element('span', {class: 'badge second'}, `over it, dashed: ${overlay.meta.run.scenario}, ${overlay.meta.run.started_at}`)
      : '', run.meta.story ? element('p', {class: 'story'}, run.meta.story) : '');
  update();
}

function sceneToolbar(scene) {
  const button = (name) => element('button', {type: 'button', click: () => scene.look(name)}, name);
  const box = (name, label) => element('label', {}, element('input', {type: 'checkbox', checked: scene.show[name],
    change: (e) => scene.setShow(name, e.target.checked)}), label);
  return element('div', {class: 'toolbar'}, ...['free', 'front', 'side', 'top'].map(button),
    box('forces', 'forces'), box('moments', 'moments'), box('pressure', 'CoP'), box('com', 'COM'), box('steps', 'steps'));
}

/** What the regions about the standing foot leave out. */
function regionsNote(run) {
  if (!run.find(FOOTSTEPS, 'stance')) return '';
  return element('p', {class: 'soft regions-note'}, 'Regions of 0, 1, 2 steps about the standing foot (Koolen et al. 2012). Approximated: a '
    + 'pendulum of the COM\'s height; the legs\' reach with the COM above the sole; feet parallel; each step in its least or planned time '
    + 'from beside the sole, the one under way to where it is planned, as far as that can still be moved; the hull of 16 directions.');
}

function sceneKey(run, overlay) {
  const entry = (name, symbol, text) => {
    const mark = element('span', {class: 'symbol'}, symbol);
    mark.style.color = `light-dark(${COLORS[name].light}, ${COLORS[name].dark})`;
    return element('li', {}, mark, text);
  };
  return element('ul', {class: 'key'}, entry('computed', '○↑', 'computed CoP, ground force'),
    entry('measured', '●↑', 'measured'), entry('desired', '◇', 'O_d, while balancing'),
    entry('limit', '╌', 'acceptable region'), entry('support', '▭', 'soles, support polygon'),
    entry('capture', '●', `capture point; ─ its last ${TRACE} s; ○ a step needed there`),
    entry('support', '▰', 'footprints and when the foot came down: right blue, left orange; ╌ planned'),
    run.find(FOOTSTEPS, 'stance') ? entry('reach', '⬠', 'from inside, 0, ╌ 1, 2 steps bring it to rest (approximate)') : '',
    entry('com', '✚', 'COM and below it'), entry('push', '↑', 'push'),
    run.meta.ground?.length ? element('li', {class: 'blocks-key'}, element('span', {class: 'symbol'}, '▦'),
      'blocks as nothing stands on them (a lane has no outer edge): light soft, dark stiff') : '',
    run.scenario.sim?.crane ? entry('support', '│', 'crane; ↑ what it pulls with') : '',
    overlay ? entry('desired', '▒', 'second run') : '');
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
    + 'There a curve shows single ticks, and its shade reaches from the least to the largest of all of them; what is computed here from '
    + 'several signals has no shade. The log has every tick: poise log cut and poise report show any stretch of it.');
}

async function start() {
  const robot = document.querySelector('script.poise-robot');
  if (robot) {
    robotPage(JSON.parse(robot.textContent));
    return;
  }
  const [run, overlay] = embeddedRuns(document);
  if (!run) throw new Error('this page holds no run: write one with poise report');
  for (const r of [run, overlay].filter(Boolean)) addDerivedSignals(r);
  const feed = run.meta.live ? new LiveFeed(run) : undefined;
  header(run, overlay, feed);
  if (feed) await firstTicks(feed);
  const events = run.meta.events ?? [];
  const player = new Player(run);
  const phasesFound = findPhases(run);  // unpacked while the browser prepares its 3D
  const drawn = has3D(), host = document.getElementById('scene');
  const scene = drawn ? new SceneView(host, run, overlay) : new NoPicture(host);
  if (drawn) host.append(sceneToolbar(scene), sceneKey(run, overlay), element('span', {class: 'inset'}, 'soles from above, forward is up'));
  const [phases] = await Promise.all([phasesFound, scene.load()]);
  document.documentElement.dataset.picture = String(Math.round(performance.now()));

  const view = new TimeView(run);
  const shared = {run, overlay, player, view, phases, events, feed};
  const bar = playerBar(document.getElementById('player'), shared);
  const grid = new PanelGrid(document.getElementById('figures'), shared);
  const printer = new Printer(grid, scene);
  const readout = new Readout(run);
  const eventPlace = element('div', {}, eventList(events, player));
  const control = feed && new Control(feed);
  if (control) {
    document.getElementById('side').append(controlPanel(control, shared));
    if (drawn) {
      const {show: pull} = grabbing(scene, control, new Hand(control), () => control.can('push') && player.following && feed.state === 'live');
      player.addEventListener('time', pull);
    }
    control.catchUp();
  }
  const keys = feed && new URL(location.href).searchParams.has('token') ? [...KEYS, ...CONTROL_KEYS] : KEYS;
  document.getElementById('side').append(element('h2', {}, 'At the time cursor'), readout.element, regionsNote(run),
    eventPlace, element('section', {class: 'keys'}, element('h2', {}, 'Keys'), element('dl', {},
      ...keys.flatMap(([key, what]) => [element('dt', {}, key), element('dd', {}, what)]))));
  document.getElementById('figures-bar').append(signalSearch(run, grid), element('ul', {class: 'key'},
    element('li', {}, element('span', {class: 'area balancing'}), 'balancing runs'),
    element('li', {}, element('span', {class: 'area single'}), 'single support'),
    element('li', {}, element('span', {class: 'area missing'}), 'no message tells'),
    element('li', {}, element('span', {class: 'area event'}), 'event'),
    element('li', {}, 'drag: zoom; click: time; ctrl + wheel: zoom; double click: all')), rowsNote(run),
  drawn ? dockedScene(scene) : '', printer.button);
  for (const definition of figuresFor(run)) grid.add(definition);
  const live = feed && liveTables(run, feed);
  document.getElementById('tables').append(...(live ? live.elements : tables(run, overlay)));
  await readout.load();

  let shown = 0;
  const update = (now) => {
    if ((player.playing || player.following) && now - shown < READOUT_PERIOD) return;
    shown = now;
    readout.update(player.row);
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
      eventPlace.replaceChildren(eventList(shared.events, player,
        ended ? '' : ` up to ${run.timeOfTick(ticks).toFixed(1)} s`));
      bar.refresh();
      grid.redraw();
    };
    feed.addEventListener('status', refreshStatus);
    refreshStatus();
  }
  if (!feed) printer.drawWhenIdle(run);
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
  // For whoever looks closer from the browser's console.
  window.poise = {run, overlay, player, view, grid, scene, feed, printer, control};
}

start().catch((error) => {
  console.error(error);
  document.getElementById('header').append(element('p', {class: 'failed', role: 'alert'}, `This page cannot be shown: ${error.message}`));
});
