// Small helpers for the page's elements. Texts of a log are set as text only, never as HTML.

/** An element with attributes (functions: event listeners by name) and children (elements or texts). */
export function element(tag, attributes = {}, ...children) {
  const result = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') result.addEventListener(name, value);
    else if (value === true) result.setAttribute(name, '');
    else if (value !== false && value !== undefined && value !== null) result.setAttribute(name, value);
  }
  result.append(...children.filter((c) => c !== null && c !== undefined && c !== ''));
  return result;
}

const SVG = 'http://www.w3.org/2000/svg';

/** The same for a picture's shapes. */
export function shape(tag, attributes = {}, ...children) {
  const result = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) result.setAttribute(name, value);
  result.append(...children);
  return result;
}

const ICONS = {play: 'M2 1 11 6.5 2 12Z', pause: 'M2 1h3v11H2ZM8 1h3v11H8Z'};

/** A sign for a button that no font need have. */
export const icon = (name) => shape('svg', {class: 'icon', viewBox: '0 0 13 13', width: 12, height: 12, 'aria-hidden': 'true'},
  shape('path', {d: ICONS[name], fill: 'currentColor'}));

/** A captioned table; `numbers`: indices of the columns of numbers. */
export function table(caption, columns, rows, {numbers = []} = {}) {
  return element('section', {class: 'table'}, element('h2', {}, caption),
    element('div', {class: 'scroll'}, element('table', {},
      element('thead', {}, element('tr', {}, ...columns.map((c, i) =>
        element('th', {scope: 'col', class: numbers.includes(i) ? 'number' : null}, c)))),
      element('tbody', {}, ...rows.map((row) => element('tr', {}, ...row.map((cell, i) =>
        element('td', {class: numbers.includes(i) ? 'number' : null}, cell))))))));
}

/** Gives the browser a file to save. */
export function saveFile(name, blob) {
  const url = URL.createObjectURL(blob);
  element('a', {href: url, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
