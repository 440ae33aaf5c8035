"""Work and output grow with the bytes of what is read, not faster: each hostile pattern at a size and at four times that."""
import json
import os
import struct
import subprocess
import unittest

from support import APRD, APWR, BRD, BWR, FPRD, FPWR, PROGRAM, Bus, CliTest, healthy_capture, scanned_bus
from test_hostile import block, option, pcapng

TIMES = 4
MOST_TIMES = 7  # quadratic work would take 16 times as long
NOISE_S = 0.4
MEMORY_MIB = 160  # of a debug build
OUTPUT_TIMES = 8
OUTPUT_FREE = 2 << 20


def eeprom_reads(words: int) -> bytes:
    """A master that reads one EEPROM word after the other, and asks for the state in between."""
    bus = scanned_bus()
    for word in range(words):
        bus.write(0x0502, struct.pack("<HI", 0x0100, word))
        value = (0x0800 | word % 7, 0)[word % 2] if word >= 0x40 else 0  # categories without content
        bus.read(0x0502, struct.pack("<HIHH", 0x0000, word, value, 0))
        bus.read(0x0130, b"\x01\0")
    return bus.pcap()


def slaves_and_broadcasts(slaves: int, frames: int) -> bytes:
    bus = Bus()

    def pass_all(command, adp, ado, data, wkc):
        bus.index = (bus.index + 1) & 0xFF
        bus._packet(0x10, command, adp & 0xFFFF, ado, data, 0)
        bus.time_ns += 20_000
        bus._packet(0x12, command, (adp + slaves) & 0xFFFF, ado, data, wkc)
        bus.time_ns += 980_000

    pass_all(BRD, 0, 0x0130, b"\x01\0", slaves)
    for slave in range(slaves):
        pass_all(APWR, -slave, 0x0010, struct.pack("<H", 0x1001 + slave), 1)
    for n in range(frames):
        pass_all(BWR, 0, 0x0200, bytes([n & 0xFF]), slaves)
    return bus.pcap()


def distinct_findings(count: int) -> bytes:
    """Requests of states that there are none, for ever other slaves."""
    bus = scanned_bus()
    for n in range(count):
        address = 0x1002 + n % 700
        bus.exchange(FPWR, address, 0x0120, bytes([0x05 + n // 700 % 3, 0]), bytes([0x05 + n // 700 % 3, 0]), 1)
        bus.exchange(FPRD, address, 0x0130, b"\0\0", b"\x11\0", 1)
    return bus.pcap()


def interfaces(count: int) -> bytes:
    out = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    out += b"".join(block(1, struct.pack("<HHI", 1, 0, 0) + option(2, b"eth%d" % n)) for n in range(count))
    return out


class Growth(CliTest):
    def cost(self, *arguments) -> tuple:
        """Seconds of processor time, MiB, bytes of output."""
        with open(self.dir / "out", "wb") as out:
            child = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=out, stderr=subprocess.DEVNULL,
                                     stdin=subprocess.DEVNULL, cwd=self.dir)
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
        self.assertIn(child.returncode, (0, 1, 2), arguments)
        return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, os.path.getsize(self.dir / "out")

    def expect_linear(self, make, size: int, *command) -> None:
        costs = []
        for n in (size, TIMES * size):
            content = make(n)
            costs.append((self.cost(*command, self.file(f"{n}.pcap", content)), len(content)))
        ((small, _, _), bytes_small), ((large, memory, output), bytes_large) = costs
        times = bytes_large / bytes_small
        self.assertLess(large, MOST_TIMES / TIMES * times * small + NOISE_S, f"{command}: {small:.2f} s, {large:.2f} s")
        self.assertLess(memory, MEMORY_MIB, command)
        self.assertLess(output, OUTPUT_FREE + OUTPUT_TIMES * bytes_large, command)

    def test_eeprom(self):
        self.expect_linear(eeprom_reads, 1500, "events", "--format", "jsonl")
        self.expect_linear(eeprom_reads, 1500, "check", "--format", "json")

    def test_broadcasts(self):
        self.expect_linear(lambda n: slaves_and_broadcasts(200, n), 400, "check", "--format", "json")

    def test_findings(self):
        self.expect_linear(distinct_findings, 1500, "check", "--format", "json")

    def test_interfaces(self):
        self.expect_linear(interfaces, 4000, "check", "--format", "json")

    def test_events_of_all_kinds(self):
        def many(n):
            content = healthy_capture()
            return content[:24] + content[24:] * n
        self.expect_linear(many, 100, "events", "--format", "jsonl")

    def test_merge(self):
        report = self.report(self.healthy, status=0)

        def reports(folder, count):
            for n in range(count):
                report["reports"][0]["capture"]["packets"] = n + 1
                self.file(f"{folder}/{n}.json", json.dumps(report))

        reports("few", 150)
        reports("many", 600)
        few, _, _ = self.cost("merge", "--format", "json", "few")
        many, _, _ = self.cost("merge", "--format", "json", "many")
        self.assertLess(many, MOST_TIMES * few + NOISE_S)


if __name__ == "__main__":
    unittest.main()
