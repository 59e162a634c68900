// Quantities in words: a number with its unit and an SI prefix, the same in plots, legends and panels.

const MILLI = {m: 1e-3, µ: 1e-6, n: 1e-9};
const KILO = {k: 1e3};

/** Prefixes that a reader of robots' data expects, by unit; a unit that is not here takes none. */
const PREFIXES = {
  m: MILLI, 'm/s': MILLI, 'm/s²': MILLI, rad: MILLI, 'rad/s': MILLI, s: MILLI, A: MILLI,
  N: {...MILLI, ...KILO}, 'N·m': {...MILLI, ...KILO},
};

/** Least stretch of a plot's y axis: less of it is noise, which would fill the plot. */
const LEAST_SPANS = {
  m: 5e-4, 'm/s': 5e-3, 'm/s²': 0.1, rad: 1e-3, 'rad/s': 1e-2, N: 5, 'N·m': 1, A: 0.1, '%': 2, '': 1e-2,
};

/**
 * Finest that a reader of a robot's motion and forces needs, by unit: less is noise or rounding, and reads as 0. It is shown with the
 * prefix and the decimals given.
 */
const FINEST = {
  m: ['m', 2], 'm/s': ['m', 1], 'm/s²': ['', 2], rad: ['m', 2], 'rad/s': ['m', 1], s: ['m', 0], A: ['m', 0], N: ['', 0], 'N·m': ['', 1],
};

export const leastSpan = (unit) => LEAST_SPANS[unit] ?? 0;

/** y range around the data, of `least` at least; what is never negative is not shown as if it were. */
export function paddedRange(low, high, least) {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return [0, least || 1];
  const span = Math.max(high - low, least, 1e-3 * Math.max(Math.abs(low), Math.abs(high)), 1e-12);
  const pad = 0.07 * span;
  const middle = (low + high) / 2;
  const bottom = high - low < span && low >= 0 ? Math.max(0, middle - span / 2) : Math.min(low, middle - span / 2);
  return [bottom - pad, Math.max(high, bottom + span) + pad];
}

/** What a plot of ratios with a limit is drawn up to: a robot that has fallen has ratios beyond any sense. */
export const LIMITS_SHOWN = 5;

/** The end of an axis whose data end at `high` and whose limits are `limits` (empty: none). */
export function limitedEnd(high, limits) {
  const most = limits.reduce((largest, value) => Number.isFinite(value) ? Math.max(largest, Math.abs(value)) : largest, 0);
  return most > 0 ? Math.min(high, LIMITS_SHOWN * most) : high;
}

/** Prefixed units of messages and metrics, as those that PREFIXES knows; every other one stays. */
const PREFIXED = {µs: ['s', 1e-6], ms: ['s', 1e-3], mm: ['m', 1e-3], 'mm/s': ['m/s', 1e-3], mrad: ['rad', 1e-3]};

function basic(unit) {
  const [base, factor] = PREFIXED[unit] ?? [unit, 1];
  return {unit: base, factor};
}

/** So many digits, as short as they can be written; '–' for what is no finite number. */
export function formatNumber(value, digits = 4) {
  if (!Number.isFinite(value)) return '–';
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return String(value);
  const magnitude = Math.abs(value);
  const rounded = Number(value.toPrecision(digits));
  return magnitude < 1e-4 || magnitude >= 1e6 ? rounded.toExponential() : String(rounded);
}

/** {unit, factor}: the prefixed unit in which a value of this size is best read, and what the value is multiplied by. */
export function scaled(size, unit) {
  const base = basic(unit);
  const prefixes = PREFIXES[base.unit];
  const magnitude = Math.abs(size) * base.factor;
  if (!prefixes || !Number.isFinite(magnitude) || magnitude === 0) return base;
  // 0.9996 would be read as 1 with the digits shown: it takes the larger unit.
  const fitting = [['', 1], ...Object.entries(prefixes)].sort((a, b) => b[1] - a[1])
    .find(([, scale]) => magnitude >= 0.9995 * scale);
  const [prefix, scale] = fitting ?? Object.entries(prefixes).sort((a, b) => a[1] - b[1])[0];
  return {unit: prefix + base.unit, factor: base.factor / scale};
}

/**
 * "7.656 µm", "12, 3.4, −0.1 mm" of several values, which share the prefix of the largest; '–' where there is none. `finest`: no finer
 * than FINEST has it: "0.00 mm", "189 N".
 */
export function quantity(values, unit, digits = 4, finest = false) {
  const list = Array.isArray(values) ? values : [values];
  const finite = list.filter(Number.isFinite);
  if (finite.length === 0) return '–';
  const base = basic(unit);
  const [prefix, decimals] = (finest && FINEST[base.unit]) || [];
  const least = prefix === undefined ? 0 : (PREFIXES[base.unit][prefix] ?? 1) / base.factor;
  const size = Math.max(...finite.map(Math.abs));
  const shown = scaled(Math.max(size, least), unit);
  // All of them to the last digit of the largest.
  const wanted = Math.max(0, digits - 1 - Math.floor(Math.log10(size * shown.factor || 1)));
  const places = Math.min(least > 0 ? Math.max(0, Math.round(decimals - Math.log10(least * shown.factor))) : 20, wanted);
  const nothing = least > 0 && size > 0 && size * shown.factor < 0.5 * 10 ** -places;
  const texts = list.map((v) => (nothing && Number.isFinite(v) ? (0).toFixed(places) : formatNumber(!Number.isFinite(v) ? v
    : list.length === 1 && least === 0 ? v * shown.factor : Number((v * shown.factor).toFixed(places)), digits)));
  return shown.unit ? `${texts.join(', ')} ${shown.unit}` : texts.join(', ');
}

/** "42 N" of a vector: whole newtons, which hold still to read. */
export const formatForce = (vector) => vector.every(Number.isFinite) ? `${Math.round(Math.hypot(...vector))} N` : '– N';

const EXPONENT = 1e-3;  // numbers below it are shorter with another prefix

/** A metric's value in its own unit, which its limit has too, unless it is too small to be read in it. */
export const withUnit = (value, unit) => !unit ? formatNumber(value)
  : value !== 0 && Math.abs(value) < EXPONENT ? quantity(value, unit) : `${formatNumber(value)} ${unit}`;
