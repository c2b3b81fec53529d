// Keyboard commands of the 3-D view, in addition to those of the camera (camera.js).

const AXES = ["x", "y", "z"];
const KEYS = {
  i: (body) => body.look("isometric"), f: (body) => body.follow("fit"), a: (body) => body.follow("all"), e: (body) => body.flip("edges"),
  o: (body) => body.flip("lines"), v: (body) => body.flip("arrows"), m: (body) => body.planes.length && body.flip("mirror"),
  " ": (body) => body.playing.click(), ",": (body) => body.step(-1), ".": (body) => body.step(1),
  ...Object.fromEntries(AXES.flatMap((name) => [[name, (body) => body.look(`+${name}`)], [name.toUpperCase(), (body) => body.look(`-${name}`)]])),
};

// Performs the action of a key; returns false for other keys.
export function act(body, key) {
  if (!Object.hasOwn(KEYS, key)) return false;
  KEYS[key](body);
  return true;
}
