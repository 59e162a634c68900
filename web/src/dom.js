// Small helpers for the page's elements. Texts of a log are set as text only, never as HTML.

function filled(result, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') result.addEventListener(name, value);
    else if (value === true) result.setAttribute(name, '');
    else if (value !== false && value !== undefined && value !== null) result.setAttribute(name, value);
  }
  result.append(...children.filter((c) => c !== null && c !== undefined && c !== ''));
  return result;
}

/** An element with attributes (functions: event listeners by name) and children (elements or texts). */
export const element = (tag, attributes = {}, ...children) => filled(document.createElement(tag), attributes, children);

/** The same for a picture's shapes. */
export const shape = (tag, attributes = {}, ...children) =>
  filled(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);

/** A button with a text or an icon; `title` stands under the mouse. */
export const button = (text, title, click, more = {}) =>
  element('button', {type: 'button', title, click, ...more}, text);

/** A button whose text is a sign or short: its title is also what is read aloud. */
export const signButton = (sign, title, click) => button(sign, title, click, {'aria-label': title});

/** `change(on)` when it is switched. */
export const checkbox = (label, checked, change) => element('label', {},
  element('input', {type: 'checkbox', checked, change: (e) => change(e.target.checked)}), label);

/** Does `actions` by key, but not for whoever writes, or presses what has the focus with the space bar. */
export function onKeys(actions) {
  document.addEventListener('keydown', (e) => {
    const writing = e.target.matches('input:not([type=range], [type=checkbox]), select, textarea');
    const pressing = e.key === ' ' && e.target.matches('button, summary, a, [type=checkbox]');
    if (writing || pressing || e.ctrlKey || e.metaKey || e.altKey || !Object.hasOwn(actions, e.key)) return;
    e.preventDefault();
    actions[e.key](e);
  });
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

const PNG_PIXELS = 2;  // for each of a picture's units: sharp in print

/** The SVG `text` of `width` by `height` as PNG, on `paper` where it is clear. */
export async function pngOf(text, width, height, paper) {
  const image = Object.assign(new Image(width, height), {src: `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`});
  await image.decode();
  const canvas = element('canvas', {width: Math.round(PNG_PIXELS * width), height: Math.round(PNG_PIXELS * height)});
  const context = canvas.getContext('2d');
  context.fillStyle = paper;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((done, failed) => canvas.toBlob((blob) => blob ? done(blob)
    : failed(new Error('the browser cannot write this picture as PNG')), 'image/png'));
}

/** Gives the browser a file to save. */
export function saveFile(name, blob) {
  const url = URL.createObjectURL(blob);
  element('a', {href: url, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** Gives the browser a file, called after what it shows. */
export function saveNamed(what, ending, blob) {
  const name = what.toLowerCase().normalize('NFKD').replace(/[^a-z0-9.]+/g, '-').replace(/^-|-$/g, '').slice(0, 80);
  saveFile(`${name || 'plot'}.${ending}`, blob);
}
