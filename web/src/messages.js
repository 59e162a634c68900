// Units, texts and names of constants of the messages' fields, read from the comments of the .lcm files: of Poise's own when
// the page is built, of a module's where it is shown.

const UNITS = ['m/s^2', 'rad/s', 'm/s', 'N·m', 'rad', 'us', 'm', 'N', 'A', 's', '%'];

const SCALARS = new Set(['int8_t', 'byte', 'boolean', 'int16_t', 'int32_t', 'int64_t', 'float', 'double', 'string']);

/** The unit that a field's comment begins with; '' when it begins with none. */
function unitOf(comment) {
  const unit = UNITS.find((u) => comment === u || /^[,;:( ]/.test(comment.slice(u.length)) && comment.startsWith(u));
  return unit === 'm/s^2' ? 'm/s²' : unit === 'us' ? 'µs' : unit ?? '';
}

/**
 * {name, text, fields: {field: {type, unit, text, count, values}}} of one .lcm file; count: 'num_joints' or the like, of a
 * list of such length; values: names by number.
 */
export function parseMessage(source) {
  const [, own] = /^package\s+([\w.]+);/m.exec(source) ?? [];
  const full = (type, of = own) => (of === undefined || of === 'poise' ? type : `${of}.${type}`);
  const name = full(/^struct\s+(\w+)/m.exec(source)[1]);
  const head = source.slice(0, source.indexOf('struct'));
  const text = [...head.matchAll(/^\/\/\s?(.*)$/gm)].map((m) => m[1]).join(' ');
  const fields = {};
  for (const m of source.matchAll(/^\s+([\w.]+)\s+(\w+)(?:\[(\w+)\])?;[ \t]*(?:\/\/[ \t]*(.*))?$/gm)) {
    const comment = m[4] ?? '';
    const dot = m[1].lastIndexOf('.');
    const type = SCALARS.has(m[1]) ? m[1] : dot < 0 ? full(m[1]) : full(m[1].slice(dot + 1), m[1].slice(0, dot));
    fields[m[2]] = {type, unit: unitOf(comment), text: comment, count: /^num_/.test(m[3] ?? '') ? m[3] : undefined};
  }
  const code = source.replace(/\/\/.*$/gm, '');
  const constants = [...code.matchAll(/\bconst\s+\w+\s+([^;]+);/g)]
    .flatMap((m) => m[1].split(',')).map((c) => c.split('=').map((s) => s.trim()));
  for (const field of Object.values(fields)) {
    const prefix = /\b([A-Z]+(?:_[A-Z]+)*_)\*/.exec(field.text)?.[1];
    if (!prefix) continue;
    field.values = Object.fromEntries(constants.filter(([n]) => n.startsWith(prefix))
      .map(([n, value]) => [value, n.slice(prefix.length).toLowerCase().replaceAll('_', ' ')]));
  }
  return {name, text, fields};
}
