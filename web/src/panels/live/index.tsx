import { text } from "../../text";

export default function Live() {
  return (
    <header>
      <h1>{text.value.live.title}</h1>
    </header>
  );
}
