// What the page of charts draws, worked out of the sets' data (docs/reference/charts.md), without drawing it.

const TOLD = ['stands', 'fell', 'missed'];  // outcomes that tell whether the robot stood

const labelOf = (name, unit) => (unit ? `${name} [${unit}]` : name);
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const finite = Number.isFinite;
const unique = (items) => [...new Set(items)];

/** The value of a row's variable, a choice by its name. */
function valueAt(row, part, name) {
  const i = part.variables.findIndex((v) => v.name === name);
  return part.variables[i].choices?.[row.at[i]] ?? row.at[i];
}

/** Parts of the sets that are of the same, laid over each other: [[{set, part}, ...], ...], by the first set's order. */
export function layersOf(sets) {
  const names = unique(sets.flatMap((set) => set.parts.map((part) => part.name)));
  // Sets of one part each are compared whatever their names are: a sweep, and the same with another controller.
  if (sets.every((set) => set.parts.length === 1)) return [sets.map((set, i) => ({set: i, part: set.parts[0]}))];
  return names.map((name) => sets.flatMap((set, i) => set.parts.filter((part) => part.name === name).map((part) => ({set: i, part}))));
}

/** An axis of a variable: {label, texts} of choices, whose places are their indices; {label} of numbers. */
function axisOf(variable, layers) {
  const label = labelOf(variable.name, variable.unit);
  if (!variable.choices) return {label, at: (value) => value};
  const texts = unique(layers.flatMap(({part}) => part.variables.find((v) => v.name === variable.name).choices));
  return {label, texts, at: (value) => texts.indexOf(value)};
}

/** The same axis with a place for each value that is there. */
function stepped(axis, places, format) {
  if (axis.texts) return axis;
  const numbers = unique(places).sort((a, b) => a - b);
  return {...axis, texts: numbers.map((number) => format(number)), numbers, at: (value) => numbers.indexOf(value)};
}

/** What a place's runs came to: {state, y}; y is the mean of those that are on the scale. */
function stateOf(rows, valueOf, survival) {
  const told = rows.filter((row) => TOLD.includes(row.outcome));
  const off = survival ? [] : told.filter((row) => row.outcome === 'fell');
  const numbers = told.filter((row) => !off.includes(row)).map(valueOf).filter(finite);
  if (told.length === 0) return {state: 'untold'};
  if (off.length === told.length) return {state: 'fell'};
  if (numbers.length === 0) return {state: 'none'};
  return {state: 'value', value: numbers.reduce((sum, v) => sum + v, 0) / numbers.length, someFell: off.length > 0};
}

/**
 * A chart of `map` over the sets' parts (as layersOf gives them): {title, kind, x, y, unit, share, paper, series, marks}. kind: 'points' (value
 * over x), 'cells' (value over x and y by colour) or 'places' (the same of variables that were drawn); `polar`: x is an angle in degrees. A mark
 * is {set, series, rows, x, y, state, value}. Nothing is said of what lies between two marks. null: the sets have no such chart.
 */
export function chartOf(layers, map, format = String) {
  const {part: first} = layers[0];
  let [x, y] = [first.variables[map.x], first.variables[map.y]];
  if (y?.angle && !x.angle) [x, y] = [y, x];
  const value = first.values[map.value];
  const survival = value === undefined;
  const others = first.kind === 'limit' ? first.variables.filter((v) => v !== x) : [];
  const needed = [x, y, ...others].filter(Boolean).map((v) => v.name);
  const shown = layers.filter(({part}) => needed.every((name) => part.variables.some((v) => v.name === name))
    && (survival || part.values.some((v) => v.name === value.name)));
  const kind = !y ? 'points' : x.drawn || y.drawn ? 'places' : 'cells';
  const places = [];
  for (const {set, part} of shown) {
    const column = survival ? -1 : part.values.findIndex((v) => v.name === value.name);
    const valueOf = (row) => (survival ? Number(row.outcome === 'stands') : row.values[column]);
    const groups = new Map();
    for (const row of part.rows) {
      const at = needed.map((name) => valueAt(row, part, name));
      const key = JSON.stringify(at);
      if (!groups.has(key)) groups.set(key, {set, part, column, at, rows: []});
      groups.get(key).rows.push(row);
    }
    for (const group of groups.values()) places.push({...group, ...stateOf(group.rows, valueOf, survival)});
  }
  if (places.length === 0) return null;
  const cells = kind === 'cells', polar = x.angle === true && kind !== 'places';
  let xAxis = axisOf(x, shown), yAxis = y && axisOf(y, shown);
  if (cells) {
    if (!polar) xAxis = stepped(xAxis, places.map((p) => p.at[0]), format);
    yAxis = stepped(yAxis, places.map((p) => p.at[1]), format);
    if (!polar && y.choices) yAxis = {...yAxis, texts: yAxis.texts.toReversed(), at: (value) => yAxis.texts.indexOf(value)};  // the first on top
  }
  const skip = y ? 2 : 1;
  const marks = places.filter((p) => cells || p.state !== 'none').map((p) => ({...p,
    series: others.map((v, i) => (v.choices ? p.at[skip + i] : `${v.name} ${format(p.at[skip + i])}`)).join(', '),
    x: xAxis.at(p.at[0]), y: y ? yAxis.at(p.at[1]) : p.value}));
  const label = survival ? 'share of the runs that stand' : value.unit || value.label;
  return {title: survival ? 'What stands' : capital(value.label), kind, polar, share: survival, unit: value?.unit ?? '', value, paper: value?.paper,
    x: xAxis, y: yAxis ?? {label}, marks, series: unique(marks.map((m) => JSON.stringify([m.set, m.series]))).map((key) => JSON.parse(key)),
    range: rangeOf(marks.map((m) => m.value))};
}

/** Least and largest of the numbers among `values`; [0, 1] of none. */
export function rangeOf(values) {
  const numbers = values.filter(finite);
  if (numbers.length === 0) return [0, 1];
  return numbers.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
}

const SHARE_STOPS = [[213, 94, 0], [242, 228, 190], [0, 114, 178]];                          // none stands, all do
const VALUE_STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];  // viridis

/** The colour of a value of `chart`: from low to high, or of shares from 0 to 1. */
export function colorOf(chart, value) {
  if (!finite(value)) return '#cccccc';
  const [low, high] = chart.share ? [0, 1] : chart.range;
  const stops = chart.share ? SHARE_STOPS : VALUE_STOPS;
  const at = Math.min(Math.max(high > low ? (value - low) / (high - low) : 0.5, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(at), stops.length - 2);
  return `#${stops[i].map((c, k) => Math.round(c + (at - i) * (stops[i + 1][k] - c)).toString(16).padStart(2, '0')).join('')}`;
}

/** Round numbers from 0 to `high` or a little less. */
export function ticksTo(high) {
  const power = 10 ** Math.floor(Math.log10(high / 4));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= high / 4);
  return Array.from({length: Math.floor(high / step + 1e-9)}, (_, i) => Number(((i + 1) * step).toPrecision(12)));
}

/** What a mark says, in lines. `number`: a value with its unit. */
export function linesOf(mark, chart, number) {
  const {part, rows, column} = mark;
  const row = rows[0];
  const value = chart.value && `${chart.value.label}: `;
  if (rows.length > 1) {
    const count = (keep) => rows.filter(keep).length;
    const off = count((r) => r.outcome === 'fell' || r.outcome === 'missed'), untold = count((r) => !TOLD.includes(r.outcome));
    return [`${rows.length} runs`, off && `${off} did not stand`, untold && `${untold} do not tell`,
      `${value ?? ''}mean ${finite(mark.value) ? number(mark.value, chart.unit) : 'none'}`].filter(Boolean);
  }
  return [part.kind !== 'matrix' && `run ${row.run}`,
    ...part.variables.map((v) => {
      const at = valueAt(row, part, v.name);
      return `${labelOf(v.name, v.unit)}: ${typeof at === 'number' ? number(at, '') : at}`;
    }),
    row.told, value && finite(row.values[column]) && value + number(row.values[column], chart.unit)].filter(Boolean);
}

/** The command that makes a row's run again; '' where there is none. */
export const commandOf = (part, row) => (row.set === undefined ? '' : part.command + row.set);
