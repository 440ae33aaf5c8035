"""Runs the program, and builds small captures to run it on."""
import json
import os
import pathlib
import re
import struct
import subprocess
import tempfile
import unittest

PROGRAM = os.environ.get("ECAUDIT", "ecaudit")
SOURCE = pathlib.Path(os.environ.get("ECAUDIT_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
SHARED = pathlib.Path(os.environ.get("ECAUDIT_SHARED_DIR", SOURCE.parent / "shared"))
SCHEMA = SOURCE / "cli" / "report" / "ecaudit-report-1.schema.json"
# The program of Windows, through wine: tests/portable.sh.
WINDOWS = os.environ.get("ECAUDIT_SYSTEM") == "windows"

APRD, APWR, FPRD, FPWR, BRD, BWR, LRW = 1, 2, 4, 5, 7, 8, 12


class Bus:
    """A master and one slave, written packet by packet as pcap with nanoseconds; each exchange is sent and returned."""

    def __init__(self):
        self.packets = []
        self.time_ns = 1_556_712_000_000_000_000
        self.index = 0

    def exchange(self, command, adp, ado, sent: bytes, returned: bytes, wkc: int, irq: int = 0):
        self.index = (self.index + 1) & 0xFF
        # Every slave sets bit 1 of the source address; addresses of position and broadcast grow by one a slave.
        step = 1 if command in (APRD, APWR, BRD, BWR) else 0
        self._packet(0x10, command, adp, ado, sent, 0)
        self.time_ns += 20_000
        self._packet(0x12, command, (adp + step) & 0xFFFF, ado, returned, wkc, irq)
        self.time_ns += 980_000

    def write(self, ado, data: bytes):
        self.exchange(FPWR, 0x1001, ado, data, data, 1)

    def read(self, ado, data: bytes, irq: int = 0):
        self.exchange(FPRD, 0x1001, ado, bytes(len(data)), data, 1, irq)

    def _packet(self, first_mac_byte, command, adp, ado, data, wkc, irq=0):
        header = struct.pack("<BBHHHH", command, self.index, adp, ado, len(data), irq)
        datagram = header + data + struct.pack("<H", wkc)
        source = bytes([first_mac_byte]) + bytes([0x10] * 5)
        frame = b"\xff" * 6 + source + b"\x88\xa4" + struct.pack("<H", len(datagram) | 0x1000) + datagram
        self.packets.append((self.time_ns, frame.ljust(60, b"\0")))

    def pcap(self) -> bytes:
        out = [struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, 65535, 1)]
        for time_ns, frame in self.packets:
            out.append(struct.pack("<IIII", time_ns // 10**9, time_ns % 10**9, len(frame), len(frame)) + frame)
        return b"".join(out)


def scanned_bus() -> Bus:
    """The slave gets its address and is seen in INIT."""
    return scan(Bus())


def scan(bus: Bus) -> Bus:
    bus.exchange(BRD, 0, 0x0130, b"\0\0", b"\x01\0", 1)
    bus.exchange(APWR, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
    bus.read(0x0130, b"\x01\0")
    return bus


def healthy_capture() -> bytes:
    """Nothing but a scan and state polling."""
    bus = scanned_bus()
    for _ in range(20):
        bus.read(0x0130, b"\x01\0")
    return bus.pcap()


def faulty_capture() -> bytes:
    return faulty_bus(Bus()).pcap()


def faulty_bus(bus: Bus) -> Bus:
    """OP is requested in INIT; the slave refuses with code 0x0011; the master acknowledges."""
    scan(bus)
    bus.write(0x0120, b"\x08\0")
    bus.read(0x0130, b"\x11\0")
    bus.read(0x0134, b"\x11\0")
    bus.write(0x0120, b"\x11\0")
    bus.read(0x0130, b"\x01\0")
    return bus


def screen(raw: bytes) -> bytes:
    """What a terminal shows of these bytes. The console of wine sends ways of its cursor, too."""
    if not WINDOWS:
        return raw
    raw = re.sub(rb"\x1b\[\?25[lh]|\x1b\[K|\r", b"", raw)
    return re.sub(rb"\x1b\[(\d+)C", lambda step: b" " * int(step.group(1)), raw)


def read_terminal(leader: int) -> bytes:
    """All that was written to a pseudo terminal whose other end is closed; one read may give a part only. Closes it."""
    written = b""
    try:
        while chunk := os.read(leader, 65536):
            written += chunk
    except OSError:  # Linux reports the closed end so
        pass
    os.close(leader)
    return written


def foreign_capture() -> bytes:
    """Packets, but no EtherCAT."""
    frame = b"\xff" * 6 + b"\x02" * 6 + b"\x08\x06" + bytes(46)
    return struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1) + 3 * (
        struct.pack("<IIII", 1, 0, len(frame), len(frame)) + frame)


class CliTest(unittest.TestCase):
    """A folder of its own, and the program run in it without terminal and without the user's colours."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="ecaudit-cli-")
        self.addCleanup(folder.cleanup)
        self.dir = pathlib.Path(folder.name)
        self.healthy = self.file("healthy.pcap", healthy_capture())
        self.faulty = self.file("faulty.pcap", faulty_capture())

    def file(self, name, content) -> str:
        path = self.dir / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    def run_program(self, *arguments, **options):
        options.setdefault("cwd", self.dir)
        options.setdefault("stdin", subprocess.DEVNULL if "input" not in options else None)
        if options["stdin"] is None:
            del options["stdin"]
        done = subprocess.run([PROGRAM, *map(str, arguments)], stdout=options.pop("stdout", subprocess.PIPE),
                              stderr=subprocess.PIPE, timeout=300, **options)
        done.out = (done.stdout or b"").decode()
        done.err = done.stderr.decode()
        return done

    def check(self, *arguments, status, **options):
        done = self.run_program("check", *arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.out}\n{done.err}")
        return done

    def report(self, *arguments, status):
        """The JSON report on standard output."""
        return json.loads(self.check("--format", "json", *arguments, status=status).out)

    def one_error(self, *arguments, status=2, **options) -> str:
        """Runs a command line that must fail: one line on standard error, nothing on standard output."""
        done = self.run_program(*arguments, **options)
        self.assertEqual(done.returncode, status, done.err)
        self.assertEqual(done.out, "")
        self.assertEqual(done.err.count("\n"), 1, done.err)
        self.assertTrue(done.err.startswith("ecaudit: "), done.err)
        return done.err[len("ecaudit: "):-1]
