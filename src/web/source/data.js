// Reads what src/view/page.cpp wrote: JSON with deflated arrays in base64. The packing is told there; here it is undone.

async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const floats = async (text) => new Float32Array((await inflate(text)).buffer);

// Undoes the packing of 16-bit numbers: low bytes, then high bytes, of zigzag differences to the neighbour before.
function unsplit(bytes) {
  const count = bytes.length / 2;
  const values = new Int32Array(count);
  for (let i = 0; i < count; ++i) {
    const z = bytes[i] | (bytes[count + i] << 8);
    values[i] = (z >>> 1) ^ -(z & 1);
  }
  return values;
}

// Frames of `size` numbers, in three planes (x of all vertices, then y, then z), each told as its change since the frame
// before, and that as its difference from the change of the vertex before. Modulo 2^16.
function frames(bytes, size, rest) {
  const differences = unsplit(bytes);
  const plane = size / 3;
  const all = [];
  let last = rest;
  for (let at = 0; at < differences.length; at += size) {
    const frame = new Uint16Array(size);
    for (let c = 0; c < 3; ++c) {
      let change = 0;
      for (let v = 0; v < plane; ++v) {
        const i = c * plane + v;
        change += differences[at + i];
        frame[i] = last[i] + change;
      }
    }
    all.push(frame);
    last = frame;
  }
  return all;
}

// One run, ready to be shown. `place(frame, out)` writes the positions of a frame in metres, x y z of every vertex.
async function readRun(run, view) {
  const size = 3 * view.vertices;
  const [positions, depth, strain, points, forces, tool, force, worst, counts] = await Promise.all([
    inflate(run.positions), inflate(run.depth.values), inflate(run.strain.values), inflate(run.points),
    inflate(run.forces), inflate(run.tool_points), floats(run.curves.force), floats(run.curves.depth), floats(run.curves.contacts),
  ]);
  const starts = [0];
  for (const n of run.contacts_per_frame) starts.push(starts[starts.length - 1] + n);
  return {
    ...run,
    quantised: frames(positions, size, view.rest),
    fields: { depth: { values: depth, max: run.depth.max }, strain: { values: strain, max: run.strain.max },
      displacement: { values: null, max: run.displacement.max } },
    starts,
    points: new Uint16Array(points.buffer),
    forces: new Int16Array(forces.buffer),
    toolPoints: new Uint16Array(tool.buffer), // 65535: no contact of the tool has a force
    force, // 3 per tick, N
    magnitude: Float32Array.from({ length: force.length / 3 }, (_, t) =>
      Math.hypot(force[3 * t], force[3 * t + 1], force[3 * t + 2])),
    deepest: worst, // per tick, m
    counts, // per tick
    // The frame shown at a tick: the last one not after it.
    frameAt(tick) {
      let low = 0;
      for (let high = this.frames.length; high - low > 1;) {
        const middle = (low + high) >> 1;
        if (this.frames[middle] <= tick) low = middle;
        else high = middle;
      }
      return low;
    },
  };
}

export async function readView(json) {
  const view = { ...json };
  view.triangles = new Uint32Array((await inflate(json.triangles)).buffer);
  view.rest = frames(await inflate(json.rest), 3 * json.vertices, new Uint16Array(3 * json.vertices))[0];
  view.place = (quantised, out) => {
    const n = json.vertices;
    for (let v = 0; v < n; ++v) {
      for (let c = 0; c < 3; ++c) out[3 * v + c] = json.low[c] + json.step[c] * quantised[c * n + v];
    }
  };
  view.runs = await Promise.all(json.runs.map((run) => readRun(run, view)));
  view.references = await Promise.all(
    json.references.map(async (one) => ({ ...one, force: one.force ? await floats(one.force) : null })));
  return view;
}
