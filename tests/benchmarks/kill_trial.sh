#!/bin/sh
# Kills and stops controller processes at random moments of standing and of the push of section 7.2, in real time.
# Prints how long control was lost and how often the robot fell.
#
# tests/benchmarks/kill_trial.sh [--load N] [--browser] [FAULTS]
#   FAULTS: default 100, half in standing, half around a push; --load, --browser: what burns beside it (load.sh)
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
. "$root/tests/benchmarks/load.sh"
parse_load "$@"
# shellcheck disable=SC2086
set -- $rest
faults=${1:-100}
case $faults in *[!0-9]* | '') echo "usage: $0 [--load N] [--browser] [FAULTS]" >&2; exit 2 ;; esac
poise=${POISE:-$root/build/release/bin/poise}
out=$(mktemp -d)
trap 'stop_load; rm -rf "$out" 2>/dev/null || true' EXIT
trap 'exit 130' INT TERM
start_load "$out"
runs=0 falls=0
trial() { # SEED FAULTS ARGUMENT...
  seed=$1 count=$2
  shift 2
  runs=$((runs + 1))
  rm -rf "$out/run"
  "$poise" run push_double_support --realtime --no-reference --no-log --kill "$count" --kill-seed "$seed" \
    --out "$out/run" "$@" >"$out/text" 2>&1 || true
  grep -E '^(killed|stopped)' "$out/text" >>"$out/faults" || true
  if grep -q 'run failed' "$out/text"; then
    falls=$((falls + 1))
    grep 'run failed' "$out/text" >&2
    grep -E '^(killed|stopped)' "$out/text" >&2 || true
  fi
  printf '\r%d faults' "$(wc -l <"$out/faults")" >&2
}
: >"$out/faults"
standing=$((faults / 2))
seed=1
while [ "$standing" -gt 0 ]; do
  count=$((standing < 10 ? standing : 10))
  trial "$seed" "$count" --set sim.push= --duration $((2 * count))
  standing=$((standing - count)) seed=$((seed + 1))
done
push=$((faults - faults / 2))
while [ "$push" -gt 0 ]; do
  trial "$seed" 1 --duration 3
  push=$((push - 1)) seed=$((seed + 1))
done
printf '\r' >&2
awk -v runs="$runs" -v falls="$falls" '
  { kind = $1; regained = $(NF - 1); cycles = $NF
    if (regained == "never") never[kind]++; else { n[kind]++; value[kind, n[kind]] = regained + 0 }
    total[kind]++ }
  function sorted(kind,   i, j, t) {
    for (i = 2; i <= n[kind]; ++i) {
      t = value[kind, i]
      for (j = i - 1; j >= 1 && value[kind, j] > t; --j) value[kind, j + 1] = value[kind, j]
      value[kind, j + 1] = t
    } }
  END {
    for (kind in total) {
      sorted(kind)
      printf "%-8s %4d faults; control regained after: median %.1f ms, worst %.1f ms; never %d\n", kind, total[kind],
        n[kind] ? value[kind, int((n[kind] + 1) / 2)] : 0, n[kind] ? value[kind, n[kind]] : 0, never[kind] + 0
    }
    printf "%d runs, %d falls\n", runs, falls
  }' "$out/faults"
[ "$falls" -eq 0 ]
