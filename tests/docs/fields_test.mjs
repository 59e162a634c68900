// The table of the fields that components read of SUPPORT_PLAN is what their code reads. Usage: node fields_test.mjs
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {test} from 'node:test';
import {repositoryFiles, root, tablesOf} from './markdown.mjs';

const PAGE = 'docs/reference/architecture.md';
const read = (file) => readFileSync(join(root, file), 'utf8');
const {rows} = tablesOf(PAGE).find(({rows: [head]}) => head[1]?.includes('SUPPORT_PLAN'));
const fields = [...read('lcmtypes/support_plan_t.lcm').matchAll(/^ {4}(?!const)\w+ +(\w+)/gm)].map((m) => m[1]);

/** Fields by component, of the table. */
const told = new Map();
let component;
for (const [name, cell] of rows.slice(2)) {
  component = name.replaceAll('`', '') || component;
  told.set(component, [...(told.get(component) ?? []), ...[...cell.matchAll(/`(\w+)`/g)].map((m) => m[1])]);
}

test(`${PAGE} names the fields of SUPPORT_PLAN that are read`, () => {
  assert.deepEqual([...told.keys()], ['task_controller', 'contact_wrench_monitor', 'redistributor']);
  for (const [name, names] of told) {
    const code = repositoryFiles(`components/${name}`).filter((f) => /\.(cc|h)$/.test(f)).map(read).join('\n');
    const used = new Set([...code.matchAll(/\b(?:support_plan_->|plan\.)(\w+)/g)].map((m) => m[1]).filter((f) => fields.includes(f)));
    assert.deepEqual(names.toSorted(), [...used].sort(), name);
  }
});
