"""A PLC in Python, with pymodbus as the client: triggers parts, checks and notes their results, acknowledges them.

Usage: plc.py PORT N_PARTS. Prints {"results": [[result_seq, serial], ...], "repeated": n} in the order of arrival. It
does what a PLC program has to do: a heartbeat, a new command_seq per command, an acknowledgement per result, and a
comparison of result_seq with the last one, since a result may come again after a restart of the server.
"""

import json
import struct
import sys
import time

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

VALID, BUSY = 1 << 2, 1 << 1
ACCEPTED, STILL_BUSY, RESTARTED = 0, 2, 10
N_CHARACTERISTICS = 3
PATIENCE_S = 60


class Plc:
    def __init__(self, port):
        self.client = ModbusTcpClient("127.0.0.1", port=port, timeout=3, retries=0)
        self.heartbeat = self.command = self.command_seq = self.last_seq = 0
        self.serial = ""
        self.results = []
        self.repeated = 0

    def request(self, call):
        """Repeats a request until it is answered; all of them may be repeated."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            try:
                if self.client.connected or self.client.connect():
                    answer = call(self.client)
                    assert not answer.isError(), answer
                    return answer
            except (ModbusException, OSError):
                self.client.close()
            time.sleep(0.005)
        sys.exit("the server does not answer")

    def write_block(self, result_ack=None):
        """Everything that a PLC writes, as it would in every cycle."""
        result_ack = self.last_seq if result_ack is None else result_ack
        self.heartbeat = (self.heartbeat + 1) % 65536
        serial = struct.unpack(">16H", self.serial.encode().ljust(32, b"\0"))
        block = [self.heartbeat, self.command, self.command_seq, result_ack, 0, 12, *serial]
        self.request(lambda client: client.write_registers(0, block, device_id=7))

    def read_inputs(self):
        inputs = self.request(lambda client: client.read_input_registers(0, count=58, device_id=7)).registers
        convert = self.client.convert_from_registers
        kinds = self.client.DATATYPE
        assert convert(inputs[8:10], kinds.FLOAT32, word_order="big") == 1234.5
        seq = inputs[10]
        for first in range(40, 40 + 6 * N_CHARACTERISTICS, 6):
            if seq:
                steps = convert(inputs[first : first + 2], kinds.INT32, word_order="big")
                value = convert(inputs[first + 4 : first + 6], kinds.FLOAT32, word_order="big")
                # Values follow from the number of the inspection, so that a torn read is seen.
                assert (steps - seq) % 65535 == 0, (seq, steps)
                assert abs(value * 1e4 - steps) < 1, (value, steps)
                assert inputs[first + 2 : first + 4] == [1, 100]
        if inputs[3] & VALID:
            self.take(inputs)
        return inputs

    def take(self, inputs):
        """Notes a result, and acknowledges it, also one that comes again."""
        seq = inputs[10]
        ahead = (seq - self.last_seq) % 65535
        if self.results and not 0 < ahead < 32768:
            self.repeated += 1
        else:
            serial = b"".join(word.to_bytes(2, "big") for word in inputs[16:32]).rstrip(b"\0").decode()
            self.results.append([seq, serial])
            self.last_seq = seq
        self.write_block(seq)

    def execute(self, command, serial=""):
        """Executes a command; returns its code."""
        self.command, self.serial = command, serial
        self.command_seq = (self.command_seq + 1) % 65536
        self.write_block()
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            inputs = self.read_inputs()
            if inputs[4] == self.command_seq:
                return inputs[5]
            # The request may have been lost with the server, which then knows nothing of it.
            self.write_block()
        sys.exit("no acknowledgement of a command")

    def inspect(self, serial):
        """Triggers a part, until its result has come."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            code = self.execute(1, serial)
            if code == STILL_BUSY:
                continue
            assert code in (ACCEPTED, RESTARTED), code
            # After a restart it is not known whether the part was inspected before: only its result tells.
            for _ in range(200):
                if self.results and self.results[-1][1] == serial:
                    return
                inputs = self.read_inputs()
                if code == RESTARTED and not inputs[3] & (VALID | BUSY):
                    time.sleep(0.001)
        sys.exit(f"no result for {serial}")


def main():
    plc = Plc(int(sys.argv[1]))
    assert plc.execute(0) == RESTARTED
    for number in range(int(sys.argv[2])):
        plc.inspect(f"P{number}")
    json.dump({"results": plc.results, "repeated": plc.repeated}, sys.stdout)


main()
