// The page on paper: every plot drawn, light, as wide as half a page, and the picture as an image.
import {element} from './dom.js';
import {setPaper} from './palette.js';

const PLOT_WIDTH = 325;        // CSS px: two beside each other on A4 and on letter
const MOST_ROWS = 30_000;  // of a run whose plots are all drawn in advance: some 100 MB

export class Printer {
  #picture = element('img', {class: 'paper', alt: 'The robot at the time cursor'});

  constructor(grid, scene) {
    Object.assign(this, {grid, scene});
    this.button = element('button', {type: 'button', title: 'Print the page with all plots (ctrl + P)',
      click: () => this.print()}, 'Print');
    document.addEventListener('keydown', (e) => {
      if (!(e.ctrlKey || e.metaKey) || e.altKey || e.shiftKey || e.key.toLowerCase() !== 'p') return;
      e.preventDefault();
      this.print();
    });
    addEventListener('beforeprint', () => this.#toPaper());
    addEventListener('afterprint', () => this.#toScreen());
  }

  async drawAll() {
    for (const panel of this.grid.panels) await panel.show().catch((error) => panel.fail(error));
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
      panel.show().catch((error) => panel.fail(error)).then(() => idle(next));
    };
    idle(next);
  }

  #toPaper() {
    setPaper(true);
    this.scene.setTheme();
    const url = this.scene.imageUrl();
    if (url) {
      this.#picture.src = url;
      document.getElementById('scene-place').prepend(this.#picture);
    }
    for (const panel of this.grid.panels) panel.resize(PLOT_WIDTH);
    this.grid.restyle();
  }

  #toScreen() {
    setPaper(false);
    this.#picture.remove();
    this.scene.setTheme();
    for (const panel of this.grid.panels) panel.resize();
    this.grid.restyle();
  }
}
