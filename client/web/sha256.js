// sha256 of a file (FIPS 180-4), computed piece by piece. crypto.subtle needs the whole file in memory, and does not
// exist on pages over plain http from another machine. Therefore this code is used for all files and addresses.

const BLOCK = 64;
const PIECE = 1 << 22; // Number of bytes that are read and hashed at a time, which takes about 20 ms.
const primes = (n) => {
  const found = [];
  for (let k = 2; found.length < n; k += 1) if (found.every((p) => k % p)) found.push(k);
  return found;
};
const fraction = (x) => Math.floor((x - Math.floor(x)) * 2 ** 32);
const START = primes(8).map((p) => fraction(Math.sqrt(p)) | 0);
const ROUNDS = Int32Array.from(primes(64).map((p) => fraction(Math.cbrt(p)) | 0));

export class Sha256 {
  constructor() {
    this.state = Int32Array.from(START);
    this.words = new Int32Array(64);
    this.rest = new Uint8Array(2 * BLOCK);
    Object.assign(this, { held: 0, length: 0 });
  }

  // Adds the next bytes of the data, a Uint8Array.
  update(bytes) {
    this.length += bytes.length;
    let at = 0;
    if (this.held) {
      at = Math.min(bytes.length, BLOCK - this.held);
      this.rest.set(bytes.subarray(0, at), this.held);
      this.held += at;
      if (this.held < BLOCK) return this;
      this.block(this.rest, 0);
      this.held = 0;
    }
    for (; at + BLOCK <= bytes.length; at += BLOCK) this.block(bytes, at);
    this.rest.set(bytes.subarray(at));
    this.held = bytes.length - at;
    return this;
  }

  // All 32-bit words are signed: engines keep signed words in registers, whereas unsigned words become floating-point
  // numbers.
  block(bytes, at) {
    const { state, words: w } = this;
    for (let i = 0, o = at; i < 16; i += 1, o += 4) w[i] = (bytes[o] << 24) | (bytes[o + 1] << 16) | (bytes[o + 2] << 8) | bytes[o + 3];
    for (let i = 16; i < 64; i += 1) {
      const x = w[i - 15];
      const y = w[i - 2];
      const s0 = ((x >>> 7) | (x << 25)) ^ ((x >>> 18) | (x << 14)) ^ (x >>> 3);
      const s1 = ((y >>> 17) | (y << 15)) ^ ((y >>> 19) | (y << 13)) ^ (y >>> 10);
      w[i] = (w[i - 16] + s0 + w[i - 7] + s1) | 0;
    }
    let a = state[0], b = state[1], c = state[2], d = state[3], e = state[4], f = state[5], g = state[6], h = state[7];
    for (let i = 0; i < 64; i += 1) {
      const s1 = ((e >>> 6) | (e << 26)) ^ ((e >>> 11) | (e << 21)) ^ ((e >>> 25) | (e << 7));
      const t1 = (h + s1 + ((e & f) ^ (~e & g)) + ROUNDS[i] + w[i]) | 0;
      const s0 = ((a >>> 2) | (a << 30)) ^ ((a >>> 13) | (a << 19)) ^ ((a >>> 22) | (a << 10));
      const t2 = (s0 + ((a & b) ^ (a & c) ^ (b & c))) | 0;
      h = g; g = f; f = e; e = (d + t1) | 0; d = c; c = b; b = a; a = (t1 + t2) | 0;
    }
    state[0] += a; state[1] += b; state[2] += c; state[3] += d; state[4] += e; state[5] += f; state[6] += g; state[7] += h;
  }

  // Returns the digest of all bytes in hexadecimal digits; afterwards no bytes can be added.
  digest() {
    const blocks = this.held + 9 > BLOCK ? 2 : 1;
    const view = new DataView(this.rest.buffer);
    this.rest.fill(0, this.held);
    this.rest[this.held] = 0x80;
    view.setUint32(blocks * BLOCK - 8, Math.floor(this.length / 2 ** 29));
    view.setUint32(blocks * BLOCK - 4, (this.length * 8) >>> 0);
    for (let i = 0; i < blocks; i += 1) this.block(this.rest, i * BLOCK);
    return [...this.state].map((word) => (word >>> 0).toString(16).padStart(8, "0")).join("");
  }
}

// Returns the sha256 of a File or Blob. `onBytes` is called with the number of bytes read. The page stays responsive
// between pieces.
export async function hashed(file, onBytes, signal) {
  const hash = new Sha256();
  for (let at = 0; at < file.size; at += PIECE) {
    signal?.throwIfAborted();
    hash.update(new Uint8Array(await file.slice(at, at + PIECE).arrayBuffer()));
    onBytes(Math.min(file.size, at + PIECE));
  }
  return hash.digest();
}
