#!/bin/sh
# Starts the robot again and again in real time, and says how often it fell, when its crane let go and what the machine did.
#
# tests/benchmarks/start_trial.sh [--load N] [--browser] [--kill] [STARTS]
#   STARTS: default 200, of the push of section 7.2; --kill: a controller process is killed, or stopped for 100 ms, in the
#   first second of each; --load, --browser: what burns beside it (load.sh)
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
. "$root/tests/benchmarks/load.sh"
parse_load "$@"
kill= starts=200
for word in $rest; do
  case $word in
    --kill) kill=yes ;;
    *[!0-9]*) echo "usage: $0 [--load N] [--browser] [--kill] [STARTS]" >&2; exit 2 ;;
    *) starts=$word ;;
  esac
done
poise=${POISE:-$root/build/release/bin/poise}
out=$(mktemp -d)
trap 'stop_load; rm -rf "$out" 2>/dev/null || true' EXIT
trap 'exit 130' INT TERM
start_load "$out"
: >"$out/faults"; : >"$out/cranes"; : >"$out/machines"
falls=0 others=0 seed=1
while [ "$seed" -le "$starts" ]; do
  rm -rf "$out/run"
  # The scenario begins 5 s after the run: faults between -5 s and -3 s fall into the first second, in the first half of
  # their slot.
  "$poise" run push_double_support --realtime --no-reference --no-log --duration 1 --out "$out/run" \
    ${kill:+--kill 1 --kill-from -5 --kill-until -3 --kill-seed "$seed"} >"$out/text" 2>&1 || true
  grep -E '^(killed|stopped)' "$out/text" >>"$out/faults" || true
  sed -n 's/^crane: let go at \(.*\) s$/\1/p' "$out/text" >>"$out/cranes"
  sed -n 's/^machine: \(.*\) of \(.*\) cycles late\(, worst \(.*\) ms\)*$/\1 \2 \4/p' "$out/text" | tr -d , >>"$out/machines"
  if grep -q 'the robot fell' "$out/text"; then
    falls=$((falls + 1))
  elif ! grep -q '^passed' "$out/text"; then
    others=$((others + 1))
  fi
  if ! grep -q '^passed' "$out/text"; then
    grep 'run failed' "$out/text" >&2 || tail -n 3 "$out/text" >&2
    grep -E '^(killed|stopped)' "$out/text" >&2 || true
  fi
  printf '\r%d starts' "$seed" >&2
  seed=$((seed + 1))
done
printf '\r' >&2
if [ -n "$kill" ]; then
  awk '{ if ($(NF - 1) == "never") never++; else print $(NF - 1) + 0 } END { print never + 0 > "/dev/stderr" }' \
    "$out/faults" 2>"$out/never" | sort -n >"$out/regained"
  awk -v never="$(cat "$out/never")" '{ value[NR] = $1 }
    END { printf "%d faults in the first second; control regained after: median %.1f ms, worst %.1f ms; never %d\n",
      NR + never, value[int((NR + 1) / 2)], value[NR], never }' "$out/regained"
fi
sort -n "$out/cranes" | awk '{ value[NR] = $1 }
  END { if (NR) printf "crane let go %d times: first %.3f s, median %.3f s, last %.3f s\n", NR, value[1],
    value[int((NR + 1) / 2)], value[NR] }'
awk '{ late += $1; cycles += $2; if ($3 + 0 > worst) worst = $3 + 0 }
  END { printf "machine: %d of %d cycles late, worst %.1f ms\n", late, cycles, worst }' "$out/machines"
printf '%d starts, %d falls, %d other failures\n' "$starts" "$falls" "$others"
[ "$falls" -eq 0 ] && [ "$others" -eq 0 ]
