/** Mouse, touch and keyboard control of the view; a click picks a point, and a drag can select a rectangle. */

import type { Rectangle } from "../cloud/region_pick";
import type { Orbit, ViewName } from "./orbit";

/** Rotation by a drag across the height of the view. */
const TURN_RAD = Math.PI;

/** A press with less movement is a click, CSS px. */
const CLICK_PX = 4;

/** Zoom per wheel pixel, and zoom factor of a key. */
const ZOOM_PER_PX = 0.0012;
const KEY_ZOOM = 0.85;

/** Rotation and pan of an arrow key. */
const KEY_TURN_RAD = Math.PI / 24;
const KEY_PAN = 0.06;

const VIEW_KEYS: Record<string, ViewName> = { "1": "front", "2": "top", "3": "side", "0": "iso" };

export interface ControlEvents {
  /** The view was moved. */
  moved(): void;
  /** A position was clicked, CSS pixels from the top-left corner. */
  picked(x_px: number, y_px: number): void;
  fit(): void;
  view(name: ViewName): void;
  toggleOrthographic(): void;
  /** Clears the picked points. */
  clear(): void;
  /** The rectangle being selected; undefined when the drag has ended. */
  selecting(rectangle: Rectangle | undefined): void;
  /** A rectangle was selected. */
  selected(rectangle: Rectangle): void;
}

interface Finger {
  x: number;
  y: number;
}

function rectangleOf(from: Finger, to: Finger): Rectangle {
  return {
    left_px: Math.min(from.x, to.x),
    top_px: Math.min(from.y, to.y),
    right_px: Math.max(from.x, to.x),
    bottom_px: Math.max(from.y, to.y),
  };
}

/** Listens on a canvas until `dispose`. */
export class Controls {
  private readonly fingers = new Map<number, Finger>();
  private pressed: { x: number; y: number; still: boolean; pan: boolean } | undefined;
  private readonly listening = new AbortController();
  /** Whether a drag selects a rectangle instead of moving the view. */
  selects = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly orbit: Orbit,
    private readonly events: ControlEvents,
  ) {
    const { signal } = this.listening;
    canvas.addEventListener("pointerdown", (event) => this.down(event), { signal });
    canvas.addEventListener("pointermove", (event) => this.move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.up(event), { signal });
    canvas.addEventListener("pointercancel", (event) => this.fingers.delete(event.pointerId), { signal });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
    canvas.addEventListener("wheel", (event) => this.wheel(event), { signal, passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event), { signal });
  }

  dispose(): void {
    this.listening.abort();
  }

  private down(event: PointerEvent): void {
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    this.fingers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    const pan = event.button !== 0 || event.shiftKey;
    this.pressed = { x: event.offsetX, y: event.offsetY, still: this.fingers.size === 1, pan };
  }

  private move(event: PointerEvent): void {
    const before = this.fingers.get(event.pointerId);
    if (!before || !this.pressed) return;
    const now = { x: event.offsetX, y: event.offsetY };
    if (Math.hypot(now.x - this.pressed.x, now.y - this.pressed.y) > CLICK_PX) this.pressed.still = false;
    if (this.pressed.still) return;
    if (this.selects) {
      this.events.selecting(rectangleOf(this.pressed, now));
      return;
    }
    const height = this.canvas.clientHeight || 1;
    const other = [...this.fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (other) this.pinch(before, now, other, height);
    else if (this.pressed.pan) this.orbit.pan(-(now.x - before.x) / height, (now.y - before.y) / height);
    else this.orbit.turn((TURN_RAD * (before.x - now.x)) / height, (TURN_RAD * (now.y - before.y)) / height);
    this.fingers.set(event.pointerId, now);
    this.events.moved();
  }

  private pinch(before: Finger, now: Finger, other: Finger, height: number): void {
    const [was, is] = [before, now].map((finger) => Math.hypot(finger.x - other.x, finger.y - other.y));
    if (was && is) this.orbit.zoom(was / is);
    this.orbit.pan(-(now.x - before.x) / 2 / height, (now.y - before.y) / 2 / height);
  }

  private up(event: PointerEvent): void {
    this.fingers.delete(event.pointerId);
    const pressed = this.pressed;
    if (this.fingers.size === 0) this.pressed = undefined;
    if (this.selects && pressed && !pressed.still) {
      this.events.selecting(undefined);
      this.events.selected(rectangleOf(pressed, { x: event.offsetX, y: event.offsetY }));
      return;
    }
    if (pressed?.still && event.button === 0) this.events.picked(pressed.x, pressed.y);
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const half = (this.canvas.clientHeight || 2) / 2;
    const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 * event.deltaY : event.deltaY;
    const right = (event.offsetX - this.canvas.clientWidth / 2) / half;
    this.orbit.zoom(Math.exp(ZOOM_PER_PX * pixels), right, 1 - event.offsetY / half);
    this.events.moved();
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.handleKey(event)) return;
    event.preventDefault();
    this.events.moved();
  }

  private handleKey(event: KeyboardEvent): boolean {
    const view = VIEW_KEYS[event.key];
    if (view) this.events.view(view);
    else if (event.key === "o" || event.key === "O") this.events.toggleOrthographic();
    else if (event.key === "f" || event.key === "F") this.events.fit();
    else if (event.key === "+" || event.key === "=") this.orbit.zoom(KEY_ZOOM);
    else if (event.key === "-") this.orbit.zoom(1 / KEY_ZOOM);
    else if (event.key === "p" || event.key === "P" || event.key === "Enter") this.pickCentre();
    else if (event.key === "Escape") this.events.clear();
    else return this.arrow(event.key, event.shiftKey);
    return true;
  }

  private pickCentre(): void {
    this.events.picked(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
  }

  private arrow(key: string, shift: boolean): boolean {
    const direction = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
    if (!direction) return false;
    const [right = 0, up = 0] = direction;
    if (shift) this.orbit.pan(KEY_PAN * right, KEY_PAN * up);
    else this.orbit.turn(KEY_TURN_RAD * right, KEY_TURN_RAD * up);
    return true;
  }
}
