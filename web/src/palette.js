// Colours and dashes of what plots and pictures show.

/** By role: [light, dark]. */
export const COLORS = {
  computed: ['#1f5fd0', '#6ea8ff'], measured: ['#26272b', '#e6e6e6'], limit: ['#d11f1f', '#ff6b6b'],
  desired: ['#a11fb0', '#e58cff'], truth: ['#0f8a4b', '#3ecf8e'],
  'axis-x': ['#c2410c', '#ff9a4d'], 'axis-y': ['#0f8a4b', '#3ecf8e'], 'axis-z': ['#1f5fd0', '#6ea8ff'],
  'foot-0-measured': ['#86aeea', '#41639c'], 'foot-0-computed': ['#123f94', '#a9ccff'],
  'foot-1-measured': ['#eda27f', '#9c5a33'], 'foot-1-computed': ['#8f2f06', '#ffc499'],
  'hue-0': ['#1f5fd0', '#6ea8ff'], 'hue-1': ['#c2410c', '#ff9a4d'], 'hue-2': ['#0f8a4b', '#3ecf8e'],
  'hue-3': ['#a11fb0', '#e58cff'], 'hue-4': ['#8a6d00', '#e6c84d'], 'hue-5': ['#0e7490', '#5fd3ea'],
  'hue-6': ['#7c2d12', '#d9a083'], 'hue-7': ['#4b5563', '#b3bdcc'],
  // The picture alone has these.
  'measured-mark': ['#1d1d1f', '#f2f2f2'], com: ['#0f8a4b', '#3ecf8e'], capture: ['#8a6d00', '#e6c84d'],
  reach: ['#0e7490', '#5fd3ea'], push: ['#c2410c', '#ff9a4d'], support: ['#5b6675', '#9fb0c5'],
};
const HUES = 8;

const query = matchMedia('(prefers-color-scheme: dark)');
let onPaper = false;
/** While the page is printed it is light: the root element says so to the style, too. */
export function setPaper(on) {
  onPaper = on;
  document.documentElement.toggleAttribute('data-paper', on);
}
export const isDark = () => query.matches && !onPaper;
/** The colour of a role as the page is now. */
export const colorNow = (role) => COLORS[role][isDark() ? 1 : 0];
export const onThemeChange = (listener) => query.addEventListener('change', listener);

/** By what a line is: its dash in the first run, and in the others, of which `k` makes the dashes longer. */
const DASHES = {curve: [undefined, (k) => [3 * k, 3]], desired: [[5, 3], (k) => [5 + 3 * k, 3, 1.5, 3]],
  limit: [[7, 4], (k) => [4 + 3 * k, 3, 1.5, 3, 1.5, 3]]};

/** {color(), dash, width} of a role: "computed", "foot-0-measured", "axis-x-thin", ..., in the run of this place. */
export function styleOf(role, index = 0) {
  const name = role.replace(/-thin$/, '').replace(/\d+$/, (hue) => hue % HUES);
  const kind = name === 'limit' ? 'limit' : name === 'desired' || /^foot-.*-computed$/.test(name) ? 'desired' : 'curve';
  return {color: () => colorNow(name in COLORS ? name : 'computed'),
    dash: index ? DASHES[kind][1](index) : DASHES[kind][0], width: role.endsWith('-thin') || index ? 1 : 1.5};
}

export const cssColor = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
