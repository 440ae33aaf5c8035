"""Work and output grow with the bytes of what is read, not faster: each hostile pattern at one size and at four times it."""
import functools
import json
import os
import struct
import subprocess
import sys
import unittest

from growth_patterns import PATTERNS, SHARED, mapped_bus, set_up_by_broadcast
from support import APRD, APWR, BRD, BWR, FPRD, FPWR, PROGRAM, Bus, CliTest, healthy_capture, scanned_bus
from test_hostile import block, option, packets_of

TIMES = 4
MOST_TIMES = 7  # quadratic work would take 16 times as long
NOISE_S = 0.4
MEMORY_MIB = 80  # two thousand slaves with their models and ladders are 74
OUTPUT_TIMES = 8
OUTPUT_FREE = 2 << 20
OUTPUT_OF_SLAVES = 5 << 20  # of reports about thousands of them, each of which has its place and its ladder
OUTPUT_OF_CLOCKS = 2 << 20  # where these have clocks and start-ups besides
# Of signals that thousands of slaves share: a line for each of them, a million times at most (slave_work.h).
OUTPUT_OF_SHARED = 40 << 20

# Runs a command and prints its status, seconds of processor time and KiB. A process of its own: until it is another
# program, a child has the memory of its parent, and this one is large.
MEASURE = """
import os, sys
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ)
_, status, usage = os.wait4(child, 0)
print(os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime, usage.ru_maxrss, file=sys.stderr)
"""


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


def crowded_frames(slaves: int, frames: int, command: int, address: int, answers) -> bytes:
    """Frames full of small broadcasts to many slaves. @param answers of a datagram: what is sent, what comes back"""
    bus = Bus()

    def exchange(datagrams):
        bus.index = (bus.index + 1) & 0xFF
        for first, returned in ((0x10, False), (0x12, True)):
            body = b""
            for n, (kind, adp, ado, sent, back, counter) in enumerate(datagrams):
                data = back if returned else sent
                more = 0x8000 if n + 1 < len(datagrams) else 0
                passed = (adp + slaves * returned) & 0xFFFF
                body += struct.pack("<BBHHHH", kind, bus.index, passed, ado, len(data) | more, 0)
                body += data + struct.pack("<H", counter * returned)
            header = b"\x88\xa4" + struct.pack("<H", len(body) | 0x1000)
            frame = b"\xff" * 6 + bytes([first]) + b"\x10" * 5 + header + body
            bus.packets.append((bus.time_ns, frame.ljust(60, b"\0")))
            bus.time_ns += 20_000
        bus.time_ns += 960_000

    exchange([(BRD, 0, 0x0130, b"\0\0", b"\x01\0", slaves)])
    for begin in range(0, slaves, 50):
        exchange([(APWR, -s, 0x0010, *[struct.pack("<H", 0x1001 + s)] * 2, 1) for s in range(begin, begin + 50)])
    for frame in range(frames):
        exchange([(command, 0, address, *answers(frame + n), slaves) for n in range(100)])
    return bus.pcap()


def crowded_writes(frames: int) -> bytes:
    return crowded_frames(2000, frames, BWR, 0x0200, lambda n: [bytes([n & 0xFF])] * 2)


def crowded_requests(frames: int) -> bytes:
    return crowded_frames(2000, frames, BWR, 0x0120, lambda n: [bytes([1 + n % 8])] * 2)


def crowded_states(frames: int) -> bytes:
    return crowded_frames(2000, frames, BRD, 0x0130, lambda n: (b"\0\0", bytes([1 << n % 4, 0])))


def crowded_polls(frames: int) -> bytes:
    return crowded_frames(2000, frames, BRD, 0x0130, lambda n: (b"\0\0", b"\x01\0"))


def crowded_clocks(frames: int) -> bytes:
    return crowded_frames(2000, frames, BWR, 0x0980, lambda n: [bytes([n & 0xFF])] * 2)


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


def named_interfaces(count: int) -> bytes:
    out = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    out += b"".join(block(1, struct.pack("<HHI", 1, 0, 0) + option(2, (b"%05d" % n).ljust(250, b"\xff")))
                    for n in range(count))
    return out


class Cost(CliTest):
    def cost(self, *arguments) -> tuple:
        """Seconds of processor time, MiB, bytes of output."""
        with open(self.dir / "out", "wb") as out:
            done = subprocess.run([sys.executable, "-S", "-c", MEASURE, PROGRAM, *map(str, arguments)], stdout=out,
                                  stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, cwd=self.dir, check=True)
        status, seconds, kib = done.stderr.split()[-3:]
        self.assertIn(int(status), (0, 1, 2), arguments)
        return float(seconds), int(kib) / 1024, os.path.getsize(self.dir / "out")

    def expect_linear(self, make, size: int, *command, free=0) -> None:
        """@param free bytes of output, besides those that any capture may have"""
        contents = [make(n) for n in (size, TIMES * size)]
        paths = [self.file(f"{n}.pcap", content) for n, content in zip((size, TIMES * size), contents)]
        bytes_small, bytes_large = map(len, contents)
        # A machine that does other things is slow now and then, and fast for the small one alone: both are measured again.
        # Work that grows faster is so each time.
        for _ in range(3):
            small, _, _ = self.cost(*command, paths[0])
            large, memory, output = self.cost(*command, paths[1])
            most = MOST_TIMES / TIMES * (bytes_large / bytes_small) * small + NOISE_S
            if large < most:
                break
        self.assertLess(large, most, f"{command}: {small:.2f} s, {large:.2f} s")
        self.assertLess(memory, MEMORY_MIB, command)
        self.assertLess(output, OUTPUT_FREE + free + OUTPUT_TIMES * bytes_large, command)


class GrowthPatterns(Cost):
    def test_patterns(self):
        for pattern, size in PATTERNS.items():
            make = functools.lru_cache(maxsize=2)(pattern)
            for command in (("check", "--format", "json"), ("events", "--format", "jsonl"), ("startup", "--format", "json"),
                            ("signals", "--format", "jsonl")):
                with self.subTest(pattern.__name__, command=command):
                    free = OUTPUT_OF_SLAVES if command[0] in ("check", "startup") else 0
                    free += OUTPUT_OF_CLOCKS if pattern is set_up_by_broadcast else 0
                    if command[0] == "signals" and pattern in SHARED:
                        free = OUTPUT_OF_SHARED
                    self.expect_linear(make, size, *command, free=free)


class Growth(Cost):
    def test_eeprom(self):
        self.expect_linear(eeprom_reads, 1500, "events", "--format", "jsonl")
        self.expect_linear(eeprom_reads, 1500, "check", "--format", "json")

    def test_broadcasts(self):
        self.expect_linear(lambda n: slaves_and_broadcasts(200, n), 400, "check", "--format", "json")

    def read_up_to(self, content: bytes, slaves: int) -> int:
        """The packet at which reading ends because of broadcasts. @return it"""
        path = self.file("crowded.pcap", content)
        report = json.loads(self.run_program("check", "--format", "json", path).out)["reports"][0]
        self.assertFalse(report["capture"]["complete"])
        self.assertIn(report["summary"]["verdict"], ("limited", "fail"))
        (finding,) = [f for f in report["findings"] if f["rule"] == "capture-truncated"]
        self.assertEqual(finding["kind"], "too-much-work")
        self.assertEqual(len([r for r in report["limits_reached"] if "slaves updated with broadcasts" in r["what"]]), 1)
        # What was done is bounded by the bytes that were read, and no packet more than needed was left out.
        packets = [p for _, p in packets_of(content)][:finding["frame"]]
        self.assertEqual(report["capture"]["packets"], len(packets))
        broadcasts = 100 * (len(packets) - 2 - 2 * slaves // 50) // 2
        allowed = 1_000_000 + sum(len(p) for p in packets)
        self.assertLess(slaves * (broadcasts - 100), 2 * allowed)
        self.assertGreater(slaves * (broadcasts + 100) * 2, allowed // 2)
        for command in ("events", "startup"):
            done = self.run_program(command, path)
            self.assertIn("read up to packet" if command == "events" else "", done.err)
        return finding["frame"]

    def test_broadcasts_to_thousands_of_slaves(self):
        """Counted, not timed: reading ends where the bytes allow for no more, wherever the capture ends."""
        for make in (crowded_writes, crowded_requests, crowded_states):
            with self.subTest(make.__name__):
                self.assertEqual(self.read_up_to(make(100), 2000), self.read_up_to(make(400), 2000))

    def test_polls_that_show_nothing_new_are_not_counted(self):
        for frames in (50, 200):
            report = self.report(self.file("polls.pcap", crowded_polls(frames)), status=0)["reports"][0]
            self.assertTrue(report["capture"]["complete"])
            self.assertEqual(report["limits_reached"], [])

    def test_output_of_thousands_of_slaves(self):
        for make in (crowded_requests, crowded_states, crowded_clocks):
            content = make(400)
            path = self.file("crowded.pcap", content)
            for command in (("check", "--format", "json"), ("events", "--format", "jsonl"), ("events",), ("check",)):
                with self.subTest(make.__name__, command=command):
                    _, memory, output = self.cost(*command, path)
                    free = OUTPUT_OF_SLAVES if command[0] == "check" else 0
                    self.assertLess(output, OUTPUT_FREE + free + OUTPUT_TIMES * len(content))
                    self.assertLess(memory, MEMORY_MIB)

    def test_lines_that_are_left_out_are_counted(self):
        path = self.file("crowded.pcap", crowded_states(60))
        rows = [json.loads(line) for line in self.run_program("events", "--format", "jsonl", path).out.splitlines()]
        left_out = [row for row in rows if row["event"] == "left-out"]
        self.assertGreater(sum(row["lines"] for row in left_out), 10_000)
        self.assertTrue(all(row["last_frame"] >= row["frame"] for row in left_out))
        self.assertRegex(self.run_program("events", path).out, r"left-out +[\d,]+ events up to #\d+ are not shown")

    def test_findings(self):
        self.expect_linear(distinct_findings, 1500, "check", "--format", "json")

    def test_interfaces(self):
        self.expect_linear(interfaces, 4000, "check", "--format", "json")

    def test_names_of_interfaces(self):
        self.expect_linear(named_interfaces, 16_000, "check", "--format", "json")
        (report,) = self.report(self.file("named.pcapng", named_interfaces(10_000)), status=0)["reports"]
        named = sum(interface["name"] is not None for interface in report["capture"]["interfaces"])
        (limit,) = [r for r in report["limits_reached"] if "interface names" in r["what"]]
        self.assertEqual(named, (2 << 20) // 250)
        self.assertEqual(limit["left_out"], 250 * (10_000 - named))

    def test_lists_of_thousands_of_slaves(self):
        """What a few broadcasts set is told of some slaves; what each slave is given by frames of its own, of all."""
        (report,) = self.report(self.file("few.pcap", set_up_by_broadcast(4)), status=1)["reports"]
        limits = {r["what"].split(",")[0]: r["left_out"] for r in report["limits_reached"]}
        units = sum(len(s["sync_managers"]) + len(s["fmmus"]) for s in report["slaves"])
        self.assertEqual(units + limits["settings of sync managers and FMMUs"], 32 * 2040)
        clocks = [s["dc"] for s in report["slaves"] if s["dc"]]
        self.assertEqual(len(clocks) + limits["distributed clocks that only broadcasts show"], 2040)
        steps = sum(len(dc["configuration"]) + dc["configuration_left_out"] for dc in clocks)
        self.assertEqual(steps, 8 * len(clocks))
        (report,) = self.report(self.file("own.pcap", mapped_bus(1900).pcap()), status=0)["reports"]
        self.assertEqual(sum(len(s["fmmus"]) for s in report["slaves"]), 2 * 1900)
        self.assertFalse([r for r in report["limits_reached"] if "FMMU" in r["what"]])

    def test_formats_and_copies_of_thousands_of_slaves(self):
        path = self.file("few.pcap", set_up_by_broadcast(16))
        for command in (("check",), ("check", "--format", "html"), ("check", "--format", "sarif"),
                        ("check", "--format", "junit"), ("annotate", "--force", "-o", "copy.pcapng"),
                        ("anonymize", "--force", "-o", "copy.pcapng")):
            with self.subTest(command=command):
                self.assertLess(self.cost(*command, path)[1], MEMORY_MIB)

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
        many = min(self.cost("merge", "--format", "json", "many")[0] for _ in range(2))
        self.assertLess(many, MOST_TIMES * few + NOISE_S)

    def test_merge_of_many_findings_and_slaves(self):
        report = self.report(self.healthy, status=0)
        (capture,) = report["reports"]
        slave = {"position": 0, "name": "x", "identity": {"vendor_id": 1, "product_code": 2}}
        finding = {"rule": "al-refused", "severity": "error", "title": "t", "message": "m", "slave": 0,
                   "station_address": None, "frame": 1, "last_frame": 1, "count": 1, "time_s": 0, "related_frames": [],
                   "caused_by": None, "confidence": "observed", "reference": {"document": None, "section": None},
                   "wireshark_filter": None, "known": False}

        def merge(count, position, name):
            capture["slaves"] = [dict(slave, position=position, name=name)] * count
            capture["findings"] = [finding] * count
            path = self.file(f"{count}.json", json.dumps(report))
            return min(self.cost("merge", "--format", "json", path)[0] for _ in range(2))

        for position in (0, 1):
            with self.subTest(position=position):
                self.assertLess(merge(8000, position, "x"), MOST_TIMES * merge(2000, position, "x") + NOISE_S)
        capture["slaves"] = [dict(slave, name="n" * (1 << 20))]
        capture["findings"] = [finding] * 4000
        path = self.file("name.json", json.dumps(report))
        _, memory, output = self.cost("merge", "--format", "json", path)
        self.assertLess(memory, MEMORY_MIB)
        self.assertLess(output, OUTPUT_FREE + OUTPUT_TIMES * os.path.getsize(path))

    def test_merge_of_captures_that_are_nearly_alike(self):
        report = self.report(self.healthy, status=0)
        (capture,) = report["reports"]
        for key in ("coverage", "alike_steps", "capture_next", "limits_reached"):
            capture.pop(key, None)
        capture["slaves"] = capture["findings"] = capture["not_evaluable"] = []

        def merge(count):
            report["reports"] = [dict(capture, capture=dict(capture["capture"], duration_s=n)) for n in range(count)]
            path = self.file(f"{count}.json", json.dumps(report))
            return min(self.cost("merge", "--format", "json", path)[0] for _ in range(2))

        self.assertLess(merge(2000), MOST_TIMES * merge(500) + NOISE_S)


if __name__ == "__main__":
    unittest.main()
