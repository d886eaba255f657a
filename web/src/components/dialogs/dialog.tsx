import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";

/** A modal dialog; the browser keeps the focus inside it and restores it afterwards. */
export function Dialog(properties: { title: string; onClose: () => void; children: ComponentChildren }) {
  const element = useRef<HTMLDialogElement>(null);
  useEffect(() => element.current?.showModal(), []);
  return (
    <dialog ref={element} aria-label={properties.title} onClose={properties.onClose}>
      <h2>{properties.title}</h2>
      {properties.children}
    </dialog>
  );
}
