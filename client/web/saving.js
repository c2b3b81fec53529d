// Saving of the 3-D view as a picture, and of its snapshots as a film.

const RATE = 8; // Number of snapshots per second of a film.
const BITS = 12e6; // Bit rate of a film, bits per second.
const KINDS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];
const HOLD = 800; // Time for which a film shows its last snapshot, ms.

// Draws the view, on the background colour of the page, onto the canvas `onto`, which is created if it is missing.
export function composed(view, onto = document.createElement("canvas")) {
  view.draw(true); // The browser keeps the drawing only until the end of this task.
  const { width, height } = view.canvas;
  if (onto.width !== width || onto.height !== height) Object.assign(onto, { width, height });
  const ctx = onto.getContext("2d");
  ctx.fillStyle = view.inks().css.paper;
  ctx.fillRect(0, 0, width, height);
  ctx.drawImage(view.canvas, 0, 0);
  ctx.drawImage(view.over, 0, 0);
  return onto;
}

export async function picture(view, name) {
  const blob = await new Promise((done) => composed(view).toBlob(done, "image/png"));
  download(blob, `${name}.png`);
}

// Returns the reason why this browser cannot make films; empty if it can.
export function hindrance() {
  if (typeof MediaRecorder === "undefined" || !HTMLCanvasElement.prototype.captureStream) return "This browser cannot record films.";
  return KINDS.some((kind) => MediaRecorder.isTypeSupported(kind)) ? "" : "This browser cannot record films in WebM.";
}

// Records a film and returns its data. `show(i)` shows snapshot i and resolves when the snapshot is drawn; `report(i)`
// is called before each snapshot; `signal` stops the recording.
export async function film(view, name, number, show, report, signal) {
  const canvas = composed(view);
  const stream = canvas.captureStream(RATE);
  const recorder = new MediaRecorder(stream, { mimeType: KINDS.find((kind) => MediaRecorder.isTypeSupported(kind)), videoBitsPerSecond: BITS });
  const pieces = [];
  recorder.ondataavailable = ({ data }) => pieces.push(data);
  const ended = new Promise((done) => { recorder.onstop = done; });
  recorder.start();
  recorder.pause();
  for (let i = 0; i < number && !signal.aborted; i += 1) {
    report(i);
    await show(i);
    composed(view, canvas);
    recorder.resume();
    await pause(i === number - 1 ? HOLD : 1000 / RATE);
    recorder.pause();
  }
  recorder.stop();
  await ended;
  stream.getTracks().forEach((track) => track.stop());
  if (signal.aborted) return "stopped";
  download(new Blob(pieces, { type: "video/webm" }), `${name}.webm`);
  return "saved";
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));

function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
