#!/usr/bin/env bash
# deploy/run in a new checkout: runs as soon as first_run is built, and leaves everything built; with flags, all is built first.
# Usage: first_run_test.sh SOURCE_DIR
set -euo pipefail
source_dir=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $1" >&2; exit 1; }

# A deploy/setup that tells what it is asked for, and builds programs that tell how they are called.
mkdir -p "$work/deploy" "$work/build/release/bin"
cp "$source_dir/deploy/run" "$work/deploy/"
cat >"$work/deploy/setup" <<'SETUP'
#!/bin/sh
echo "setup $*"
program=$(dirname "$0")/../build/release/bin/$2
printf '#!/bin/sh\necho "%s $*"\n'"${does:-}"'\nexit '"${ends:-1}"'\n' "$2" >"$program"
chmod +x "$program"
[ "$2" != "${fails:-}" ] || exit 7
SETUP
chmod +x "$work/deploy/setup"

# Its lines, and its exit code, which is the run's.
export does ends fails
run() { ("$work/deploy/run" "$@" && echo 0 || echo $?) | grep -v -e '^$' -e '^Building' | tr '\n' '|'; }
expect() { [ "$2" = "$3" ] || fail "$1: $2"; }

expect 'a new checkout' "$(run push)" 'setup --quiet first_run|first_run push|setup --quiet poise|1|'
expect 'a built one' "$(run push)" 'setup --quiet poise|poise run push|1|'
rm "$work"/build/release/bin/*
expect 'a new checkout, an empty name' "$(run '')" 'setup --quiet poise|poise run |1|'
rm "$work"/build/release/bin/*
expect 'a new checkout, with flags' "$(run push --inline)" 'setup --quiet poise|poise run push --inline|1|'
rm "$work"/build/release/bin/*
expect 'a name that is none' "$(ends=2 run pusch)" 'setup --quiet first_run|first_run pusch|2|'
expect 'what else there is cannot be built' "$(fails=poise run push 2>/dev/null)" 'setup --quiet first_run|first_run push|setup --quiet poise|1|'
rm "$work"/build/release/bin/*
expect 'nothing can be built' "$(fails=first_run run push)" 'setup --quiet first_run|7|'

# A signal ends the run in its own time, and what else there is is not built. SIGTERM comes to deploy/run alone; Ctrl-C to
# it and the run, as to all of a terminal's foreground group.
for signal in TERM INT; do
  rm -f "$work"/build/release/bin/*
  : >"$work/out"  # the last signal's is not waited for
  does='trap "sleep 0.2; echo stopped; kill \$!; exit 0" TERM INT; echo started; sleep 60 & wait' \
    setsid env --default-signal=INT "$work/deploy/run" push >"$work/out" &
  until grep -q started "$work/out"; do sleep 0.05; done
  [ "$signal" = TERM ] && kill -TERM $! || kill -INT -- -$!
  code=0
  wait $! || code=$?
  expect "SIG$signal" "$code $(tr '\n' '|' <"$work/out")" \
    "$((128 + $(kill -l $signal))) setup --quiet first_run|first_run push|started|stopped|"
done
echo 'first_run runs first in a new checkout alone, and takes its signals'
