# Sourced by the trials in real time: keeps the machine busy beside them. Ends only what it has started.
#
# parse_load ARGUMENT...   takes --load N (burning loops) and --browser (headless Chromium with a page that draws) off the
#                          arguments; what is left is in $rest
# start_load FOLDER        starts them, with their files in FOLDER
# stop_load                ends them; `trap` it
loops=0 browser= rest= load_pids=
parse_load() {
  while [ $# -gt 0 ]; do
    case $1 in
      --load)
        loops=${2:-}
        case $loops in *[!0-9]* | '') echo "--load: must be a number of loops" >&2; exit 2 ;; esac
        shift
        ;;
      --browser) browser=yes ;;
      *) rest="$rest $1" ;;
    esac
    shift
  done
}

start_load() {
  i=0
  while [ "$i" -lt "$loops" ]; do
    sh -c 'while :; do :; done' &
    load_pids="$load_pids $!"
    i=$((i + 1))
  done
  [ -n "$browser" ] || return 0
  chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome) || {
    echo "--browser: there is no Chromium; install the package chromium" >&2
    exit 2
  }
  cat >"$1/busy.html" <<'HTML'
<!doctype html><canvas width=1280 height=720></canvas><script>
const context = document.querySelector('canvas').getContext('2d');
function draw() {
  for (let i = 0; i < 3000; ++i) {
    context.fillStyle = `hsl(${Math.random() * 360} 80% 50%)`;
    context.fillRect(Math.random() * 1280, Math.random() * 720, 40, 40);
  }
  requestAnimationFrame(draw);
}
draw();
new Worker(URL.createObjectURL(new Blob(['for (;;) Math.sqrt(Math.random());'])));
</script>
HTML
  # A group of its own, so that its children end with it.
  setsid "$chromium" --headless --no-sandbox --disable-gpu --user-data-dir="$1/browser" --remote-debugging-port=0 \
    "file://$1/busy.html" >"$1/browser.log" 2>&1 &
  load_pids="$load_pids -$!"
  sleep 2
}

stop_load() {
  for pid in $load_pids; do kill -- "$pid" 2>/dev/null || true; done
  load_pids=
}
