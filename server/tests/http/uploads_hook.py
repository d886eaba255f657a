"""Lets schemathesis send archives and parts: their bytes as they are."""

import schemathesis


@schemathesis.serializer("application/zip", "application/x-tar", "model/stl")
def raw(ctx, value):
    """An upload is bytes; what is no archive or part must be answered with a problem."""
    return value if isinstance(value, bytes) else str(value).encode()
