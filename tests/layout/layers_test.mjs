// The house keeps its order: every folder includes only what stands below it. docs/reference/architecture.md has the folders' table. Usage: node --test layers_test.mjs
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {test} from 'node:test';
import {repositoryFiles, root} from '../docs/markdown.mjs';

const files = repositoryFiles().filter((f) => !/^(tests|examples)\//.test(f));  // examples: users' own projects
const sources = files.filter((f) => /\.(h|cc|proto)$/.test(f));

const BUS = ['lcmtypes', 'components/framework', 'components/framework/configuration', 'components/framework/bus', 'components/framework/runners',
  'components/robot', 'components/robot_files', 'components/balance', 'components/balance/step', 'components/balance/tasks', 'components/balance/gains', 'components/messages'];
/** A folder (the longest that fits counts) and those whose files it may include, besides its own. */
const BELOW = {
  'lcmtypes': [],
  'components/framework/configuration': [],
  'components/framework': ['lcmtypes', 'components/framework/configuration'],
  'components/framework/bus': ['lcmtypes', 'components/framework', 'components/framework/configuration'],
  'components/framework/runners': ['lcmtypes', 'components/framework', 'components/framework/configuration', 'components/framework/bus'],
  'components/robot': [],
  'components/robot_files': ['components/framework/configuration', 'components/robot'],
  'components/balance': ['components/robot'],
  'components/balance/step': ['components/robot', 'components/balance'],
  'components/balance/tasks': ['components/robot', 'components/balance'],
  'components/balance/gains': ['components/robot', 'components/balance', 'components/balance/tasks'],
  'components/messages': ['lcmtypes', 'components/framework', 'components/framework/configuration', 'components/robot', 'components/robot_files', 'components/balance'],
  'components': BUS,
  'components/step_planner/contact': BUS,
  'components/step_planner/legs': BUS,
  'components/step_planner/stepping': [...BUS, 'components/step_planner/contact', 'components/step_planner/legs'],
  'sim': BUS,
  'sim_ode': [...BUS, 'sim'],
  'sim_mujoco': [...BUS, 'sim'],
  'hw_bridge': [...BUS, 'hw_bridge/drive', 'hw_bridge/ethercat', 'hw_bridge/unitree'],
  'hw_bridge/drive': BUS,
  'hw_bridge/unitree': [...BUS, 'hw_bridge/drive'],
  'hw_bridge/unitree_emulator': [...BUS, 'hw_bridge/drive', 'hw_bridge/unitree'],
  'hw_bridge/ethercat': [...BUS, 'hw_bridge/drive', 'hw_bridge/ethercat/links'],
  'hw_bridge/ethercat/links': BUS,
  'hw_bridge/ethercat/emulator': [...BUS, 'hw_bridge/ethercat', 'hw_bridge/ethercat/links'],
  'hw_bridge/drive_emulator': [...BUS, 'hw_bridge/ethercat', 'hw_bridge/ethercat/links', 'hw_bridge/ethercat/emulator'],
  'logging': BUS,
  'logging/recording': [...BUS, 'logging'],
  'logging/derived': [...BUS, 'logging'],
  'logging/metrics': [...BUS, 'logging', 'logging/derived'],
  'logging/events': [...BUS, 'logging', 'logging/derived', 'logging/metrics'],
  'logging/export': [...BUS, 'logging', 'logging/derived'],
  'logging/replay': [...BUS, 'logging'],
  'python': [...BUS, 'python', 'logging', 'logging/derived', 'logging/events', 'logging/metrics', 'logging/recording', 'tools/cli', 'tools/scenario', 'tools/report', 'tools/operator', 'tools/run'],
  'python/bindings': [...BUS, 'python', 'python/bindings', 'sim', 'logging', 'logging/metrics', 'tools/scenario', 'tools/report', 'tools/run'],
};
/** The libraries of `poise`, each of which uses only those before it. */
const TOOLS = ['cli', 'reference', 'scenario', 'host', 'robot', 'robot_import', 'report', 'operator', 'run', 'foxglove', 'ros2', 'live', 'sweep', 'charts', 'benchmark', 'commands'];
/** Folders that one file may name although it is not below them: where all processes are listed. */
const REGISTRY = ['tools/scenario/registry.cc', 'tools/scenario/scenario.proto'];

const folderOf = (path) => path.slice(0, path.lastIndexOf('/'));
const within = (path, folder) => path.startsWith(folder + '/');
const isPart = (folder) => /^components\/\w+$/.test(folder) && !BUS.includes(folder);

/** Why `file` may not include `path`; null when it may. */
function problemOf(file, path) {
  const own = folderOf(file), other = folderOf(path);
  if (own === other) return null;
  const tool = /^tools\/(\w+)/.exec(own);
  if (own === 'tools' || tool) {
    const at = /^tools\/(\w+)/.exec(other);
    if (!at || !tool) return null;
    return TOOLS.indexOf(at[1]) < TOOLS.indexOf(tool[1]) ? null : `tools/${at[1]} stands above tools/${tool[1]}`;
  }
  const rule = Object.keys(BELOW).filter((f) => own === f || within(own, f)).sort((a, b) => b.length - a.length)[0];
  if (!rule) return `no rule for ${own}`;
  if (isPart(own) && within(other + '/', own)) return null;
  return BELOW[rule].some((f) => other === f) ? null : `${own} does not stand on ${other}`;
}

test('every include points down', () => {
  const tops = new Set(files.map((f) => f.split('/')[0]));
  const problems = [];
  let includes = 0;
  for (const file of sources) {
    if (REGISTRY.includes(file)) continue;
    const text = readFileSync(join(root, file), 'utf8');
    for (const [, path] of text.matchAll(/^(?:#include|import) "([^"]+)"/gm)) {
      if (!tops.has(path.split('/')[0])) continue;  // a library's
      ++includes;
      const problem = problemOf(file, path);
      if (problem) problems.push(`${file} includes ${path}: ${problem}`);
    }
  }
  assert.ok(includes > 500, `${includes} includes found`);
  assert.deepEqual(problems, []);
});

test('no folder stands on itself by way of others', () => {
  const below = (folder, seen = new Set()) => {
    for (const other of BELOW[folder] ?? []) {
      if (other !== folder && !seen.has(other)) below(other, seen.add(other));
    }
    return seen;
  };
  assert.deepEqual(Object.keys(BELOW).filter((folder) => below(folder).has(folder)), []);
});

// Neither their sources nor their build name it. (A build that precompiles headers gives all targets the same ones; the presets
// debug and sanitize do not.)
test('robot and balance need no protobuf', () => {
  const own = files.filter((f) => within(f, 'components/robot') || within(f, 'components/balance'));
  assert.ok(own.length > 50, `${own.length} files found`);
  assert.deepEqual(own.filter((f) => /\.proto$/.test(f)), []);
  assert.deepEqual(own.filter((f) => /protobuf|\.pb\.h|_proto\b/.test(readFileSync(join(root, f), 'utf8'))), []);
});

test('an include that points up or sideways is seen', () => {
  assert.match(problemOf('components/robot/a.cc', 'components/balance/b.h'), /does not stand on/);
  assert.match(problemOf('components/redistributor/a.cc', 'components/task_controller/b.h'), /does not stand on/);
  assert.match(problemOf('logging/a.cc', 'sim/b.h'), /does not stand on/);
  assert.match(problemOf('sim/a.cc', 'sim_ode/b.h'), /does not stand on/);
  assert.match(problemOf('tools/run/a.cc', 'tools/live/b.h'), /stands above/);
  assert.equal(problemOf('tools/live/a.cc', 'tools/run/b.h'), null);
});

test('every folder of tools/ has its place in the order', () => {
  const folders = new Set(files.map((f) => /^tools\/(\w+)\//.exec(f)?.[1]).filter(Boolean));
  assert.deepEqual([...folders].sort(), [...TOOLS].sort());
});

test('no folder holds more than some thirty files', () => {
  const counts = new Map();
  for (const file of repositoryFiles()) {
    const folder = file.includes('/') ? folderOf(file) : '.';
    counts.set(folder, (counts.get(folder) ?? 0) + 1);
  }
  assert.ok(counts.size > 40, `${counts.size} folders found`);
  assert.deepEqual([...counts].filter(([, count]) => count > 32), []);
});

// C++20 destroys what f() returned before the loop's first turn when a view of it is gone through: for (x : f().corners()).
const DANGLING = /\bfor \([^;()]*:\s*[\w:]+\([^;]*?\)\.(?:mutable_)?(?:corners|planes)\(\)\)/g;

test('no loop goes through a view of what is gone', () => {
  const all = repositoryFiles().filter((f) => /\.(h|cc)$/.test(f));
  assert.ok(all.length > 500, `${all.length} files found`);
  const found = all.flatMap((f) => [...readFileSync(join(root, f), 'utf8').matchAll(DANGLING)].map(([loop]) => `${f}: ${loop}`));
  assert.deepEqual(found, []);
  assert.match('for (HalfPlane plane : EdgesOf(sole[1]).planes()) {', DANGLING);
  assert.doesNotMatch('for (HalfPlane plane : edges.planes()) {', new RegExp(DANGLING.source));
});
