"""Lets schemathesis send archives: their bytes as they are."""

import schemathesis


@schemathesis.serializer("application/zip", "application/x-tar")
def raw(ctx, value):
    """An upload is bytes; what is no archive must be answered with a problem."""
    return value if isinstance(value, bytes) else str(value).encode()
