// The page on paper: every plot drawn, light, as wide as half a page, and the picture as an image.
import {button, element} from './dom.js';
import {setPaper} from './palette.js';

const PLOT_WIDTH = 325;        // CSS px: two beside each other on A4 and on letter
const MOST_ROWS = 30_000;  // of a run whose plots are all drawn in advance: some 100 MB

export class Printer {
  #picture = element('img', {class: 'paper', alt: 'The robot at the time cursor'});

  constructor(grid, scene) {
    Object.assign(this, {grid, scene});
    this.button = button('Print', 'Print the page with all plots (ctrl + P)', () => this.print());
    document.addEventListener('keydown', (e) => {
      if (!(e.ctrlKey || e.metaKey) || e.altKey || e.shiftKey || e.key.toLowerCase() !== 'p') return;
      e.preventDefault();
      this.print();
    });
    addEventListener('beforeprint', () => this.#show(true));
    addEventListener('afterprint', () => this.#show(false));
  }

  async drawAll() {
    for (const panel of this.grid.panels) await panel.draw();
    this.grid.redrawAll();
  }

  async print() {
    await this.drawAll();
    window.print();
  }

  /** So that what the browser's own menu prints has its plots, too. Of a long run they would take too much memory. */
  drawWhenIdle(run) {
    if (run.numRows > MOST_ROWS) return;
    const idle = globalThis.requestIdleCallback ?? ((f) => setTimeout(f, 50));
    const next = () => {
      const panel = this.grid.panels.find((p) => !p.building);
      if (!panel) {
        document.documentElement.dataset.drawn = '';
        return;
      }
      panel.draw().then(() => idle(next));
    };
    idle(next);
  }

  #show(onPaper) {
    setPaper(onPaper);
    this.scene.setTheme();
    this.#picture.remove();
    const url = onPaper && this.scene.imageUrl();
    if (url) {
      this.#picture.src = url;
      document.getElementById('scene-place').prepend(this.#picture);
    }
    for (const panel of this.grid.panels) panel.resize(onPaper ? PLOT_WIDTH : undefined);
    this.grid.restyle();
  }
}
