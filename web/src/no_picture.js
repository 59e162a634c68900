// What stands in the 3D picture's place in a browser without WebGL, so that the rest of the page is there.
import {element} from './dom.js';

/** Whether this browser draws in 3D: a remote desktop or a locked-down machine may not. */
export function has3D() {
  const context = document.createElement('canvas').getContext('webgl2');
  context?.getExtension('WEBGL_lose_context')?.loseContext();
  return context !== null;
}

/** SceneView's methods, with a sentence instead of a picture. */
export class NoPicture {
  constructor(host) {
    Object.assign(this, {host, visible: false});
    host.append(element('p', {class: 'note', role: 'note'}, 'No picture of the robot: this browser has no WebGL 2. Everything else of this page is here.'));
    host.classList.add('no-picture');
  }

  async load() {}
  setRow() {}
  pace() {}
  setTheme() {}
  imageUrl() {}
}
