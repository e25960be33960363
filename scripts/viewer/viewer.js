// The 3D view of a scan's page: the scanned points, both rims and the simulated drape, turned by mouse, touch and
// keyboard. Drawn when something changes, not all the time. Without WebGL the still picture stays.
//
// In: a figure with the data as JSON (see `src/report/page/shown.rs`), a canvas, buttons `data-view` and boxes
// `data-layer`. Positions come as 16-bit numbers in a cube, base64; metres, simulation frame (y up, warp along x).

import {
  AmbientLight, BufferAttribute, BufferGeometry, CanvasTexture, CatmullRomCurve3, Color, CylinderGeometry,
  DirectionalLight, DoubleSide, Group, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  PerspectiveCamera, Points, PointsMaterial, Scene, Spherical, Sprite, SpriteMaterial, TubeGeometry, Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

/** Where from: azimuth from +x and elevation [deg]. */
const VIEWS = { oblique: [35, 28], above: [90, 89.9], front: [90, 4], side: [0, 4] };
/** A key's turn [deg] and zoom. */
const STEP = 6;
const ZOOM = 1.12;

/** Floats of a base64 text of little-endian 16-bit numbers in a cube. */
function positions(text, { min, size }) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const whole = new Uint16Array(bytes.buffer);
  return Float32Array.from(whole, (q, k) => min[k % 3] + (q / 65535) * size);
}

function geometryOf(floats) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(floats, 3));
  return geometry;
}

/** A closed tube through the rim's points; corners are there twice. */
function tube(floats, radius) {
  const points = [];
  for (let k = 0; k < floats.length; k += 3) {
    const point = new Vector3(floats[k], floats[k + 1], floats[k + 2]);
    const before = points[points.length - 1];
    if (!before || before.distanceTo(point) > 1e-4) points.push(point);
  }
  if (points[0].distanceTo(points[points.length - 1]) < 1e-4) points.pop();
  return new TubeGeometry(new CatmullRomCurve3(points, true), 2 * points.length, radius, 6, true);
}

/** A square sheet of n x n places, the second coordinate running fastest. */
function sheet(floats, n) {
  const geometry = geometryOf(floats);
  const index = [];
  for (let i = 0; i + 1 < n; i++) {
    for (let j = 0; j + 1 < n; j++) {
      const a = i * n + j;
      index.push(a, a + 1, a + n, a + 1, a + n + 1, a + n);
    }
  }
  geometry.setIndex(index);
  geometry.computeVertexNormals();
  return geometry;
}

/** A word that always faces the viewer. */
function word(text) {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [192, 64];
  const pen = canvas.getContext('2d');
  pen.font = '600 40px system-ui, sans-serif';
  pen.textAlign = 'center';
  pen.textBaseline = 'middle';
  pen.fillStyle = '#fff';
  pen.fillText(text, 96, 32);
  const sprite = new Sprite(new SpriteMaterial({ map: new CanvasTexture(canvas), transparent: true }));
  sprite.scale.set(0.042, 0.014, 1);
  return sprite;
}

/** The parts of the scene, by layer, each with the style's variable that colours it. */
function parts(data) {
  const rim = positions(data.scanned, data.cube);
  let [reach, low] = [0, 0];
  for (let k = 0; k < rim.length; k += 3) {
    reach = Math.max(reach, Math.hypot(rim[k], rim[k + 2]));
    low = Math.min(low, rim[k + 1]);
  }
  const colored = [];
  const paint = (material, name) => {
    colored.push([material, name]);
    return material;
  };
  const layers = {};
  const of = (text) => positions(text, data.cube);
  if (data.points) {
    const dots = new PointsMaterial({ size: 0.0016 });
    layers.points = new Points(geometryOf(of(data.points)), paint(dots, '--cloud'));
  }
  if (data.sheet) {
    const cloth = new MeshLambertMaterial({
      side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    layers.sheet = new Mesh(sheet(of(data.sheet), data.side), paint(cloth, '--sheet'));
  }
  layers.scanned = new Mesh(tube(rim, 0.001), paint(new MeshBasicMaterial(), '--scanned'));
  if (data.simulated) {
    layers.simulated = new Mesh(tube(of(data.simulated), 0.0009), paint(new MeshBasicMaterial(), '--simulated'));
  }
  const bench = new Group();
  const plate = new Mesh(new CylinderGeometry(data.plate, data.plate, 0.003, 96), paint(new MeshLambertMaterial(), '--plate'));
  plate.position.y = -0.0025;
  bench.add(plate);
  const line = paint(new LineBasicMaterial(), '--faint');
  for (const [name, x, z] of [['warp', 1, 0], ['weft', 0, 1]]) {
    const way = [reach + 0.006, reach + 0.026].flatMap((r) => [r * x, 0.55 * low, r * z]);
    bench.add(new Line(geometryOf(Float32Array.from(way)), line));
    const label = word(name);
    paint(label.material, '--faint');
    label.position.set((reach + 0.042) * x, 0.55 * low, (reach + 0.042) * z);
    bench.add(label);
  }
  layers.bench = bench;
  return { layers, colored, target: 0.48 * low, distance: 0.2 + 2.9 * reach };
}

class View {
  constructor(figure) {
    this.figure = figure;
    this.canvas = figure.querySelector('canvas');
    const data = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 4 / 3, 0.02, 5);
    const { layers, colored, target, distance } = parts(data);
    Object.assign(this, { layers, colored, target, distance });
    Object.values(layers).forEach((part) => this.scene.add(part));
    this.scene.add(new AmbientLight(0xffffff, 1.5));
    this.light = new DirectionalLight(0xffffff, 2.0);
    this.scene.add(this.light);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enablePan = false;
    this.controls.enableZoom = false;
    this.controls.minDistance = 0.3 * distance;
    this.controls.maxDistance = 2.5 * distance;
    this.controls.addEventListener('change', () => this.draw());
    this.listen();
    this.paint();
    this.look('oblique');
  }

  /** Colours from the page's style, which knows of light and dark. */
  paint() {
    const style = getComputedStyle(this.figure);
    for (const [material, name] of this.colored) {
      material.color = new Color(style.getPropertyValue(name).trim() || '#888');
    }
    this.draw();
  }

  look(name) {
    const [azimuth, elevation] = VIEWS[name];
    this.place(azimuth, elevation, this.distance);
  }

  place(azimuth, elevation, distance) {
    const up = Math.max(-89.9, Math.min(89.9, elevation));
    const at = new Spherical(distance, ((90 - up) * Math.PI) / 180, ((90 - azimuth) * Math.PI) / 180);
    this.controls.target.set(0, this.target, 0);
    this.camera.position.setFromSpherical(at).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  /** Azimuth from +x towards +z, elevation [deg], distance [m]. */
  where() {
    const from = this.camera.position.clone().sub(this.controls.target);
    const azimuth = (Math.atan2(from.z, from.x) * 180) / Math.PI;
    const elevation = (Math.asin(from.y / from.length()) * 180) / Math.PI;
    return [azimuth, elevation, from.length()];
  }

  draw() {
    if (this.due) return;
    this.due = requestAnimationFrame(() => {
      this.due = 0;
      const box = this.canvas.parentElement.getBoundingClientRect();
      const [width, height] = [Math.round(box.width), Math.round(box.height)];
      if (width === 0 || height === 0) return;
      if (this.canvas.dataset.size !== `${width}x${height}`) {
        this.canvas.dataset.size = `${width}x${height}`;
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
      }
      this.light.position.copy(this.camera.position).add(new Vector3(0.1, 0.35, 0.1));
      this.renderer.render(this.scene, this.camera);
      const [azimuth, elevation] = this.where();
      const said = `seen from ${Math.round((azimuth + 360) % 360)}\u00b0 from the warp, ${Math.round(elevation)}\u00b0 up`;
      this.figure.querySelector('[data-said]').textContent = said;
    });
  }

  listen() {
    const { canvas, figure, controls } = this;
    // the page scrolls over a view that nobody has touched
    canvas.addEventListener('pointerdown', () => canvas.focus({ preventScroll: true }));
    canvas.addEventListener('focus', () => { controls.enableZoom = true; });
    canvas.addEventListener('blur', () => { controls.enableZoom = false; });
    canvas.addEventListener('keydown', (event) => this.key(event));
    figure.querySelectorAll('[data-view]').forEach((button) => {
      button.addEventListener('click', () => this.look(button.dataset.view));
    });
    figure.querySelectorAll('[data-layer]').forEach((box) => {
      const layer = this.layers[box.dataset.layer];
      const show = () => { if (layer) layer.visible = box.checked; this.draw(); };
      box.addEventListener('change', show);
      show();
    });
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
    window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.paint());
  }

  key(event) {
    const [azimuth, elevation, distance] = this.where();
    const moves = {
      ArrowLeft: [azimuth + STEP, elevation, distance], ArrowRight: [azimuth - STEP, elevation, distance],
      ArrowUp: [azimuth, elevation + STEP, distance], ArrowDown: [azimuth, elevation - STEP, distance],
      '+': [azimuth, elevation, distance / ZOOM], '=': [azimuth, elevation, distance / ZOOM],
      '-': [azimuth, elevation, distance * ZOOM], Home: [...VIEWS.oblique, this.distance], 0: [...VIEWS.oblique, this.distance],
    };
    const to = moves[event.key];
    if (!to || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.place(to[0], to[1], Math.max(0.3 * this.distance, Math.min(2.5 * this.distance, to[2])));
  }
}

document.querySelectorAll('[data-view3d]').forEach((figure) => {
  try {
    new View(figure);
    figure.classList.add('live');
  } catch (fault) {
    // no WebGL: the still picture stays, and says so
    figure.classList.add('still');
  }
});
