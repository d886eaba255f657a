/** Error boundary of a page: shows the error and a reload button. The bar with Stop is outside it. */

import { Component, type ComponentChildren } from "preact";
import { problemOf } from "../api/client";
import { ReloadButton } from "../components/loading/reload";
import { ProblemCard } from "../components/problem";
import { text } from "../text";

interface Failed {
  failure?: unknown;
}

export class ErrorBoundary extends Component<{ children: ComponentChildren }, Failed> {
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
