import { text } from "../../text";

export default function Scan() {
  return (
    <header>
      <h1>{text.value.scan.title}</h1>
    </header>
  );
}
