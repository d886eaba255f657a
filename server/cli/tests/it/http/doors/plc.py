"""A PLC at the register map of `sheaf-modbus`: PORT read | PORT trigger RECIPE SERIAL [ORDER]. It prints the next result as JSON.

`trigger` requests an inspection first. Either way it waits for a result, reads it as one block, and acknowledges it.
"""

import json
import struct
import sys
import time

from pymodbus.client import ModbusTcpClient

PATIENCE_S = 120

# The acknowledgement of a number that is the first after a start of the server: it is not executed.
FIRST_AFTER_START = 10

client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]))
# As any PLC, until the server has opened its doors after a start.
begun = time.monotonic()
while not client.connect():
    assert time.monotonic() - begun < PATIENCE_S, "no connection"
    time.sleep(0.1)


def inputs(address, count):
    answer = client.read_input_registers(address, count=count)
    assert not answer.isError(), answer
    return answer.registers


def write(address, values):
    answer = client.write_registers(address, values)
    assert not answer.isError(), answer


def until(what, condition):
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < PATIENCE_S, f"{what} did not happen"
        heart()
        time.sleep(0.02)


heartbeat = 0


def heart():
    global heartbeat
    heartbeat = (heartbeat + 1) % 65536
    write(0, [heartbeat])


def text(registers):
    return b"".join(struct.pack(">H", register) for register in registers).rstrip(b"\0").decode()


if sys.argv[2] == "trigger":
    recipe, serial, order = int(sys.argv[3]), sys.argv[4], "".join(sys.argv[5:])
    until("ready", lambda: inputs(3, 1)[0] & 1)
    padded = serial.encode().ljust(32, b"\0") + order.encode().ljust(32, b"\0")
    words = list(struct.unpack(">32H", padded))
    # Command, its number, and the last result acknowledged stay as they are until the block is complete.
    write(4, [recipe >> 16, recipe & 0xFFFF, *words])
    code = FIRST_AFTER_START
    while code == FIRST_AFTER_START:
        sequence = (inputs(4, 1)[0] + 1) % 65536
        write(1, [1, sequence])
        until("the acknowledgement", lambda: inputs(4, 1)[0] == sequence)
        code = inputs(5, 1)[0]
    assert code == 0, f"refused with code {code}"

until("a result", lambda: inputs(3, 1)[0] & 4)
block = inputs(10, 36)
number = inputs(40, 6)
write(3, [block[0]])
until("the end of the handshake", lambda: inputs(10, 1)[0] != block[0] or not inputs(3, 1)[0] & 4)
fixed = struct.unpack(">i", struct.pack(">HH", *number[0:2]))[0]
value = struct.unpack(">f", struct.pack(">HH", *number[4:6]))[0]
print(json.dumps({
    "verdict": [None, "ok", "not_ok", "undecided", "invalid"][block[1]],
    "n": block[2],
    "version": block[3],
    "recipe": block[4] << 16 | block[5],
    "serial": text(block[6:22]),
    "fixed_mm": fixed * 1e-4,
    "value_mm": None if value != value else value,
    "uncertainty_mm": number[3] * 1e-4,
}))
