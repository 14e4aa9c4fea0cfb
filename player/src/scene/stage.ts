/**
 * Camera, light and canvas: perspective with orbit in space, truly orthographic with pan and zoom in the
 * plane. Draws only when something has changed, and coarser while things move if that takes long. Knows no runs.
 */

import {
  type Box3,
  Color,
  DirectionalLight,
  HemisphereLight,
  MOUSE,
  type Object3D,
  OrthographicCamera,
  PerspectiveCamera,
  Raycaster,
  Scene,
  TOUCH,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { element } from "../dom";
import { theme } from "../theme";

/** A drawing that takes longer than this, in the median of nine, is made coarser [ms]. */
const SLOW = 40;
/** Resolution while slow drawings follow each other, in pixels of the drawing per pixel of the page [1]. */
const COARSE = 0.6;
/** After this long, and twice as long as it took, without another one a coarse drawing is made again in full [ms]. */
const REST = 150;

/** A part of the canvas with what is drawn there; from 0 to 1 of the width. */
export interface View {
  from: number;
  to: number;
  prepare(): void;
}

/** See the file's head. */
export class Stage {
  readonly canvas: HTMLCanvasElement;
  readonly scene = new Scene();
  readonly camera: PerspectiveCamera | OrthographicCamera;
  readonly controls: OrbitControls;
  /** Views beside each other; one over the whole canvas when empty. */
  views: View[] = [];
  /** Called before each drawing. */
  beforeDraw: () => void = () => {};
  /** Told when drawings become coarse, or full again. */
  onCoarse: (coarse: boolean) => void = () => {};
  private readonly renderer: WebGLRenderer;
  private readonly sky = new HemisphereLight(0xffffff, 0x8a929c, 2.1);
  private readonly sun = new DirectionalLight(0xffffff, 1.7);
  /** The drawing that is asked for, or 0. */
  private asked = 0;
  private slow: boolean;
  /** Whether the drawing is coarse, as it is while time moves and drawing takes long. */
  coarse = false;
  private resting: ReturnType<typeof setTimeout> | undefined;
  private taken: number[] = [];
  private home: Box3 | undefined;
  private width = 1;
  private height = 1;

  constructor(
    private readonly host: HTMLElement,
    private readonly flat: boolean,
    private readonly up: Vector3,
    smooth: boolean,
  ) {
    this.canvas = element("canvas", { "aria-label": "the scene" });
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context: opaque(this.canvas, smooth) });
    this.slow = !smooth; // until it is measured, so that the first drawing of many bodies comes soon
    this.canvas.tabIndex = 0;
    host.append(this.canvas);
    this.camera = flat ? new OrthographicCamera() : new PerspectiveCamera(38, 1, 0.01, 1000);
    if (!flat) this.camera.up.copy(up);
    this.sun.position
      .copy(up)
      .multiplyScalar(3)
      .add(new Vector3(1.2, -1.6, 0.4));
    this.sky.position.copy(up);
    this.scene.add(this.sky, this.sun);
    this.controls = this.controlled();
    new ResizeObserver(() => this.resize()).observe(host);
    this.resize();
    this.retheme();
  }

  add(...objects: Object3D[]): void {
    this.scene.add(...objects);
    this.draw();
  }

  /** Looks at a box from a usual place. */
  lookAt(box: Box3): void {
    this.home = box;
    const center = box.getCenter(new Vector3());
    const size = box.getSize(new Vector3());
    this.controls.target.copy(center);
    const aspect = this.aspect();
    if (this.camera instanceof OrthographicCamera) {
      this.camera.zoom = 1;
      const half = 0.56 * Math.max(size.y, size.x / aspect);
      this.frame(half, aspect);
      this.camera.position.set(center.x, center.y, 10);
      this.camera.near = 0.1;
      this.camera.far = 20;
    } else {
      const distance = this.distanceTo(box, aspect);
      this.camera.position.copy(center).addScaledVector(this.viewpoint(), distance);
      this.camera.near = distance / 200;
      this.camera.far = distance * 40;
    }
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  /** Back to where the camera began. */
  reset(): void {
    if (this.home) this.lookAt(this.home);
  }

  /** Moves the camera along with what it looks at. */
  shift(by: Vector3): void {
    this.controls.target.add(by);
    this.camera.position.add(by);
    this.controls.update();
  }

  /** Asks for a drawing before the next frame of the page. */
  draw(): void {
    if (!this.asked) this.asked = requestAnimationFrame(() => this.drawNow());
  }

  /** Draws at once, in full. */
  drawFull(): void {
    this.setCoarse(false);
    this.render();
  }

  private drawNow(): void {
    this.setCoarse(this.slow);
    const begun = performance.now();
    this.render();
    // the graphics processor works on after the calls have returned; the next frame of the page waits for it
    clearTimeout(this.resting);
    requestAnimationFrame(() => {
      const taken = performance.now() - begun;
      this.judge(taken);
      clearTimeout(this.resting);
      // where drawings take long, the next one may still come: a full one between them would cost several
      if (this.coarse && !this.asked) this.resting = setTimeout(() => this.drawFull(), REST + 2 * taken);
    });
  }

  private render(): void {
    cancelAnimationFrame(this.asked);
    this.asked = 0;
    this.beforeDraw();
    const { width, height } = this;
    this.renderer.setScissorTest(this.views.length > 0);
    const views = this.views.length ? this.views : [{ from: 0, to: 1, prepare: () => {} }];
    for (const { from, to, prepare } of views) {
      prepare();
      this.renderer.setViewport(from * width, 0, (to - from) * width, height);
      this.renderer.setScissor(from * width, 0, (to - from) * width, height);
      this.renderer.render(this.scene, this.camera);
    }
  }

  /** Which of the views a point of the page is in; 0 where there is but one. */
  viewAt(x: number): number {
    const place = this.canvas.getBoundingClientRect();
    const across = (x - place.left) / place.width;
    return Math.max(
      0,
      this.views.findIndex(({ from, to }) => across >= from && across < to),
    );
  }

  /** The ray under a point of the page. */
  rayAt(x: number, y: number): Raycaster {
    const place = this.canvas.getBoundingClientRect();
    let across = (x - place.left) / place.width;
    const view = this.views[this.viewAt(x)];
    if (view) across = (across - view.from) / (view.to - view.from);
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(2 * across - 1, 1 - (2 * (y - place.top)) / place.height), this.camera);
    return ray;
  }

  /** Where a point of the scene is on the page, in pixels from the canvas's corner. */
  toScreen(point: Vector3): { x: number; y: number } {
    const seen = point.clone().project(this.camera);
    const width = this.views.length ? (this.views[0].to - this.views[0].from) * this.width : this.width;
    return { x: ((seen.x + 1) / 2) * width, y: ((1 - seen.y) / 2) * this.height };
  }

  /** Metres per pixel where the camera looks. */
  scale(): number {
    if (this.camera instanceof OrthographicCamera) {
      return (this.camera.top - this.camera.bottom) / this.camera.zoom / this.height;
    }
    const distance = this.camera.position.distanceTo(this.controls.target);
    return (2 * distance * Math.tan((this.camera.fov * Math.PI) / 360)) / this.height;
  }

  /** Half of the longer side of what is seen where the camera looks [m]. */
  sight(): number {
    return (this.scale() * Math.max(this.width, this.height)) / 2;
  }

  /** Takes the colours of the theme. */
  retheme(): void {
    this.scene.background = new Color(theme().background);
    this.sky.groundColor.set(theme().dark ? 0x30363d : 0x9aa2ab);
    this.sky.intensity = theme().dark ? 1.6 : 2.1;
    this.draw();
  }

  /** The canvas's size follows the page's. */
  resize(): void {
    this.fit();
    this.draw();
  }

  private fit(): void {
    this.width = Math.max(1, this.host.clientWidth);
    this.height = Math.max(1, this.host.clientHeight);
    this.renderer.setPixelRatio(this.coarse ? COARSE : Math.min(devicePixelRatio, 2));
    this.renderer.setSize(this.width, this.height, false);
    const aspect = this.aspect();
    if (this.camera instanceof OrthographicCamera) this.frame(this.camera.top || 1, aspect);
    else this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /** How far the camera must be from a box's centre to see all of it [m]. */
  private distanceTo(box: Box3, aspect: number): number {
    const { camera } = this;
    if (!(camera instanceof PerspectiveCamera)) return 1;
    const tangent = 0.9 * Math.tan((camera.fov * Math.PI) / 360);
    const toCamera = this.viewpoint();
    const right = new Vector3().crossVectors(this.up, toCamera).normalize();
    const above = new Vector3().crossVectors(toCamera, right);
    const center = box.getCenter(new Vector3());
    let distance = 0;
    for (let corner = 0; corner < 8; corner++) {
      const at = new Vector3(
        corner & 1 ? box.max.x : box.min.x,
        corner & 2 ? box.max.y : box.min.y,
        corner & 4 ? box.max.z : box.min.z,
      ).sub(center);
      const across = Math.max(Math.abs(at.dot(above)), Math.abs(at.dot(right)) / aspect);
      distance = Math.max(distance, at.dot(toCamera) + across / tangent);
    }
    return distance;
  }

  /** Width over height of a view. */
  private aspect(): number {
    const share = this.views.length ? this.views[0].to - this.views[0].from : 1;
    return (share * this.width) / this.height;
  }

  private frame(half: number, aspect: number): void {
    if (!(this.camera instanceof OrthographicCamera)) return;
    this.camera.top = half;
    this.camera.bottom = -half;
    this.camera.left = -half * aspect;
    this.camera.right = half * aspect;
  }

  /** From the front, a little from the right and from above. */
  private viewpoint(): Vector3 {
    const up = this.up;
    const front = Math.abs(up.y) > 0.9 ? new Vector3(0, 0, 1) : new Vector3(0, -1, 0);
    const right = new Vector3().crossVectors(front.clone().negate(), up).normalize();
    return front.addScaledVector(right, 0.45).addScaledVector(up, 0.5).normalize();
  }

  private controlled(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.enableDamping = false;
    controls.zoomToCursor = true;
    if (this.flat) {
      controls.enableRotate = false;
      controls.mouseButtons = { LEFT: MOUSE.PAN, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
      controls.touches = { ONE: TOUCH.PAN, TWO: TOUCH.DOLLY_PAN };
    }
    controls.addEventListener("change", () => this.draw());
    return controls;
  }

  private setCoarse(on: boolean): void {
    if (on === this.coarse) return;
    this.coarse = on;
    this.onCoarse(on);
    this.fit();
  }

  /** Whether drawing is slow, by the median of the last nine; the first ones compile programs. */
  private judge(milliseconds: number): void {
    this.taken.push(milliseconds);
    if (this.taken.length < 9) return;
    const median = this.taken.sort((a, b) => a - b)[4];
    this.taken = [];
    this.slow = median > (this.slow ? SLOW / 4 : SLOW);
  }
}

/** What three draws with; opaque, which it cannot be asked for: a page mixes nothing with what lies under it. */
function opaque(canvas: HTMLCanvasElement, antialias: boolean): WebGL2RenderingContext {
  const context = canvas.getContext("webgl2", {
    alpha: false,
    antialias,
    powerPreference: "high-performance",
    preserveDrawingBuffer: true, // pictures and films read it after it was drawn
  });
  if (!context)
    throw new Error(
      "This page needs WebGL 2, which this browser lacks or has switched off; another browser, or its settings for graphics, may have it.",
    );
  return context;
}
