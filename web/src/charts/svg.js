// A plot of uPlot's as SVG: what it draws on its canvas is written down while it is drawn once more.

const TITLE_LINE = 18;  // CSS px
const MARGIN = 10;

const escaped = (text) => String(text).replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
const short = (number) => Number(number.toFixed(2));
const ANCHORS = {center: 'middle', right: 'end', end: 'end'};
const BASELINES = {middle: 'central', top: 'text-before-edge', bottom: 'text-after-edge'};

/** The elements that `draw` draws on `ctx`. Of paths it knows lines, arcs and rectangles. */
function elementsOf(ctx, draw) {
  const out = [];
  let path = '';
  const common = () => {
    const m = ctx.getTransform();
    return (m.isIdentity ? '' : ` transform="matrix(${[m.a, m.b, m.c, m.d, m.e, m.f].map(short).join(' ')})"`)
      + (ctx.globalAlpha < 1 ? ` opacity="${short(ctx.globalAlpha)}"` : '');
  };
  const to = (x, y) => `${short(x)} ${short(y)}`;
  const box = (x, y, w, h) => `M${to(x, y)}h${short(w)}v${short(h)}h${short(-w)}Z`;
  const recorder = {
    clearRect() {},
    beginPath() { path = ''; },
    closePath() { path += 'Z'; },
    moveTo(x, y) { path += `M${to(x, y)}`; },
    lineTo(x, y) { path += `L${to(x, y)}`; },
    rect(x, y, w, h) { path += box(x, y, w, h); },
    arc(x, y, r, from, end, counter = false) {
      const at = (angle) => to(x + r * Math.cos(angle), y + r * Math.sin(angle));
      const turn = end - from, whole = Math.abs(turn) > 2 * Math.PI - 1e-6;
      path += `${path && !path.endsWith('Z') ? 'L' : 'M'}${at(from)}`;
      for (const [begin, stop] of whole ? [[from, from + turn / 2], [from + turn / 2, end]] : [[from, end]]) {
        path += `A${short(r)} ${short(r)} 0 ${Math.abs(stop - begin) > Math.PI + 1e-6 ? 1 : 0} ${counter ? 0 : 1} ${at(stop)}`;
      }
    },
    fill() { out.push(`<path d="${path}" fill="${ctx.fillStyle}"${common()}/>`); },
    stroke() {
      const dash = ctx.getLineDash();
      out.push(`<path d="${path}" fill="none" stroke="${ctx.strokeStyle}" stroke-width="${short(ctx.lineWidth)}"`
        + `${dash.length ? ` stroke-dasharray="${dash.join(' ')}"` : ''}${common()}/>`);
    },
    fillRect(x, y, w, h) { out.push(`<path d="${box(x, y, w, h)}" fill="${ctx.fillStyle}"${common()}/>`); },
    fillText(text, x, y) {
      out.push(`<text x="${short(x)}" y="${short(y)}" fill="${ctx.fillStyle}" style="font:${escaped(ctx.font)}" text-anchor="${ANCHORS[ctx.textAlign]
        ?? 'start'}" dominant-baseline="${BASELINES[ctx.textBaseline] ?? 'auto'}"${common()}>${escaped(text)}</text>`);
    },
  };
  Object.assign(ctx, recorder);  // before the prototype's own
  try {
    draw();
  } finally {
    for (const name of Object.keys(recorder)) delete ctx[name];
  }
  return out;
}

/** `title` in lines of `width` px. */
function titleLines(title, width) {
  const lines = [''];
  for (const word of title.split(' ')) {
    const longer = `${lines.at(-1)} ${word}`.trim();
    if (longer.length * 7.5 > width && lines.at(-1)) lines.push(word);
    else lines[lines.length - 1] = longer;
  }
  return lines;
}

/** The plot `u` with its title above, on paper of the colour `paper`; {text, width, height}, px. */
export function svgOf(u, title, {paper, ink}) {
  const {ctx} = u, {width, height} = ctx.canvas, zoom = width / u.width;
  const lines = titleLines(title, u.width - 2 * MARGIN);
  const top = (lines.length * TITLE_LINE + MARGIN) * zoom;
  const elements = elementsOf(ctx, () => u.batch(() => u.redraw(false, true)));
  const text = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 ${short(-top)} ${width} ${short(height + top)}" width="${u.width}" height="${short(u.height + top / zoom)}">`
    + `<path d="M0 ${short(-top)}h${width}V${height}H0Z" fill="${paper}"/>`
    + lines.map((line, i) => `<text x="${MARGIN * zoom}" y="${short(-top + (i + 0.9) * TITLE_LINE * zoom)}" fill="${ink}" style="font:600 ${13 * zoom}px system-ui,sans-serif">${escaped(line)}</text>`).join('')
    + `${elements.join('\n')}</svg>\n`;
  return {text, width: u.width, height: u.height + top / zoom};
}
