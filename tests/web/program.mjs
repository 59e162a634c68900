// The program poise in a test.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';

/** Calls `program` with parameters and gives what it prints; a check of a shorter run may fail. */
export function poiseCaller(program) {
  return (...parameters) => {
    const {status, stdout, stderr} = spawnSync(program, parameters, {encoding: 'utf8'});
    assert.ok(status === 0 || status === 1, stdout + stderr);
    return stdout;
  };
}
