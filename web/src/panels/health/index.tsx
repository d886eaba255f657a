import { text } from "../../text";

export default function Health() {
  return (
    <header>
      <h1>{text.value.health.title}</h1>
    </header>
  );
}
