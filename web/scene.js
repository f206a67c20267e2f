// SPDX-License-Identifier: Apache-2.0
// The flight in three dimensions: W, z up, metres.
import * as THREE from "./three.module.min.js";
import { OrbitControls } from "./OrbitControls.js";
import { HEALTH } from "./colours.js";
import { principalAxes } from "./ellipsoid.js";

const MOST_PATH = 40_000, MOST_CLOUD = 40_000, MOST_WINDOW = 2000, MOST_KEYFRAMES = 2100;
const ELLIPSOID_SIGMAS = 3;
const SMALLEST_ON_SCREEN = 0.012;  // of the viewing distance; a smaller ellipsoid is enlarged by powers of ten

/// Ring buffer of points or line segments: when it is full the newest replace the oldest.
class Buffer {
  constructor(most, coloured) {
    this.most = most;
    this.places = new Float32Array(3 * most);
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(this.places, 3));
    if (coloured) {
      this.colours = new Float32Array(3 * most);
      this.geometry.setAttribute("color", new THREE.BufferAttribute(this.colours, 3));
    }
    this.clear();
  }
  clear() { this.count = 0; this.geometry.setDrawRange(0, 0); }
  push(place, colour) {
    const i = this.count++ % this.most;
    this.places.set(place, 3 * i);
    if (colour) this.colours.set([colour.r, colour.g, colour.b], 3 * i);
  }
  changed() {
    this.geometry.setDrawRange(0, Math.min(this.count, this.most));
    for (const attribute of Object.values(this.geometry.attributes)) attribute.needsUpdate = true;
  }
}

const healthColours = Object.fromEntries(Object.entries(HEALTH).map(([state, colour]) => [state, new THREE.Color(colour)]));

function makePoints(buffer, size, options) {
  const points = new THREE.Points(buffer.geometry, new THREE.PointsMaterial({ size, sizeAttenuation: false, ...options }));
  points.frustumCulled = false;
  return points;
}

export class Scene {
  constructor(canvas, onEllipsoid, onGrid) {
    this.canvas = canvas;
    this.onEllipsoid = onEllipsoid;
    this.onGrid = onGrid;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });  // throws where there is no WebGL
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color("#10171b");
    this.eye = new THREE.PerspectiveCamera(50, 1, 0.02, 5000);
    this.eye.up.set(0, 0, 1);
    this.eye.position.set(-1.5, -2.4, 1.8);
    this.controls = new OrbitControls(this.eye, canvas);
    this.controls.maxPolarAngle = 0.99 * Math.PI;
    this.controls.addEventListener("change", () => this.wake());
    this.controls.addEventListener("start", () => { this.touched = true; });
    this.follows = true;
    this.makeThings();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  makeThings() {
    this.path = new Buffer(MOST_PATH, true);
    this.whole = new Buffer(MOST_PATH, false);
    this.cloud = new Buffer(MOST_CLOUD, false);
    this.window = new Buffer(MOST_WINDOW, false);
    this.keyframes = new Buffer(MOST_KEYFRAMES, false);
    this.mapped = new Buffer(MOST_KEYFRAMES, false);
    const line = new THREE.LineSegments(this.path.geometry, new THREE.LineBasicMaterial({ vertexColors: true }));
    const faint = new THREE.LineSegments(this.whole.geometry, new THREE.LineBasicMaterial({ color: "#3d4d58" }));
    for (const thing of [line, faint]) thing.frustumCulled = false;
    this.scene.add(faint, line,
      makePoints(this.cloud, 1.6, { color: "#6c7f8c", transparent: true, opacity: 0.75 }),
      makePoints(this.window, 3, { color: "#ffc66b" }),
      makePoints(this.mapped, 2, { color: "#8f6cb0", transparent: true, opacity: 0.6 }),
      makePoints(this.path, 2.2, { vertexColors: true }),  // as lines are always one pixel wide in WebGL
      makePoints(this.keyframes, 5, { color: "#c58cf0" }));
    this.body = new THREE.AxesHelper(0.4);
    this.body.visible = false;
    this.ellipsoid = new THREE.Mesh(new THREE.SphereGeometry(1, 32, 20),
      new THREE.MeshBasicMaterial({ color: "#63b8f2", transparent: true, opacity: 0.33, depthWrite: false }));
    this.ellipsoid.visible = false;
    this.ellipsoid.matrixAutoUpdate = false;
    this.scene.add(this.body, this.ellipsoid);
    this.setGrid(20, 1);
  }

  /// `size`: of one cell, metres. Drawn cell by cell, as some browsers do not draw a long line that passes by the eye whole.
  setGrid(cells, size) {
    if (this.grid) { this.scene.remove(this.grid); this.grid.geometry.dispose(); this.grid.material.dispose(); }
    const half = cells * size / 2, places = [];
    for (let i = 0; i <= cells; ++i) {
      for (let k = 0; k < cells; ++k) {
        const a = i * size - half, b = k * size - half;
        places.push(a, b, 0, a, b + size, 0, b, a, 0, b + size, a, 0);
      }
    }
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    this.grid = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: "#2a3840" }));
    this.scene.add(this.grid);
    this.cell = size;
    this.onGrid(size);
  }

  clear() {
    for (const buffer of [this.path, this.cloud, this.window, this.keyframes, this.mapped]) buffer.clear();
    this.seen = new Map();
    this.last = undefined;
    this.box = undefined;
    this.body.visible = this.ellipsoid.visible = false;
    this.wake();
  }

  /// Adds a point, with a line from the one before if that was in the same W.
  addPath(point, reset, health) {
    const colour = healthColours[health] ?? healthColours.none;
    if (this.last && this.last.reset === reset) {
      this.path.push(this.last.point, colour);
      this.path.push(point, colour);
    } else if (this.last) {
      this.cloud.clear();  // another W
      this.seen.clear();
    }
    this.last = { point, reset };
    this.box ??= new THREE.Box3();
    this.box.expandByPoint(new THREE.Vector3(...point));
  }
  pathChanged() {
    this.path.changed();
    this.fitGrid();
    this.keepInView();
    this.wake();
  }
  /// Adapts the distance as the path grows, until the viewer moves the view.
  keepInView() {
    if (this.touched || !this.follows || !this.box) return;
    const away = this.eye.position.clone().sub(this.controls.target);
    const wanted = Math.min(Math.max(1.3 * this.box.getSize(new THREE.Vector3()).length(), 2.5), 40);
    this.eye.position.copy(this.controls.target).addScaledVector(away.normalize(), wanted);
  }
  fitGrid() {
    if (!this.box) return;
    const reach = Math.max(...[this.box.min, this.box.max].flatMap(p => [Math.abs(p.x), Math.abs(p.y)]), 4);
    const cell = 10 ** Math.max(0, Math.ceil(Math.log10(reach / 12)));
    if (cell !== this.cell || this.gridReach < reach) {
      this.gridReach = 2 * reach;
      this.setGrid(2 * Math.ceil(this.gridReach / cell), cell);
    }
  }
  showWhole(points) {
    this.whole.clear();
    for (let i = 1; i < points.length; ++i) {
      if (points[i][4] !== points[i - 1][4]) continue;
      this.whole.push(points[i - 1].slice(1, 4));
      this.whole.push(points[i].slice(1, 4));
    }
    this.whole.changed();
    this.wake();
  }

  showPose(position, [w, x, y, z], covariance) {
    const place = new THREE.Vector3(...position);
    if (this.follows) {
      const step = place.clone().sub(this.controls.target);
      this.controls.target.add(step);
      this.eye.position.add(step);
    }
    this.body.visible = true;
    this.body.position.copy(place);
    this.body.quaternion.set(x, y, z, w);
    this.covariance = covariance;
    this.placeEllipsoid();
    this.wake();
  }

  /// Three standard deviations; enlarged by powers of ten where that is too small to see.
  placeEllipsoid() {
    if (!this.covariance || this.covariance.some(x => !Number.isFinite(x))) return;
    const { values, vectors } = principalAxes(this.covariance);
    const sizes = values.map(value => ELLIPSOID_SIGMAS * Math.sqrt(value));
    const visible = SMALLEST_ON_SCREEN * this.eye.position.distanceTo(this.body.position);
    let scale = 1;
    while (Math.max(...sizes) * scale < visible && scale < 1000) scale *= 10;
    const columns = [0, 1, 2].map(k => new THREE.Vector3(vectors[0][k], vectors[1][k], vectors[2][k]).multiplyScalar(Math.max(scale * sizes[k], 1e-6)));
    this.ellipsoid.matrix.makeBasis(...columns).setPosition(this.body.position);
    this.ellipsoid.visible = true;
    if (scale !== this.ellipsoidScale) this.onEllipsoid(this.ellipsoidScale = scale);
  }

  showKeyframes(points) { this.refill(this.keyframes, points); }
  showMapped(points) { this.refill(this.mapped, points); }
  refill(buffer, points) {
    buffer.clear();
    for (const point of points) buffer.push(point);
    buffer.changed();
    this.wake();
  }

  /// Shows landmarks of the window; those that have left it stay where they were seen last.
  showPoints(message, inWindow) {
    if (inWindow) this.window.clear();
    for (let i = 0; i < message.count; ++i) {
      const place = message.numbers.subarray(4 * i + 1, 4 * i + 4);
      if (inWindow) this.window.push(place);
      this.remember(message.ids[4 * i], place);
    }
    if (inWindow) this.window.changed();
    this.cloud.changed();
    this.wake();
  }
  remember(track, place) {
    const known = this.seen.get(track);
    if (known !== undefined && this.cloud.count - known <= MOST_CLOUD) {
      this.cloud.places.set(place, 3 * (known % MOST_CLOUD));
    } else {
      this.seen.set(track, this.cloud.count);
      this.cloud.push(place);
      if (this.seen.size > 2 * MOST_CLOUD) this.seen = new Map([...this.seen].slice(-MOST_CLOUD));
    }
  }

  /// Shows the whole path, from the side or from above.
  fit(fromAbove) {
    this.touched = true;
    const box = this.box?.clone() ?? new THREE.Box3(new THREE.Vector3(-2, -2, -1), new THREE.Vector3(2, 2, 1));
    const middle = box.getCenter(new THREE.Vector3());
    const reach = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1.5);
    const away = reach / Math.sin(0.5 * this.eye.fov * Math.PI / 180) / Math.min(1, this.eye.aspect);
    const direction = fromAbove ? new THREE.Vector3(0, -1e-3, 1) : new THREE.Vector3(-0.55, -0.75, 0.55);
    this.controls.target.copy(middle);
    this.eye.position.copy(middle).addScaledVector(direction.normalize(), away);
    this.controls.update();
    this.wake();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.eye.aspect = width / height;
    this.eye.updateProjectionMatrix();
    this.wake();
  }

  /// Drawn only when something has changed.
  wake() {
    if (this.drawing) return;
    this.drawing = requestAnimationFrame(() => {
      this.drawing = undefined;
      this.placeEllipsoid();
      this.controls.update();
      this.renderer.render(this.scene, this.eye);
    });
  }
}
