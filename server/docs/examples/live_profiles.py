"""Prints the live profiles of a Sheaf station.

    pip install numpy websocket-client
    python live_profiles.py ws://127.0.0.1:8080/api/v1/stream 5

Profiles come while the station shows frames (live view or a scan) and a calibration is active.
The bytes are specified in openapi/stream.md; numpy reads the columns in place.
"""

import json
import struct
import sys

import numpy as np
from websocket import create_connection

PROFILE = 2


def read_profile(message):
    """The frame's sequence and stage position, and per order its x, y, z and sigma in mm."""
    header_bytes, = struct.unpack_from("<H", message, 2)
    sequence, _captured_at_ns, position_mm = struct.unpack_from("<QQd", message, 8)
    n_points, n_orders = struct.unpack_from("<IH", message, 40)
    rows = np.frombuffer(message, [("order", "i1"), ("pad", "V3"), ("first", "<u4"), ("n", "<u4")], n_orders, header_bytes)
    columns = np.frombuffer(message, "<f4", 4 * n_points, header_bytes + rows.nbytes).reshape(4, n_points)
    orders = {int(row["order"]): columns[:, row["first"] : row["first"] + row["n"]] for row in rows}
    return sequence, position_mm, orders


def main(url, n_profiles):
    station = create_connection(url, subprotocols=["sheaf.v1"], suppress_origin=True, timeout=30)
    station.send(json.dumps({"op": "subscribe", "streams": [{"stream": "profile", "max_rate_hz": 30}]}))
    while n_profiles:
        message = station.recv()
        if isinstance(message, str) or message[0] != PROFILE:
            continue
        sequence, position_mm, orders = read_profile(message)
        print(f"frame {sequence} at {position_mm:.3f} mm")
        for order, (x, _y, z, sigma) in orders.items():
            print(f"  order {order:+d}: {x.size:5d} points, z {z.min():.3f} to {z.max():.3f} mm, sigma {sigma.mean():.4f} mm")
        n_profiles -= 1
    station.close()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "ws://127.0.0.1:8080/api/v1/stream", int(sys.argv[2]) if len(sys.argv) > 2 else 5)
