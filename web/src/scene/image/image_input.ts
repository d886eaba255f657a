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
export function listen(container: HTMLElement, hands: ImageControls): () => void {
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
      hands.zoomAt(WHEEL_FACTOR ** (-event.deltaY / 100), x, y);
      hands.point(x, y);
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
      if (before) drag(down, event.pointerId, before, now, hands);
      hands.point(now.x, now.y);
    },
    { signal },
  );
  const up = (event: PointerEvent) => void down.delete(event.pointerId);
  container.addEventListener("pointerup", up, { signal });
  container.addEventListener("pointercancel", up, { signal });
  container.addEventListener("pointerleave", () => hands.point(undefined, 0), { signal });
  container.addEventListener("dblclick", () => hands.fit(), { signal });
  container.addEventListener("keydown", (event) => onKey(event, container, hands), { signal });
  return () => ended.abort();
}

/** One finger pans the image, two fingers zoom it about their midpoint. */
function drag(
  down: Map<number, { x: number; y: number }>,
  id: number,
  before: { x: number; y: number },
  now: { x: number; y: number },
  hands: ImageControls,
): void {
  const other = [...down].find(([other_id]) => other_id !== id)?.[1];
  if (other) {
    const grown =
      Math.hypot(now.x - other.x, now.y - other.y) / Math.hypot(before.x - other.x, before.y - other.y);
    if (Number.isFinite(grown) && grown > 0) hands.zoomAt(grown, (now.x + other.x) / 2, (now.y + other.y) / 2);
    hands.pan((now.x - before.x) / 2, (now.y - before.y) / 2);
  } else hands.pan(now.x - before.x, now.y - before.y);
  down.set(id, now);
}

function onKey(event: KeyboardEvent, container: HTMLElement, hands: ImageControls): void {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const middle = [container.clientWidth / 2, container.clientHeight / 2] as const;
  const acts: Record<string, () => void> = {
    "+": () => hands.zoomAt(KEY_FACTOR, ...middle),
    "-": () => hands.zoomAt(1 / KEY_FACTOR, ...middle),
    "0": () => hands.fit(),
    ArrowLeft: () => hands.pan(KEY_PAN_PX, 0),
    ArrowRight: () => hands.pan(-KEY_PAN_PX, 0),
    ArrowUp: () => hands.pan(0, KEY_PAN_PX),
    ArrowDown: () => hands.pan(0, -KEY_PAN_PX),
  };
  const act = acts[event.key];
  if (!act) return;
  event.preventDefault();
  act();
}
