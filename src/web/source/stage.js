// The 3D part: every shown run has bodies, contacts and arrows of its own; one camera looks at all of them, side by side
// on one canvas.
import {
  AmbientLight, BufferAttribute, BufferGeometry, CanvasTexture, Color, ConeGeometry, CylinderGeometry, DataTexture, DirectionalLight,
  DoubleSide,
  DynamicDrawUsage, FrontSide, Group, InstancedMesh, LinearFilter, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, PerspectiveCamera, Points, PointsMaterial, Quaternion, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { table } from "./colours.js";

const fromFront = new Vector3(0.55, -1.0, 0.62).normalize();
const up = new Vector3(0, 1, 0);

// Arrows of one colour: a shaft and a head each, drawn in two calls however many there are.
class Arrows {
  constructor(hex, width, size) {
    this.size = size;
    this.width = width;
    this.material = new MeshBasicMaterial({ color: hex });
    this.group = new Group();
    this.grow(16);
  }
  grow(capacity) {
    this.capacity = capacity;
    this.group.clear();
    this.shafts = new InstancedMesh(new CylinderGeometry(1, 1, 1, 8).translate(0, 0.5, 0), this.material, capacity);
    this.heads = new InstancedMesh(new ConeGeometry(2.6, 1, 12).translate(0, 0.5, 0), this.material, capacity);
    for (const mesh of [this.shafts, this.heads]) {
      mesh.frustumCulled = false;
      this.group.add(mesh);
    }
  }
  // `list`: [origin, vector] in metres as drawn; `zoom` 1 where all of the scene is seen, less when nearer.
  set(list, zoom) {
    if (list.length > this.capacity) this.grow(2 * list.length);
    const [matrix, turn, direction] = [new Matrix4(), new Quaternion(), new Vector3()];
    list.forEach(([origin, vector], k) => {
      const length = vector.length();
      turn.setFromUnitVectors(up, direction.copy(vector).divideScalar(length || 1));
      const radius = this.width * this.size * zoom;
      const head = Math.min(9 * radius, 0.45 * length);
      matrix.compose(origin, turn, new Vector3(radius, length - head, radius));
      this.shafts.setMatrixAt(k, matrix);
      matrix.compose(direction.multiplyScalar(length - head).add(origin), turn, new Vector3(radius, head, radius));
      this.heads.setMatrixAt(k, matrix);
    });
    for (const mesh of [this.shafts, this.heads]) {
      mesh.count = list.length;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }
}

function edgesOf(triangles) {
  const seen = new Set();
  const edges = [];
  for (let t = 0; t < triangles.length; t += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = Math.min(triangles[t + k], triangles[t + ((k + 1) % 3)]);
      const b = Math.max(triangles[t + k], triangles[t + ((k + 1) % 3)]);
      const key = a * 4294967 + b;
      if (seen.has(key)) continue;
      seen.add(key);
      edges.push(a, b);
    }
  }
  return edges;
}

// A round dot.
function disc() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 32;
  const pen = canvas.getContext("2d");
  pen.fillStyle = "#fff";
  pen.arc(16, 16, 14, 0, 2 * Math.PI);
  pen.fill();
  return new CanvasTexture(canvas);
}

// The colour scale as a picture one pixel high.
function scale() {
  const texture = new DataTexture(table, 256, 1);
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

const toolColours = [0x8a97a6, 0x9a8f7a, 0x7a9a92];

// What one run looks like.
class Picture {
  constructor(view, run, size) {
    this.view = view;
    this.run = run;
    this.scene = new Scene();
    this.scene.background = new Color(0xffffff);
    this.scene.add(new AmbientLight(0xffffff, 2.1));
    const key = new DirectionalLight(0xffffff, 1.5);
    key.position.set(0.5, -0.8, 1.2);
    const fill = new DirectionalLight(0xffffff, 0.5);
    fill.position.set(-0.8, 0.6, 0.3);
    this.scene.add(key, fill);
    this.positions = new Float32Array(3 * view.vertices);
    this.rest = new Float32Array(3 * view.vertices);
    view.place(view.rest, this.rest);
    this.place = new BufferAttribute(this.positions, 3).setUsage(DynamicDrawUsage);
    // Where on the colour scale a vertex is: the scale is looked up within triangles too, so that the way from pale to
    // dark goes through its colours.
    this.colours = new BufferAttribute(new Float32Array(2 * view.vertices).fill(0.5), 2).setUsage(DynamicDrawUsage);
    this.tools = [];
    this.meshes = [];
    this.wires = new Group();
    view.bodies.forEach((body, number) => {
      const triangles = view.triangles.subarray(3 * body.triangles[0], 3 * (body.triangles[0] + body.triangles[1]));
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", this.place);
      geometry.setIndex(new BufferAttribute(triangles, 1));
      const tissue = body.kind === "tissue";
      if (tissue) geometry.setAttribute("uv", this.colours);
      const material = new MeshLambertMaterial({
        color: tissue ? 0xffffff : toolColours[number % toolColours.length],
        map: tissue ? scale() : null,
        side: tissue || !body.closed ? DoubleSide : FrontSide,
        flatShading: !tissue,
        transparent: !tissue,
        polygonOffset: true,
        polygonOffsetFactor: 1,
        polygonOffsetUnits: 1,
      });
      if (tissue) geometry.setAttribute("normal", new BufferAttribute(new Float32Array(3 * view.vertices), 3));
      const mesh = new Mesh(geometry, material);
      mesh.frustumCulled = false;
      mesh.renderOrder = tissue ? 0 : 2;
      this.scene.add(mesh);
      this.meshes.push({ mesh, tissue });
      if (!tissue) this.tools.push(material);
      if (tissue) {
        const lines = new BufferGeometry();
        lines.setAttribute("position", this.place);
        lines.setIndex(edgesOf(triangles));
        const wire = new LineSegments(lines, new LineBasicMaterial({ color: 0x5a4636, transparent: true, opacity: 0.16 }));
        wire.frustumCulled = false;
        this.wires.add(wire);
      }
    });
    this.scene.add(this.wires);
    this.dotPlace = new BufferAttribute(new Float32Array(3), 3);
    this.dots = new Points(new BufferGeometry(), new PointsMaterial({
      color: 0x0a7d3c, size: 6, sizeAttenuation: false, depthTest: false, transparent: true, map: disc(), alphaTest: 0.4 }));
    this.dots.geometry.setAttribute("position", this.dotPlace);
    this.dots.frustumCulled = false;
    this.dots.renderOrder = 5;
    this.contactArrows = new Arrows(0x0a7d3c, 0.0022, size);
    this.toolArrow = new Arrows(0x0b57c4, 0.0048, size);
    this.scene.add(this.dots, this.contactArrows.group, this.toolArrow.group);
  }

  // Shows the run as it is at a tick; `look` is what the reader chose.
  show(tick, look, zoom) {
    const { view, run } = this;
    const f = run.frameAt(tick);
    this.frame = f;
    view.place(run.quantised[f], this.positions);
    this.place.needsUpdate = true;
    this.paint(f, look);
    for (const { mesh, tissue } of this.meshes) if (tissue) mesh.geometry.computeVertexNormals();
    for (const material of this.tools) {
      material.opacity = look.solid ? 1 : 0.34;
      material.depthWrite = look.solid;
    }
    this.wires.visible = look.mesh;
    this.forces(f, look, zoom);
    return run.frames[f];
  }

  paint(f, look) {
    const { run, colours, positions, rest } = this;
    const field = run.fields[look.field];
    for (const body of this.view.bodies) {
      if (body.kind !== "tissue") continue;
      const [first, count] = body.vertices;
      for (let v = first; v < first + count; ++v) {
        let value = 0;
        if (look.field === "displacement") {
          value = Math.hypot(positions[3 * v] - rest[3 * v], positions[3 * v + 1] - rest[3 * v + 1],
            positions[3 * v + 2] - rest[3 * v + 2]);
        } else if (field) {
          value = (field.values[f * this.view.tissue_vertices + this.view.tissueNumber[v]] / 255) * field.max;
        }
        colours.array[2 * v] = (0.5 + 255 * Math.min(1, value / look.top)) / 256;
      }
    }
    colours.needsUpdate = true;
  }

  // Arrows keep their size on the screen, whatever the distance: their length tells by how much forces differ.
  forces(f, look, zoom) {
    const { view, run } = this;
    const [from, to] = [run.starts[f], run.starts[f + 1]];
    const points = [];
    const arrows = [];
    this.contactMiddle = to > from ? new Vector3() : null;
    for (let k = from; k < to; ++k) {
      const at = new Vector3(...[0, 1, 2].map((c) => view.low[c] + view.step[c] * run.points[3 * k + c]));
      points.push(at.x, at.y, at.z);
      this.contactMiddle.addScaledVector(at, 1 / (to - from));
      const force = new Vector3(...[0, 1, 2].map((c) => run.force_step * run.forces[3 * k + c]));
      if (force.length() > 0.01 * look.contactForce) {
        // Its head is at the contact: what presses from above would else be hidden beneath the tissue.
        const drawn = force.multiplyScalar(zoom * look.contactScale);
        arrows.push([at.clone().sub(drawn), drawn]);
      }
    }
    this.dotPlace = new BufferAttribute(Float32Array.from(points.length ? points : [0, 0, 0]), 3);
    this.dots.geometry.setAttribute("position", this.dotPlace);
    this.dots.geometry.setDrawRange(0, points.length / 3);
    this.dots.visible = look.contacts;
    this.contactArrows.set(look.forces ? arrows : [], zoom);
    const tick = run.frames[f];
    const force = new Vector3(...run.force.slice(3 * tick, 3 * tick + 3));
    const strong = view.tool && force.length() > 0.01 * look.toolForce;
    const pushed = [0, 1, 2].map((c) => run.toolPoints[3 * f + c]);
    const anchor = !strong ? null : pushed[0] === 65535 ? new Vector3().fromArray(this.positions, 3 * view.tool.vertex)
      : new Vector3(...pushed.map((q, c) => view.low[c] + view.step[c] * q));
    this.toolArrow.set(look.forces && strong ? [[anchor, force.multiplyScalar(zoom * look.toolScale)]] : [], zoom);
  }
}

export class Stage {
  constructor(canvas, surface, view, words) {
    this.words = words;
    this.view = view;
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.setScissorTest(true);
    view.tissueNumber = new Int32Array(view.vertices).fill(-1);
    let number = 0;
    for (const body of view.bodies) {
      if (body.kind !== "tissue") continue;
      for (let v = body.vertices[0]; v < body.vertices[0] + body.vertices[1]; ++v) view.tissueNumber[v] = number++;
    }
    this.frameUp();
    this.pictures = view.runs.map((run) => new Picture(view, run, this.size));
    this.camera = new PerspectiveCamera(32, 1, 0.01 * this.size, 40 * this.size);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, surface);
    this.shown = [];
    this.home();
    this.controls.addEventListener("change", () => this.turned());
  }

  // What the camera looks at: the tissue, or all bodies where there is none; told by where it is at rest.
  frameUp() {
    const { view } = this;
    const rest = new Float32Array(3 * view.vertices);
    view.place(view.rest, rest);
    const tissue = view.bodies.filter((body) => body.kind === "tissue");
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const body of tissue.length ? tissue : view.bodies) {
      for (let v = body.vertices[0]; v < body.vertices[0] + body.vertices[1]; ++v) {
        for (let c = 0; c < 3; ++c) {
          low[c] = Math.min(low[c], rest[3 * v + c]);
          high[c] = Math.max(high[c], rest[3 * v + c]);
        }
      }
    }
    this.middle = new Vector3(...low).add(new Vector3(...high)).multiplyScalar(0.5);
    this.size = new Vector3(...high).sub(new Vector3(...low)).length();
  }

  home() {
    this.look(this.middle, fromFront, 1.5);
  }

  // Nearer to the contacts of the shown runs; from where one looks now.
  near(sizes = 0.45) {
    const points = this.shown.map((k) => this.pictures[k].contactMiddle).filter((point) => point);
    const middle = points.reduce((sum, point) => sum.add(point), new Vector3()).divideScalar(points.length || 1);
    const direction = this.camera.position.clone().sub(this.controls.target).normalize();
    this.look(points.length ? middle : this.middle, direction, sizes);
  }

  look(target, direction, sizes) {
    this.camera.position.copy(target).addScaledVector(direction, sizes * this.size);
    this.controls.target.copy(target);
    this.controls.update();
    this.draw();
  }

  zoom() {
    return this.camera.position.distanceTo(this.controls.target) / (1.5 * this.size);
  }

  turned() {
    for (const k of this.shown) this.pictures[k].forces(this.pictures[k].frame, this.chosen, this.zoom());
    this.draw();
  }

  show(shown, tick, look) {
    this.shown = shown;
    this.chosen = look;
    const ticks = shown.map((k) => this.pictures[k].show(tick, look, this.zoom()));
    this.draw();
    return ticks;
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0 || this.shown.length === 0) return;
    if (this.width !== width || this.height !== height) {
      this.renderer.setSize(width, height, false);
      [this.width, this.height] = [width, height];
    }
    const part = width / this.shown.length;
    this.camera.aspect = part / height;
    // Right of and below the words.
    const words = this.words ? 1 : 0;
    this.camera.setViewOffset(part, height, -0.1 * words * part, -0.07 * words * height, part, height);
    this.camera.updateProjectionMatrix();
    this.shown.forEach((k, i) => {
      this.renderer.setViewport(i * part, 0, part, height);
      this.renderer.setScissor(i * part, 0, part, height);
      this.renderer.render(this.pictures[k].scene, this.camera);
    });
  }
}
