#!/usr/bin/env bash
# deploy/spy on a run in progress, on a display of its own: lcm-spy must know all types, show all channels decoded and
# open a channel's fields. lcm-logger and lcm-logplayer must get along with the same URL.
# docs/lcm_spy.png must show the same channels and fields; with RETAKE=1 the test's picture takes its place.
# Usage: spy_test.sh SOURCE_DIR POISE PROBE_JAR WORK_DIR; leaves WORK_DIR/spy.png and WORK_DIR/spy.png.txt.
set -euo pipefail
source_dir=$1 poise=$2 probe=$3 work=$4

rm -rf "$work"
mkdir -p "$work"
run=$work/run
export POISE_RUNTIME_DIR=$work/registry  # other tests' runs are none of ours
spy_says() { env -u DISPLAY "$source_dir/deploy/spy" "$@" 2>&1 || true; }
started=()
cleanup() {
  for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done
  for pid in "${started[@]}"; do wait "$pid" 2>/dev/null || true; done
}
trap cleanup EXIT
fail() { echo "FAILED: $1" >&2; exit 1; }
# Until the command succeeds.
wait_for() {
  for _ in $(seq 600); do
    if "$@" 2>/dev/null; then return; fi
    sleep 0.1
  done
  fail "waited a minute for: $*"
}
# Whether a socket listens at this port.
listening() { grep -qi "$(printf ':%04X ' "$1")" /proc/net/udp; }
# Ticks of a channel in a log.
ticks() { "$poise" echo "$2" tick --log "$1"; }

"$poise" run "$source_dir/tests/graph/data/stand.pbtxt" --realtime --duration 300 --out "$run" >"$work/run.txt" 2>&1 &
started+=($!)
wait_for test -s "$run/run.lcm"
wait_for grep -q 'listen at' "$work/run.txt"
url=$(sed -n 's/.*listen at //p' "$work/run.txt")
port=$(sed 's/.*:\([0-9]*\)?.*/\1/' <<<"$url")

spy_says | grep -qF "$url" || fail "deploy/spy without a run does not find the one that goes on"
lcm-logger --lcm-url="$url" "$work/logger.lcm" >"$work/logger.txt" 2>&1 &
logger=$!
started+=("$logger")

spec=$run/run_spec.pbtxt
types=$(basename -s .lcm "$source_dir"/lcmtypes/*.lcm | paste -sd,)
# NAME=type of the graph's channels, and of those that an operator writes.
channels=$(sed -n '/^  channel {/,/^  }/p' "$spec" | tr -d '\n' | sed 's/  channel {/\n/g' | grep -v external: |
  sed -n 's/.*name: "\([^"]*\)".*type: "\([^"]*\)".*/\1=\2/p')
health=$(sed -n '/^  component {/,/^  }/s/^    name: "\(.*\)"/HEALTH_\U\1\E=health_t/p' "$spec")
if [ "$(wc -l <<<"$channels")" -lt 10 ] || [ "$(wc -l <<<"$health")" -lt 6 ]; then
  fail "the run's channels were not read"
fi

export JAVA_TOOL_OPTIONS="-javaagent:$probe -Dprobe.types=$types -Dprobe.open=BALANCE_TORQUE \
-Dprobe.channels=$(paste -sd, <<<"$channels"$'\n'"$health"),HEALTH_RECORDER=health_t \
-Dprobe.last=EMERGENCY_STOP=emergency_stop_t -Dprobe.picture=$work/spy.png"
xvfb-run -a -s '-screen 0 1280x720x24' "$source_dir/deploy/spy" "$run" >"$work/spy.txt" 2>&1 &
spy=$!
started+=("$spy")
# An operator's channel speaks when the rest has been seen, which ends the run.
opened() { grep -q 'probe: opened\|probe: FAILED' "$work/spy.txt" || ! kill -0 "$spy"; }
wait_for opened
"$poise" estop "$run" || true
wait "$spy" || { cat "$work/spy.txt"; fail "lcm-spy did not show everything"; }
grep '^probe: ' "$work/spy.txt"
[ "$(wc -c <"$work/spy.png")" -gt 10000 ] || fail "the picture is empty"
png_text() { node "$source_dir/tests/docs/png_text.mjs" "$@"; }
if [ -n "${RETAKE-}" ]; then
  png_text write "$work/spy.png" "$work/spy.png.txt" "$source_dir/docs/lcm_spy.png"
else
  png_text check "$source_dir/docs/lcm_spy.png" "$work/spy.png.txt" || fail "the picture in docs/ is old"
fi

kill "$logger"
wait "$logger" || true
kill -INT "${started[0]}" 2>/dev/null || true
wait "${started[0]}" || true

# What lcm-logger heard is what the run's own log holds.
ticks "$work/logger.lcm" ROBOT_STATE >"$work/logger_ticks"
ticks "$run" ROBOT_STATE >"$work/run_ticks"
[ "$(wc -l <"$work/logger_ticks")" -gt 100 ] || fail "lcm-logger heard too little"
if grep -Fvxf "$work/run_ticks" "$work/logger_ticks"; then fail "lcm-logger heard ticks that the log lacks"; fi
echo "lcm-logger: $(wc -l <"$work/logger_ticks") ticks"

# lcm-logplayer sends a log on the URL for whoever listens.
lcm-logger --lcm-url="$url" "$work/played.lcm" >"$work/played.txt" 2>&1 &
listener=$!
started+=("$listener")
wait_for listening "$port"
lcm-logplayer --speed=4 --lcm-url="$url" "$work/logger.lcm" >"$work/player.txt" 2>&1
sleep 0.5 # for the last messages to be written
kill "$listener"
wait "$listener" || true
ticks "$work/played.lcm" ROBOT_STATE >"$work/played_ticks"
[ "$(wc -l <"$work/played_ticks")" -gt 100 ] || fail "lcm-logplayer sent too little"
if grep -Fvxf "$work/logger_ticks" "$work/played_ticks"; then fail "lcm-logplayer sent what was not in the log"; fi
echo "lcm-logplayer: $(wc -l <"$work/played_ticks") ticks"
# A run inside one process is played at LCM's own URL, where its tools listen without options and deploy/spy looks.
"$poise" run "$source_dir/tests/graph/data/stand.pbtxt" --inline --quiet --out "$work/inline" >"$work/inline.txt"
(unset LCM_DEFAULT_URL; exec lcm-logger "$work/inline.lcm" >"$work/inline_logger.txt" 2>&1) &
listener=$!
started+=("$listener")
wait_for listening 7667
"$poise" replay "$work/inline" --to-bus
sleep 0.5 # for the last messages to be written
kill "$listener"
wait "$listener" || true
ticks "$work/inline" ROBOT_STATE >"$work/inline_ticks"
ticks "$work/inline.lcm" ROBOT_STATE | sort -u >"$work/heard_ticks"
[ "$(wc -l <"$work/heard_ticks")" -gt 100 ] || fail "poise replay --to-bus sent too little"
if grep -Fvxf "$work/inline_ticks" "$work/heard_ticks"; then fail "poise replay --to-bus sent what was not in the log"; fi
echo "poise replay --to-bus: $(wc -l <"$work/heard_ticks") ticks"
spy_says "$work/inline" | grep -qF 'udpm://239.255.76.67:7667?ttl=0' || fail "deploy/spy looks elsewhere for such a run"
spy_says "$run" | grep -qF "$url" || fail "deploy/spy looks elsewhere for a run with a network"
spy_says --url "$url" | grep -qF "$url" || fail "deploy/spy --url looks elsewhere"
spy_says --url nowhere | grep -q 'is no URL' || fail "deploy/spy takes any URL"
rm -r "$run" "$work/inline" "$work"/*.lcm "$work"/*_ticks
