// The picture as a video, while the run plays.
import {button} from './dom.js';

const FRAMES = 30;   // a second
const BITS = 8e6;    // a second
const TYPE = 'video/webm';

/** Why this browser records none; '' where it does. */
function reasonAgainst(canvas) {
  if (!globalThis.MediaRecorder || !canvas.captureStream) return 'This browser records no video: it has no MediaRecorder';
  return MediaRecorder.isTypeSupported(TYPE) ? '' : 'This browser records no WebM';
}

/** Plays the run from the time cursor and records what `scene` shows, until the run's end or the next click; `save(blob)` takes it. */
export function videoButton(scene, player, save) {
  let recorder;
  const start = () => {
    player.play();
    if (!player.playing) return;  // a run of one tick
    const parts = [];
    recorder = new MediaRecorder(scene.canvas.captureStream(FRAMES), {mimeType: TYPE, videoBitsPerSecond: BITS});
    recorder.addEventListener('dataavailable', ({data}) => parts.push(data));
    recorder.addEventListener('stop', () => {
      recorder = undefined;
      update();
      save(new Blob(parts, {type: TYPE}));
    });
    recorder.start();
    update();
    scene.renderNow();  // the first picture belongs to it, and the last one below
  };
  const against = reasonAgainst(scene.canvas);
  const record = button('', against || 'Play the run and record the picture as WebM',
    () => (recorder ? player.pause() : start()), {disabled: against !== ''});
  const update = () => {
    scene.recorded = recorder !== undefined;
    record.textContent = recorder ? 'Stop and save the video' : 'Video';
  };
  player.addEventListener('state', () => {
    if (player.playing || recorder?.state !== 'recording') return;
    scene.renderNow();
    requestAnimationFrame(() => recorder?.stop());
  });
  update();
  return record;
}
