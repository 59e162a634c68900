// What is looked at stands in the page's address: "#t=0.81&from=0.5&to=1.2&plot=JOINT_COMMAND.eta+JOINT_COMMAND.eta_min&hide=desired@COM error".
import {button} from './dom.js';
import {lineOf, panelOf} from './figures.js';

const PERIOD = 400;    // ms between looks; browsers refuse an address that changes too often
const ANSWERED = 1500;  // ms

/** The part after '#' of the time, the stretch shown, the plots that were added and the lines that were hidden; '' at first. */
function addressOf({run, player, view, grid}) {
  const parts = new URLSearchParams();
  const seconds = (time) => String(Number(time.toFixed(6)));
  if (!player.following && player.time > run.start) parts.set('t', seconds(player.time));
  if (!player.following && (view.min > run.start || view.max < view.end)) {
    parts.set('from', seconds(view.min));
    parts.set('to', seconds(view.max));
  }
  for (const {definition: {added, series}} of grid.panels) if (added) parts.append('plot', series.map(({name}) => name).join(' '));
  for (const {definition: {title}, hidden} of grid.panels) for (const label of hidden) parts.append('hide', `${label}@${title}`);
  return String(parts);
}

/** Shows what an address tells, as far as the run has it. */
function goTo(address, {run, player, view, grid}) {
  const parts = new URLSearchParams(address);
  const time = (name) => (parts.has(name) ? Number(parts.get(name)) : NaN);
  for (const panel of grid.panels.filter(({definition}) => definition.added)) grid.remove(panel);
  for (const names of parts.getAll('plot')) {
    const [first, ...more] = names.split(' ').map((name) => run.signals.get(name)).filter(Boolean);
    const panel = first && grid.add(panelOf(first), true);
    for (const signal of more) panel.addLine(lineOf(signal, panel.definition.series.length));
  }
  const hidden = parts.getAll('hide').map((text) => /^(.*?)@(.*)$/.exec(text) ?? []);
  for (const panel of grid.panels) panel.hide(hidden.filter(([,, title]) => title === panel.definition.title).map(([, label]) => label));
  if (time('from') < time('to')) view.set(time('from'), time('to'));
  else if (!run.meta.live) view.reset();
  if (Number.isFinite(time('t'))) player.seek(time('t'));
}

/** Keeps the address up to what is seen, and goes where another one leads. The button copies it. */
export function linkButton(shared) {
  const asked = () => (location.hash.includes('=') ? location.hash.slice(1) : undefined);  // others are places of the page
  let told = addressOf(shared);
  const follow = () => {
    if (asked() === undefined || asked() === told) return;
    goTo(asked(), shared);
    told = addressOf(shared);
  };
  const tell = () => {
    const now = addressOf(shared);
    if (now !== told) history.replaceState(null, '', now ? `#${now}` : location.href.split('#')[0]);
    told = now;
  };
  follow();
  addEventListener('hashchange', follow);
  setInterval(() => { if (!shared.player.playing) tell(); }, PERIOD);
  const answer = (text) => {
    link.textContent = text;
    setTimeout(() => { link.textContent = 'Link'; }, ANSWERED);
  };
  const link = button('Link', 'Copy a link to this time, this stretch and these plots', async () => {
    tell();
    const url = new URL(location.href);
    url.searchParams.delete('token');  // whoever gets the link may look, not act
    await navigator.clipboard.writeText(url.href).then(() => answer('Link copied'), () => answer('The address has it'));
  });
  return link;
}
