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

/** So many digits, as short as they can be written. */
export function formatNumber(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return '–';
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return String(value);
  const magnitude = Math.abs(value);
  const rounded = Number(value.toPrecision(digits));
  return magnitude < 1e-4 || magnitude >= 1e6 ? rounded.toExponential() : String(rounded);
}

export const withUnit = (value, unit) => unit ? `${formatNumber(value)} ${unit}` : formatNumber(value);

/** Gives the browser a file to save. */
export function saveFile(name, blob) {
  const url = URL.createObjectURL(blob);
  element('a', {href: url, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
