/** What remains of a page that failed: why, and a way out. The bar with Stop stands outside of it. */

import { Component, type ComponentChildren } from "preact";
import { problemOf } from "../api/client";
import { ProblemCard } from "../components/problem";
import { ReloadButton } from "../components/reload";
import { text } from "../text";

interface Failed {
  failure?: unknown;
}

export class Boundary extends Component<{ children: ComponentChildren }, Failed> {
  static override getDerivedStateFromError(failure: unknown): Failed {
    return { failure };
  }

  override render() {
    const { failure } = this.state;
    return failure === undefined ? (
      this.props.children
    ) : (
      <Failure title={text.value.frame.page_broken} failure={failure} />
    );
  }
}

export function Failure({ title, failure }: { title: string; failure: unknown }) {
  return (
    <div class="stack">
      <ProblemCard problem={{ ...problemOf(failure), type: "urn:sheaf:problem:page", title }} />
      <div>
        <ReloadButton />
      </div>
    </div>
  );
}
