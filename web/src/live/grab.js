// Drag on the robot: the point that was grabbed is pulled towards the cursor.
import {Plane, Raycaster, Vector2, Vector3} from 'three';
import {Hand, springForce} from './control.js';
import {element} from '../dom.js';
import {Arrow} from '../picture/markers.js';
import {formatForce} from '../units.js';
import {colorNow} from '../palette.js';

const METRES_PER_NEWTON = 1 / 600;

/**
 * Lets the mouse pull the robot of `scene`; `mayPush`: whether a drag on it is one now. Gives what shows the pull with
 * the pose that is shown now.
 */
export function grabbing(scene, control, mayPush) {
  const hand = new Hand(control);
  const {canvas} = scene;
  const ray = new Raycaster();
  const plane = new Plane();
  const grabbed = new Vector3(), cursor = new Vector3(), towards = new Vector3(), local = new Vector3();
  const arrow = new Arrow(0, 0.014);
  arrow.object.visible = false;
  scene.scene.add(arrow.object);
  const number = element('output', {class: 'force', hidden: true});
  scene.host.append(number);
  const robot = scene.robotView;
  let group, pointer;

  const aim = (event) => {
    const box = canvas.getBoundingClientRect();
    ray.setFromCamera(new Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height),
      scene.camera);
  };
  const bodyOf = (object) => {
    const b = robot.groups.indexOf(object);
    return b >= 0 || !object.parent ? b : bodyOf(object.parent);
  };

  const down = (event) => {
    if (event.button !== 0 || event.target !== canvas || !mayPush()) return;
    scene.renderNow();  // matrices of the pose that is seen
    aim(event);
    const hit = ray.intersectObject(robot.object, true)[0];
    const body = hit ? bodyOf(hit.object) : -1;
    if (body < 0) return;
    event.stopPropagation();  // the view does not turn
    event.preventDefault();
    group = robot.groups[body];
    local.copy(group.worldToLocal(hit.point.clone()));
    scene.camera.getWorldDirection(towards);
    plane.setFromNormalAndCoplanarPoint(towards, hit.point);
    cursor.copy(hit.point);
    pointer = event.pointerId;
    canvas.setPointerCapture(pointer);
    canvas.classList.add('grabbing');
    hand.take(robot.robot.bodies[body].name, local.toArray());
    arrow.material.color.set(colorNow('push'));
    number.hidden = false;
    show();
  };
  const move = (event) => {
    if (event.pointerId !== pointer) return;
    event.stopPropagation();
    aim(event);
    ray.ray.intersectPlane(plane, cursor);
    show();
  };
  const up = (event) => {
    if (event.pointerId !== pointer) return;
    event.stopPropagation();
    release();
  };
  const release = () => {
    pointer = undefined;
    hand.letGo();
    canvas.classList.remove('grabbing');
    arrow.object.visible = false;
    number.hidden = true;
    scene.draw();
  };

  const show = () => {
    if (!hand.holds) return;
    grabbed.copy(local);
    group.localToWorld(grabbed);
    const force = springForce(grabbed.toArray(), cursor.toArray(), control.standing.push_limit);
    hand.pull(force);
    arrow.set(grabbed.toArray(), force.map((f) => f * METRES_PER_NEWTON));
    const {samples, row} = scene;
    const inForce = control.standing.push?.force ?? [0];
    const [asked, applied, measured] = [force, inForce, samples.vector('push', row)].map(formatForce);
    number.textContent = `asked ${asked}, in force ${applied}, measured ${measured}`;
    scene.draw();
  };

  // Before the controls of the view, which listen on the canvas itself.
  scene.host.addEventListener('pointerdown', down, {capture: true});
  scene.host.addEventListener('pointermove', move, {capture: true});
  for (const name of ['pointerup', 'pointercancel']) scene.host.addEventListener(name, up, {capture: true});
  addEventListener('blur', () => { if (hand.holds) release(); });
  document.addEventListener('keydown', (event) => { if (event.key === 'Escape' && hand.holds) release(); });
  return show;
}
