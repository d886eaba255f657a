import { text } from "../../text";

export default function Operate() {
  return (
    <header>
      <h1>{text.value.operate.title}</h1>
    </header>
  );
}
