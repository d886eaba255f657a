"""What schemathesis must know of the station: how uploads are written, and ids of things that exist.

Random ids find nothing but 404; most of them are replaced by ids of what the server holds (`SHEAF_KNOWN_IDS`, JSON: the
path's first word after the version → parameter of path or query → ids).
"""

import json
import os

import schemathesis

KNOWN_IDS = json.loads(os.environ.get("SHEAF_KNOWN_IDS", "{}"))

@schemathesis.serializer("application/zip", "application/x-tar", "application/octet-stream", "model/stl")
def raw(ctx, value):
    """An upload is bytes; what is no archive or part must be answered with a problem."""
    return value if isinstance(value, bytes) else str(value).encode()


# Requests with a whole plan, whose many parts make thousands of cases that all end in the same checks.
WITH_A_PLAN = ("/evaluate", "/deviations")


@schemathesis.hook
def filter_case(context, case):
    """One of eight requests with a plan; which one follows from the request itself."""
    return not case.operation.path.endswith(WITH_A_PLAN) or sum(repr(case.body).encode()) % 8 == 0


@schemathesis.hook
def map_case(context, case):
    """Three of four requests for one thing are for one that exists; which one follows from the request itself."""
    if not case.path_parameters:
        return case
    words = case.operation.path.split("/")
    known = KNOWN_IDS.get(words[3], {}) if len(words) > 4 else {}
    if case.method.upper() == "DELETE":
        # The other requests are to find what is there; the fuzzer learns ids from answers, too.
        for name, value in case.path_parameters.items():
            if value in known.get(name, []):
                case.path_parameters[name] = f"{value}x"
        return case
    place = sum(repr(sorted(case.path_parameters.items())).encode())
    # A request that names a second thing in its query keeps no random id: of few examples too few would meet both.
    names_two = any(known.get(name) for name in case.query or {})
    if place % 4 == 0 and not names_two:
        return case
    for parameters in (case.path_parameters, case.query or {}):
        for name in parameters:
            ids = known.get(name, [])
            if ids:
                parameters[name] = ids[place // 4 % len(ids)]
    return case
