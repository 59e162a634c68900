// Every signal can be found and added as a plot.
import {element} from './dom.js';
import {panelOf} from './figures.js';

const MOST_RESULTS = 40;

/** Signals whose name, title or text holds every word of the query, those that match by name or title first. */
export function searchSignals(signals, query) {
  const plain = (text) => text.toLowerCase().replace(/[^a-z0-9]+/g, ' ');
  const words = plain(query).trim().split(' ').filter(Boolean);
  if (words.length === 0) return [];
  const holds = (text) => words.every((w) => text.includes(w));
  const byName = [], byText = [];
  for (const signal of signals) {
    if (holds(plain(`${signal.name} ${signal.title}`))) byName.push(signal);
    else if (holds(plain(`${signal.name} ${signal.title} ${signal.text}`))) byText.push(signal);
  }
  return [...byName, ...byText];
}

/** The field and its list of results. */
export function signalSearch(run, grid) {
  const results = element('ul', {class: 'results', hidden: true});
  let last = null;  // plot that was added last
  const close = () => { results.hidden = true; };
  const addPlot = (signal) => {
    last = grid.add(panelOf(signal), true);
    close();
    last.element.scrollIntoView({block: 'nearest'});
  };
  const addLine = (signal) => {
    if (!grid.panels.includes(last)) return addPlot(signal);  // it was removed meanwhile
    last.addLine({label: signal.title, role: `hue-${last.definition.series.length}`, name: signal.name, signal});
    close();
  };
  const row = (signal) => element('li', {},
    element('button', {type: 'button', class: 'result', click: () => addPlot(signal)},
      element('span', {class: 'name', title: signal.name}, signal.title), signal.unit ? element('span', {class: 'unit'}, signal.unit) : '',
      element('span', {class: 'text'}, signal.text ?? '')),
    last && grid.panels.includes(last) && last.definition.unit === signal.unit
      ? element('button', {type: 'button', title: 'Add to the plot that was added last', click: () => addLine(signal)},
        'into last') : '');
  const update = () => {
    const found = searchSignals(run.signals.values(), input.value);
    results.hidden = input.value.trim() === '';
    results.replaceChildren(...found.slice(0, MOST_RESULTS).map(row), element('li', {class: 'count'},
      found.length > MOST_RESULTS ? `${found.length} signals; the first ${MOST_RESULTS}`
        : `${found.length} signal${found.length === 1 ? '' : 's'}`));
  };
  const input = element('input', {type: 'search', id: 'signal-search', 'aria-label': 'Search signals',
    placeholder: `Search ${run.signals.size} signals and add one as a plot  ( / )`, autocomplete: 'off',
    input: update, focus: update, keydown: (e) => {
      if (e.key === 'Escape') {
        close();
        input.blur();
      } else if (e.key === 'Enter') {
        const [first] = searchSignals(run.signals.values(), input.value);
        if (first) addPlot(first);
      } else {
        return;
      }
      e.preventDefault();
    }});
  const box = element('div', {class: 'search'}, input, results);
  document.addEventListener('pointerdown', (e) => { if (!box.contains(e.target)) close(); });
  return box;
}
