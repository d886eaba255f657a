import { text } from "../../text";

export default function Result() {
  return (
    <header>
      <h1>{text.value.result.title}</h1>
    </header>
  );
}
