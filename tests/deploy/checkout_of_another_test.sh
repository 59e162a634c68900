#!/usr/bin/env bash
# deploy/run by a user who cannot write the checkout: what is current runs, and else it is said what to do.
# Usage: checkout_of_another_test.sh SOURCE_DIR
set -euo pipefail
source_dir=$1
work=$(mktemp -d)
trap 'chmod -R u+w "$work"; rm -rf "$work"' EXIT
fail() { echo "FAILED: $1" >&2; exit 1; }

# A checkout whose build is one script.
checkout=$work/checkout
mkdir -p "$checkout/deploy" "$checkout/build/release/bin"
cp "$source_dir"/deploy/{run,setup,test} "$checkout/deploy/"
printf '#!/bin/sh\necho "poise $*"\n' >"$checkout/source"
cat >"$checkout/build/release/build.ninja" <<'NINJA'
rule copy
  command = cp -p $in $out && chmod +x $out
build bin/poise: copy ../../source
build poise: phony bin/poise
build poise_types_jar: phony
NINJA
ninja -C "$checkout/build/release" >/dev/null
chmod -R go+rX "$work"

# Root may write everything; anybody else cannot write what is read-only.
as_other=()
if [ "$(id -u)" = 0 ]; then
  as_other=(setpriv --reuid=65534 --regid=65534 --clear-groups)
  "${as_other[@]}" true || { echo "no other user can be played here"; exit 0; }
  # Its temporary folder is no one else's.
else
  chmod -R a-w "$checkout"
fi
run() { (cd / && "${as_other[@]}" "$checkout/deploy/run" "$@" 2>&1) || true; }

out=$(run push --out there)
[ "$out" = "poise run push --out there" ] || fail "a current build does not run: $out"

chmod u+w "$checkout" "$checkout/source"
sleep 0.01
echo >>"$checkout/source"
[ "$(id -u)" = 0 ] || chmod -R a-w "$checkout"
out=$(run)
grep -q "older than the sources: ask $(id -un) to run deploy/setup here, or clone" <<<"$out" || fail "an old build: $out"

chmod -R u+w "$checkout"
rm -r "$checkout/build"
[ "$(id -u)" = 0 ] || chmod -R a-w "$checkout"
out=$(run)
grep -q "is not built: ask $(id -un) to run deploy/setup here, or clone" <<<"$out" || fail "no build: $out"
echo "as user $("${as_other[@]}" id -u): a current build runs, an old or a missing one is said"
