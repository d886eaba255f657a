import { text } from "../../text";

export default function Results() {
  return (
    <header>
      <h1>{text.value.results.title}</h1>
    </header>
  );
}
