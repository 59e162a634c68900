// `poise robot check --page` in a browser: meshes and solids lie where their files say, and what is missing is told.
// Usage: node robot_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdirSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage} from './browser.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-robot-'));
const path = (name) => join(folder, name);
const heron = (ending) => readFileSync(fileURLToPath(new URL(`../../deploy/robots/heron/heron.${ending}`, import.meta.url)), 'utf8');
let browser;

before(async () => { browser = await launchBrowser(options.web); });
after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

const near = (actual, expected, tolerance) => actual.forEach((x, i) =>
  assert.ok(Math.abs(x - expected[i]) < tolerance, `${actual} is not ${expected}`));

function check(robot, ...more) {
  const {status, stdout, stderr} = spawnSync(options.poise, ['robot', 'check', robot, ...more], {encoding: 'utf8'});
  assert.ok(status === 0 || status === 1, stderr);
  return stdout;
}

/** Corners and triangles of a box from `low` to `high`, the second one written out. */
function box(low, high) {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((c) => [0, 1, 2].map((i) => (c >> i & 1 ? high[i] : low[i])));
  const quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
  return {corners, triangles: quads.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]])};
}

function stl({corners, triangles}) {
  const vertex = (i) => `vertex ${corners[i].join(' ')}\n`;
  return `solid box\n${triangles.map((t) => `facet normal 0 0 0\nouter loop\n${t.map(vertex).join('')}endloop\nendfacet\n`).join('')}endsolid box\n`;
}

const obj = ({corners, triangles}) => corners.map((c) => `v ${c.join(' ')}\n`).join('') + triangles.map((t) => `f ${t.map((i) => i + 1).join(' ')}\n`).join('');

/** COLLADA that says of itself what up is: robots' files have z up all the same. */
const dae = ({corners, triangles}, up) => `<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>${up}</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="24">${corners.flat().join(' ')}</float_array><technique_common>
<accessor source="#a" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>${triangles.flat().join(' ')}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>`;

/** A sphere of n·n·2 triangles, as binary STL. */
function sphere(n, radius) {
  const data = Buffer.alloc(84 + 100 * n * n);
  data.writeUInt32LE(2 * n * n, 80);
  const at = (i, j) => [Math.sin(Math.PI * i / n) * Math.cos(2 * Math.PI * j / n), Math.sin(Math.PI * i / n) * Math.sin(2 * Math.PI * j / n),
    Math.cos(Math.PI * i / n)].map((x) => Math.fround(radius * x));
  let place = 84;
  for (let i = 0; i < n; ++i) {
    for (let j = 0; j < n; ++j) {
      for (const t of [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]) {
        t.flat().forEach((x, k) => data.writeFloatLE(x, place + 12 + 4 * k));
        place += 50;
      }
    }
  }
  return data;
}

/** heron with the first visual shape of some links put in place of its own. */
function writeRobot(name, visuals) {
  mkdirSync(path(`${name}/meshes`), {recursive: true});
  let urdf = heron('urdf');
  for (const [link, geometry] of Object.entries(visuals)) {
    const place = new RegExp(`(<link name="${link}">[^]*?<visual>\\s*)(?:<origin[^>]*>\\s*)?<geometry>.*?</geometry>`);
    assert.match(urdf, place);
    urdf = urdf.replace(place, `$1<origin xyz="0.1 0.2 0.3"/><geometry>${geometry}</geometry>`);
  }
  writeFileSync(path(`${name}/heron.urdf`), urdf);
  writeFileSync(path(`${name}/heron.pbtxt`), heron('pbtxt'));
  return path(`${name}/heron.pbtxt`);
}

/** What is drawn of a body's meshes: their boxes, in its frame, m. */
const meshBoxes = (page, body) => page.evaluate((name) => {
  const {robotView: view} = window.poise.still;
  const {visuals, bodies} = view.robot;
  const b = bodies.findIndex((x) => x.name === name);
  return view.groups[b].children.filter((o) => o.isMesh && visuals.some((v) => v.shape === 'mesh' && v.body === b)
    && o.material === view.meshMaterial).map((o) => {
    o.geometry.computeBoundingBox();
    const {min, max} = o.geometry.boundingBox;
    return [min, max].map((p) => p.clone().multiply(o.scale).applyQuaternion(o.quaternion).add(o.position).toArray());
  });
}, body);

test('meshes of each format lie where their files say; what is missing is told', async () => {
  const low = [-0.01, 0.02, 0.03], high = [0.05, 0.06, 0.13];
  const robot = writeRobot('meshes', {
    right_thigh: '<mesh filename="package://heron_description/meshes/box.stl" scale="0.001 0.001 0.001"/>',
    left_thigh: '<mesh filename="meshes/box.obj"/>',
    right_shank: '<mesh filename="file://meshes/up_y.dae"/>', left_shank: '<mesh filename="meshes/up_z.dae" scale="1 -1 1"/>',
    torso: '<mesh filename="package://nobody/torso.stl"/>', head: '<mesh filename="meshes/broken.stl"/>',
  });
  const mesh = (name, text) => writeFileSync(path(`meshes/meshes/${name}`), text);
  mesh('box.stl', stl(box(low.map((x) => 1000 * x), high.map((x) => 1000 * x))));
  mesh('box.obj', obj(box(low, high)));
  mesh('up_y.dae', dae(box(low, high), 'Y_UP'));
  mesh('up_z.dae', dae(box(low, high), 'Z_UP'));
  mesh('broken.stl', 'solid broken\nfacet normal 0');
  const text = check(robot, '--page', path('meshes.html')).replace(/\s+/g, ' ');
  assert.match(text, /1 mesh of the file was not found \(package:\/\/nobody\/torso\.stl\)/);
  assert.match(text, /1 could not be read \(meshes\/broken\.stl: /);
  const {page, problems} = await openPage(browser, path('meshes.html'));
  for (const body of ['right_thigh', 'left_thigh', 'right_shank', 'left_shank']) {
    const boxes = await meshBoxes(page, body);
    assert.equal(boxes.length, 1, body);
    const mirrored = body === 'left_shank';
    const corners = [low, high].map(([x, y, z]) => [x + 0.1, (mirrored ? -y : y) + 0.2, z + 0.3]);
    near(boxes[0].flat(), corners.flat(), 2e-5);
  }
  assert.deepEqual(await meshBoxes(page, 'torso'), []);
  // Capsules stand for those alone that lack something.
  const names = await page.evaluate(() => window.poise.data.robot.capsules.map((b) => window.poise.data.robot.bodies[b].name));
  assert.deepEqual(names.sort(), ['head', 'torso']);
  assert.match(await page.locator('[role=note]').textContent(), /torso\.stl/);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('soles are shown with their corners and sizes, on ground whose horizon is no edge', async () => {
  // As the robot's text has them, mm.
  const told = [...heron('pbtxt').matchAll(/^foot \{[^]*?^\}/gm)].map(([foot]) =>
    [...foot.matchAll(/vertex \{ x: (\S+) y: (\S+) \}/g)].map(([, x, y]) => [1e3 * x, 1e3 * y]));
  assert.deepEqual(told.map((corners) => corners.length), [8, 8]);
  check('heron/heron', '--page', path('soles.html'));
  for (const colorScheme of ['light', 'dark']) {
    const {page, problems} = await openPage(browser, path('soles.html'), {colorScheme});
    const {drawn, sizes} = await page.evaluate(() => {
      const {layers: {soles}, labels, robotView, scene} = window.poise.still;
      scene.updateMatrixWorld(true);
      const feet = soles.children.filter((o) => o.isGroup);
      return {sizes: labels.map(({label}) => label.shown), drawn: feet.map((foot, f) => {
        const dots = foot.children[0].children.filter((o) => o.isMesh);
        return dots.map((dot) => {
          const at = dot.getWorldPosition(dot.position.clone());
          return [at.z, ...robotView.groups[robotView.robot.feet[f].body].worldToLocal(at).toArray()];
        });
      })};
    });
    assert.deepEqual(sizes, ['220 × 92 mm', '220 × 92 mm']);
    drawn.forEach((corners, f) => {
      near(corners.map(([z]) => z), corners.map(() => 0), 1e-3);  // on the ground
      // The sole's frame lies 30 mm before the foot's, which turns as it does.
      const places = corners.map(([, x, y]) => [1e3 * (x - 0.03), 1e3 * y]);
      for (const [x, y] of told[f]) assert.ok(places.some((p) => Math.hypot(p[0] - x, p[1] - y) < 0.01), `${x}, ${y} of ${places.join('; ')}`);
    });
    const numbers = await page.locator('.soles text').allTextContents();
    for (const [x, y] of told.flat()) assert.ok(numbers.includes(`${x}, ${y}`), `${x}, ${y} of ${numbers.join('; ')}`);
    // Down the picture's side no line differs from the next by more than one can see.
    const steps = await page.evaluate(async () => {
      const {still} = window.poise;
      still.grid.visible = false;
      const image = Object.assign(new Image(), {src: still.imageUrl()});
      await image.decode();
      const pen = new OffscreenCanvas(1, image.height).getContext('2d');
      pen.drawImage(image, -8, 0);
      const {data} = pen.getImageData(0, 0, 1, image.height);
      const reds = Array.from({length: image.height}, (_, y) => data[4 * y]);
      return {range: Math.max(...reds) - Math.min(...reds), largest: Math.max(...reds.slice(1).map((red, y) => Math.abs(red - reds[y])))};
    });
    assert.ok(steps.range >= 5 && steps.largest <= 2, JSON.stringify(steps));
    assert.deepEqual(problems, []);
    await page.context().close();
  }
});

test('a sole that is a guess is told beside its picture and in the table', async () => {
  const robot = writeRobot('guess', {});
  writeFileSync(robot, heron('pbtxt').replace('name: "left"', 'name: "left" guessed: true'));
  check(robot, '--page', path('guess.html'));
  const {page} = await openPage(browser, path('guess.html'));
  const told = async (selector) => (await page.locator(selector).allTextContents()).filter((text) => /guess/.test(text));
  for (const selector of ['.soles figcaption', '#tables tr']) {
    const [text, ...more] = await told(selector);
    assert.match(text, /^left/, selector);
    assert.equal(more.length, 0, selector);
  }
  await page.context().close();
});

test('a mesh of half a million triangles is drawn with few, in its place', async () => {
  // A folder told finds it, whatever folders its name begins with.
  const robot = writeRobot('large', {torso: '<mesh filename="package://nobody/large.stl"/>'});
  mkdirSync(path('elsewhere'));
  writeFileSync(path('elsewhere/large.stl'), sphere(500, 0.15));
  assert.doesNotMatch(check(robot, '--page', path('large.html'), '--meshes', path('elsewhere')), /not found/);
  assert.ok(statSync(path('large.html')).size < 3e6, `${statSync(path('large.html')).size} bytes`);
  const {page, problems} = await openPage(browser, path('large.html'));
  const {radii, triangles} = await page.evaluate(() => {
    const {robotView: view} = window.poise.still;
    const mesh = view.groups.flatMap((g) => g.children).find((o) => o.material === view.meshMaterial);
    const {position} = mesh.geometry.attributes;
    const of = Array.from({length: position.count}, (_, i) => Math.hypot(position.getX(i), position.getY(i), position.getZ(i)));
    return {radii: [Math.min(...of), Math.max(...of)], triangles: mesh.geometry.index.count / 3};
  });
  assert.ok(triangles > 5000 && triangles <= 60000, `${triangles} triangles`);
  near(radii, [0.15, 0.15], 2e-3);
  assert.match(await page.locator('[role=note]').textContent(), /500000 triangles/);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('the solids of an MJCF file are drawn', async () => {
  mkdirSync(path('mjcf'));
  const capsule = '<geom type="capsule" fromto="0 0 0.1 0 0 0.3" size="0.04" contype="0" conaffinity="0" mass="0"/>';
  const xml = heron('xml');
  const at = xml.search(/<geom [^>]*>/);  // of the root body
  writeFileSync(path('mjcf/heron.xml'), xml.slice(0, at) + capsule + xml.slice(at));
  const imported = spawnSync(options.poise, ['robot', 'import', path('mjcf/heron.xml'), '--to', path('mjcf')], {encoding: 'utf8'});
  assert.equal(imported.status, 0, imported.stderr);
  check(path('mjcf/heron.pbtxt'), '--page', path('mjcf.html'));
  const {page, problems} = await openPage(browser, path('mjcf.html'));
  const {visuals, root} = await page.evaluate(() => ({visuals: window.poise.data.robot.visuals, root: window.poise.data.robot.bodies[0].name}));
  assert.equal(root, 'pelvis');
  const drawn = visuals.find((v) => v.shape === 'capsule');
  near([drawn.radius, drawn.length, ...drawn.pose.position], [0.04, 0.2, 0, 0, 0.2], 1e-9);
  // The root shows what it is said to show, the others what they collide with: MJCF sizes are halves.
  const geoms = [...xml.slice(at).matchAll(/<geom type="box" size="([^"]*)"/g)].slice(1).map(([, size]) => size.split(' ').map((s) => 2 * s));
  const boxes = visuals.filter((v) => v.shape === 'box').map((v) => v.size);
  assert.equal(boxes.length, geoms.length);
  for (const size of geoms) assert.ok(boxes.some((b) => b.every((x, i) => Math.abs(x - size[i]) < 1e-9)), `${size}`);
  assert.deepEqual(problems, []);
  await page.context().close();
});
