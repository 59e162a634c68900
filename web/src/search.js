// Every signal can be found and added as a plot.
import {button, element} from './dom.js';
import {lineOf, panelOf} from './figures.js';

const MOST_RESULTS = 40;
const RAW = /^drive_/;  // messages in the drives' own units

/**
 * Signals whose name, title or text holds every word of the query: first those that are called so, whose field or name begins so,
 * whose field holds all words, then whose name does, last by text. Among equals what has a unit goes before counts and the like.
 */
export function searchSignals(signals, query) {
  const plain = (text) => text.toLowerCase().replace(/[^a-z0-9]+/g, ' ').trim();
  const asked = plain(query), words = asked.split(' ').filter(Boolean);
  if (words.length === 0) return [];
  const holds = (text) => words.every((w) => text.includes(w));
  const place = (signal) => {
    const fields = [signal.field, signal.label].map(plain), all = [...fields, ...[signal.name, signal.title].map(plain)];
    const ways = [all.includes(asked), all.some((text) => `${text} `.startsWith(`${asked} `)), all.some((text) => text.startsWith(asked)),
      holds(fields.join(' ')), holds(all.join(' ')), holds(plain(`${all.join(' ')} ${signal.text ?? ''}`))];
    return ways.indexOf(true);
  };
  const counted = ({unit, channel}) => (unit && !RAW.test(channel.type) ? 0 : 1);
  return [...signals].map((signal) => ({signal, at: place(signal)})).filter(({at}) => at >= 0)
    .sort((a, b) => a.at - b.at || counted(a.signal) - counted(b.signal)).map(({signal}) => signal);
}

/** The field and its list of results. */
export function signalSearch(run, grid) {
  const results = element('ul', {class: 'results', id: 'results', role: 'listbox', hidden: true});
  let last = null;  // plot that was added last
  const close = () => { results.hidden = true; };
  const addPlot = (signal) => {
    last = grid.add(panelOf(signal), true);
    close();
    last.element.scrollIntoView({block: 'nearest'});
  };
  const addLine = (signal) => {
    if (!grid.panels.includes(last)) return addPlot(signal);  // it was removed meanwhile
    last.addLine(lineOf(signal, last.definition.series.length));
    close();
  };
  let found = [], chosen = 0;
  const choose = (index) => {
    const rows = results.querySelectorAll('li:not(.count)');
    chosen = Math.max(0, Math.min(rows.length - 1, index));
    rows.forEach((row, i) => row.toggleAttribute('data-chosen', i === chosen));
    rows[chosen]?.scrollIntoView({block: 'nearest'});
    if (rows[chosen]) input.setAttribute('aria-activedescendant', rows[chosen].id);
    else input.removeAttribute('aria-activedescendant');
  };
  const row = (signal, i) => element('li', {id: `found-${i}`, role: 'option'},
    element('button', {type: 'button', class: 'result', click: () => addPlot(signal)},
      element('span', {class: 'name', title: signal.name}, signal.title), signal.unit ? element('span', {class: 'unit'}, signal.unit) : '',
      element('span', {class: 'text'}, signal.text ?? '')),
    last && grid.panels.includes(last) && last.definition.unit === signal.unit
      ? button('into last', 'Add to the plot that was added last', () => addLine(signal)) : '');
  const update = () => {
    found = searchSignals(run.signals.values(), input.value);
    results.hidden = input.value.trim() === '';
    results.replaceChildren(...found.slice(0, MOST_RESULTS).map(row), element('li', {class: 'count'},
      found.length > MOST_RESULTS ? `${found.length} signals; the first ${MOST_RESULTS}`
        : `${found.length} signal${found.length === 1 ? '' : 's'}`));
    choose(0);
  };
  const input = element('input', {type: 'search', id: 'signal-search', role: 'combobox', 'aria-controls': 'results', 'aria-label': 'Search signals',
    placeholder: `Search ${run.signals.size} signals and add one as a plot  ( / )`, autocomplete: 'off',
    input: update, focus: update, keydown: (e) => {
      if (e.key === 'Escape') {
        close();
        input.blur();
      } else if (e.key === 'Enter') {
        if (!results.hidden && found[chosen]) addPlot(found[chosen]);
      } else if (e.key === 'ArrowDown' || e.key === 'ArrowUp') {
        choose(chosen + (e.key === 'ArrowDown' ? 1 : -1));
      } else {
        return;
      }
      e.preventDefault();
    }});
  const box = element('div', {class: 'search'}, input, results);
  document.addEventListener('pointerdown', (e) => { if (!box.contains(e.target)) close(); });
  return box;
}
