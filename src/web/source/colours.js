// One scale for all fields and methods: from the pale tone of tissue at rest over orange to deep violet. Lightness falls
// all the way, so that it reads in grey too.
const stops = [
  [0.0, 0xf1e9e2], [0.08, 0xfbe3b0], [0.25, 0xf9b64d], [0.45, 0xe8743b], [0.65, 0xc23b5a], [0.82, 0x7f2a78], [1.0, 0x35155a],
];

function channels(hex) {
  return [(hex >> 16) & 255, (hex >> 8) & 255, hex & 255];
}

function colour(value) {
  const x = Math.min(1, Math.max(0, value));
  let k = 1;
  while (k < stops.length - 1 && stops[k][0] < x) ++k;
  const [from, low] = stops[k - 1];
  const [to, high] = stops[k];
  const part = (x - from) / (to - from);
  const [a, b] = [channels(low), channels(high)];
  return a.map((c, i) => (c + part * (b[i] - c)) / 255);
}

export const gradient = `linear-gradient(to right, ${stops
  .map(([at, hex]) => `#${hex.toString(16).padStart(6, "0")} ${100 * at}%`)
  .join(", ")})`;

// 256 colours, red green blue and alpha as bytes.
export const table = Uint8Array.from({ length: 1024 }, (_, i) =>
  i % 4 === 3 ? 255 : Math.round(255 * colour(Math.floor(i / 4) / 255)[i % 4]));
