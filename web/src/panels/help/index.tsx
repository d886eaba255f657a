import { text } from "../../text";

export default function Help() {
  return (
    <header>
      <h1>{text.value.help.title}</h1>
    </header>
  );
}
