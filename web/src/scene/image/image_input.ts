/** Mouse, touch, wheel and keyboard input on an image. */

/** Actions on an image; positions are CSS px from the top-left corner of the container. */
export interface ImageControls {
  zoomAt(factor: number, x: number, y: number): void;
  pan(dx: number, dy: number): void;
  fit(): void;
  /** The pointer moved; `undefined`: it has left. */
  point(x: number | undefined, y: number): void;
}

/** Zoom factor of one wheel notch (100 px). */
const WHEEL_FACTOR = 1.25;
const KEY_FACTOR = 1.25;
const KEY_PAN_PX = 40;

/** Listens on `container` until the returned function is called. */
export function listen(container: HTMLElement, controls: ImageControls): () => void {
  const ended = new AbortController();
  const { signal } = ended;
  const down = new Map<number, { x: number; y: number }>();
  const at = (event: MouseEvent) => {
    const box = container.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };

  container.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const { x, y } = at(event);
      controls.zoomAt(WHEEL_FACTOR ** (-event.deltaY / 100), x, y);
      controls.point(x, y);
    },
    { signal, passive: false },
  );
  container.addEventListener(
    "pointerdown",
    (event) => {
      if (event.button !== 0) return;
      down.set(event.pointerId, at(event));
      container.setPointerCapture(event.pointerId);
    },
    { signal },
  );
  container.addEventListener(
    "pointermove",
    (event) => {
      const now = at(event);
      const before = down.get(event.pointerId);
      if (before) drag(down, event.pointerId, before, now, controls);
      controls.point(now.x, now.y);
    },
    { signal },
  );
  const up = (event: PointerEvent) => void down.delete(event.pointerId);
  container.addEventListener("pointerup", up, { signal });
  container.addEventListener("pointercancel", up, { signal });
  container.addEventListener("pointerleave", () => controls.point(undefined, 0), { signal });
  container.addEventListener("dblclick", () => controls.fit(), { signal });
  container.addEventListener("keydown", (event) => onKey(event, container, controls), { signal });
  return () => ended.abort();
}

/** One finger pans the image, two fingers zoom it about their midpoint. */
function drag(
  down: Map<number, { x: number; y: number }>,
  id: number,
  before: { x: number; y: number },
  now: { x: number; y: number },
  controls: ImageControls,
): void {
  const other = [...down].find(([other_id]) => other_id !== id)?.[1];
  if (other) {
    const ratio =
      Math.hypot(now.x - other.x, now.y - other.y) / Math.hypot(before.x - other.x, before.y - other.y);
    if (Number.isFinite(ratio) && ratio > 0) controls.zoomAt(ratio, (now.x + other.x) / 2, (now.y + other.y) / 2);
    controls.pan((now.x - before.x) / 2, (now.y - before.y) / 2);
  } else controls.pan(now.x - before.x, now.y - before.y);
  down.set(id, now);
}

function onKey(event: KeyboardEvent, container: HTMLElement, controls: ImageControls): void {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const middle = [container.clientWidth / 2, container.clientHeight / 2] as const;
  const actions: Record<string, () => void> = {
    "+": () => controls.zoomAt(KEY_FACTOR, ...middle),
    "-": () => controls.zoomAt(1 / KEY_FACTOR, ...middle),
    "0": () => controls.fit(),
    ArrowLeft: () => controls.pan(KEY_PAN_PX, 0),
    ArrowRight: () => controls.pan(-KEY_PAN_PX, 0),
    ArrowUp: () => controls.pan(0, KEY_PAN_PX),
    ArrowDown: () => controls.pan(0, -KEY_PAN_PX),
  };
  const action = actions[event.key];
  if (!action) return;
  event.preventDefault();
  action();
}
