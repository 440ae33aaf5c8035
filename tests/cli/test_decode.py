"""`ecaudit decode`: one line a datagram."""
import csv
import gzip
import io
import json
import os
import pty
import struct
import subprocess
import unittest

from support import (APRD, BRD, FPRD, FPWR, LRW, PROGRAM, SOURCE, Bus, CliTest, foreign_capture, read_terminal,
                     scanned_bus, screen)

KEYS = ["frame", "datagram", "time_s", "direction", "command", "index", "adp", "ado", "length", "irq", "wkc", "more",
        "circulating", "slave", "register", "data"]


class Decode(CliTest):
    def decode(self, *arguments, status=0, **options):
        done = self.run_program("decode", *arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.out}\n{done.err}")
        return done

    def rows(self, *arguments, **options):
        done = self.decode("--format", "jsonl", *arguments, **options)
        self.assertEqual(done.err, "")
        return [json.loads(line) for line in done.out.splitlines()]


class DecodeJson(Decode):
    def test_keys_are_those_of_the_contract_in_order(self):
        for row in self.rows(self.faulty):
            self.assertEqual(list(row), KEYS)

    def test_logical_commands_have_a_logical_address(self):
        bus = scanned_bus()
        bus.exchange(LRW, 0x0000, 0x0001, b"\1\2\3", b"\1\2\4", 3)
        row = self.rows(self.file("lrw.pcap", bus.pcap()))[-1]
        self.assertEqual(list(row), KEYS[:8] + ["logical"] + KEYS[8:])
        self.assertEqual((row["command"], row["logical"], row["slave"], row["register"]), ("LRW", 0x10000, None, None))
        self.assertEqual((row["data"], row["wkc"]), ("010204", 3))

    def test_csv_has_the_values_of_json(self):
        captures = [self.faulty] + [str(SOURCE / "samples" / "captures" / f"{name}.pcapng")
                                    for name in ("drive-fault", "sdo-aborts", "clean-mixed-bus")]
        for capture in captures:
            with self.subTest(capture):
                rows = self.rows(capture)
                table = list(csv.DictReader(io.StringIO(self.decode("--format", "csv", capture).out)))
                self.assertEqual(len(table), len(rows))
                for cells, row in zip(table, rows):
                    self.assertEqual(float(cells.pop("time_s")), row["time_s"])
                    row.setdefault("logical", None)
                    self.assertEqual(cells, {key: "" if row[key] is None else str(row[key]) for key in cells})
        clock = self.decode("--format", "csv", "--time", "utc", self.faulty).out.splitlines()
        self.assertTrue(clock[0].startswith("time,frame,"), clock[0])
        self.assertRegex(clock[1], r"^\d{4}-\d\d-\d\dT[0-9:.]+Z,1,0,")

    def test_values_of_one_exchange(self):
        rows = self.rows(self.faulty)
        # Packets 7 and 8: OP is written to AL Control of the slave that got address 0x1001.
        sent, returned = rows[6], rows[7]
        self.assertEqual(sent, {"frame": 7, "datagram": 0, "time_s": 0.003, "direction": "outbound", "command": "FPWR",
                                "index": 4, "adp": 0x1001, "ado": 0x0120, "length": 2, "irq": 0, "wkc": 0,
                                "more": False, "circulating": False, "slave": 0, "register": "AL Control", "data": "0800"})
        self.assertEqual((returned["frame"], returned["direction"], returned["wkc"]), (8, "returned", 1))

    def test_slave_is_resolved_as_of_the_frame(self):
        bus = Bus()
        bus.read(0x0130, b"\1\0")                                  # no position is known yet
        bus.exchange(BRD, 0, 0x0130, b"\0\0", b"\1\0", 1)
        bus.exchange(APRD, 0, 0x0010, b"\0\0", b"\1\x10", 1)        # position 0 has address 0x1001
        bus.read(0x0130, b"\1\0")
        bus.exchange(APRD, 0xFFFF, 0x0130, b"\0\0", b"\0\0", 0)     # behind the last slave
        slaves = [row["slave"] for row in self.rows(self.file("a.pcap", bus.pcap()))]
        self.assertEqual(slaves, [None, None, None, None, 0, 0, 0, 0, None, None])

    def test_register_null_where_there_is_none(self):
        bus = scanned_bus()
        bus.read(0x0A00, b"\0\0")
        bus.read(0x1100, b"\0\0")
        rows = self.rows(self.file("r.pcap", bus.pcap()))
        self.assertIsNone(rows[-4]["register"])
        self.assertEqual(rows[-2]["register"], "Process RAM")

    def test_malformed_frames_show_their_readable_datagrams(self):
        rows = self.rows(SOURCE / "samples" / "captures" / "malformed.pcapng")
        by_frame = {}
        for row in rows:
            by_frame.setdefault(row["frame"], []).append(row)
        self.assertEqual([r["command"] for r in by_frame[134]], ["77", "FPRD"])  # a command that does not exist
        self.assertEqual([r["more"] for r in by_frame[131]], [True, True])       # announces one that does not follow
        # The EtherCAT header says length 0; Wireshark reads the two datagrams behind it all the same.
        self.assertEqual([(r["command"], r["more"]) for r in by_frame[137]], [("FPRD", True), ("FPRD", False)])
        self.assertNotIn(140, by_frame)                                           # ends inside the header

    def test_times_without_stamps_are_null(self):
        # A pcapng file of simple packet blocks: no time stamps.
        frame = Bus()
        frame.exchange(BRD, 0, 0x0130, b"\0\0", b"\1\0", 1)
        shb = struct.pack("<IIIHHqI", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1, 28)
        idb = struct.pack("<IIHHII", 1, 20, 1, 0, 0, 20)
        blocks = b""
        for _, data in frame.packets:
            total = 16 + len(data) + (-len(data) % 4)
            blocks += struct.pack("<III", 3, total, len(data)) + data + bytes(-len(data) % 4) + struct.pack("<I", total)
        path = self.file("spb.pcapng", shb + idb + blocks)
        self.assertEqual([r["time_s"] for r in self.rows(path)], [None, None])
        self.assertIn("  -  ->  BRD", self.decode(path).out)


class DecodeText(Decode):
    def test_columns_are_aligned(self):
        lines = self.decode(self.faulty).out.splitlines()
        header, body = lines[0], lines[1:]
        self.assertEqual(header.split(), ["frame", "time", "s", "cmd", "slave", "address", "bytes", "wkc", "content"])
        content = header.index("content")
        for line in body:
            self.assertEqual(line[content - 2:content], "  ", line)
            self.assertNotEqual(line[content], " ", line)
            self.assertEqual(line, line.rstrip())

    def test_only_a_mailbox_that_is_on_has_messages(self):
        message = bytes.fromhex("0a00000000030020 4018100100000000") + bytes(112)
        for active, times in ((b"\1\0", 2), (b"\0\0", 0)):
            bus = scanned_bus()
            bus.write(0x0800, bytes.fromhex("001880002600") + active)
            bus.write(0x1800, message)
            out = self.decode(self.file("m.pcap", bus.pcap())).out
            self.assertEqual(out.count("1018h:1"), times, out)

    def test_says_what_is_meant(self):
        out = self.decode(self.faulty).out
        self.assertIn("->  FPWR      0  0x1001:0x0120      2         AL Control: OP", out)
        self.assertIn("<-  FPRD      0  0x1001:0x0130      2      1  AL Status: INIT+ERR", out)
        self.assertIn("AL Status Code: 0x0011 invalid requested state change", out)
        self.assertIn("all  0x0001:0x0130", out)

    def test_several_datagrams_in_a_frame_are_numbered(self):
        out = self.decode("--frames", "134", SOURCE / "samples" / "captures" / "malformed.pcapng").out
        self.assertEqual([line.split()[0] for line in out.splitlines()[1:]], ["134.0", "134.1", "134"])
        self.assertIn("134       0.009780775  !!  malformed: a datagram has a command that is not defined", out)

    def test_an_unanswered_read_says_so(self):
        bus = scanned_bus()
        bus.exchange(FPRD, 0x1002, 0x0130, b"\0\0", b"\0\0", 0)
        self.assertIn("?  0x1002:0x0130      2      0  AL Status (no answer)",
                      self.decode(self.file("n.pcap", bus.pcap())).out)

    def test_no_colour_in_pipes(self):
        self.assertNotIn("\x1b", self.decode(self.faulty).out)

    def terminal(self, *arguments, **environment):
        master, slave = pty.openpty()
        env = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "TERM")}
        with subprocess.Popen([PROGRAM, "decode", *arguments], stdout=slave, stderr=subprocess.PIPE,
                              env={**env, "TERM": "xterm", **environment}) as child:
            os.close(slave)
            out = read_terminal(master)
            errors = child.stderr.read()
        self.assertEqual(child.returncode, 0, errors)
        return screen(out).decode()

    def test_colour_on_a_terminal(self):
        frames = ("--frames", "1-4")
        self.assertIn("\x1b[", self.terminal(*frames, self.faulty))
        self.assertNotIn("\x1b[", self.terminal(*frames, self.faulty, NO_COLOR="1"))
        self.assertNotIn("\x1b[", self.terminal(*frames, "--no-color", self.faulty))
        self.assertNotIn("\x1b[", self.terminal(*frames, "--format", "jsonl", self.faulty))


class DecodeSelection(Decode):
    def frames(self, *arguments):
        return sorted({row["frame"] for row in self.rows(*arguments, self.healthy)})

    def test_frames(self):
        self.assertEqual(self.frames("--frames", "5-8"), [5, 6, 7, 8])
        self.assertEqual(self.frames("--frames", "7"), [7])
        self.assertEqual(self.frames("--frames", "-3"), [1, 2, 3])
        self.assertEqual(self.frames("--frames", "44-"), [44, 45, 46])

    def test_from_and_to(self):
        self.assertEqual(self.frames("--from", "#5", "--to", "#6"), [5, 6])
        # One exchange a millisecond, returned 20 us later.
        self.assertEqual(self.frames("--from", "0.002", "--to", "0.0031"), [5, 6, 7, 8])
        self.assertEqual(self.frames("--from", "#4", "--frames", "1-5"), [4, 5])

    def test_what_is_known_does_not_depend_on_the_range(self):
        for row in self.rows("--frames", "7-8", self.healthy):
            self.assertEqual(row["slave"], 0)
            self.assertEqual(row["time_s"], 0.003 + (0.00002 if row["frame"] == 8 else 0))

    def test_slave(self):
        bus = scanned_bus()
        bus.exchange(FPWR, 0x1002, 0x0120, b"\2\0", b"\2\0", 1)
        path = self.file("two.pcap", bus.pcap())
        self.assertEqual({row["adp"] for row in self.rows("--slave", "0x1002", path)}, {0x1002})
        self.assertEqual([row["frame"] for row in self.rows("--slave", "0", path)], [3, 4, 5, 6])
        self.assertEqual({row["adp"] for row in self.rows("--slave", "0x1001", "--slave", "0x1002", path)
                          if row["command"].startswith("FP")}, {0x1001, 0x1002})

    def test_slave_that_is_not_there(self):
        self.assertEqual(self.one_error("decode", "--format", "jsonl", "--slave", "7", self.healthy),
                         f"{self.healthy} has no slave 7")
        self.one_error("decode", "--slave", "7", "-o", "x.txt", self.healthy)
        self.assertFalse((self.dir / "x.txt").exists())

    def test_mistakes(self):
        for frames in ("", "x", "0", "1-2-3", "-", "1-x", "9999999999999999999999"):
            self.assertIn("--frames", self.one_error("decode", f"--frames={frames}", self.healthy), frames)
        self.assertIn("is later than the last", self.one_error("decode", "--frames", "8-5", self.healthy))
        self.assertIn("--join", self.one_error("decode", self.healthy, self.faulty))
        self.assertIn("did you mean 'jsonl'", self.one_error("decode", "--format", "json", self.healthy))
        self.assertIn("no CAPTURE", self.one_error("decode"))


class DecodeStreams(Decode):
    def test_standard_input_and_compression(self):
        content = open(self.faulty, "rb").read()
        expected = self.decode("--format", "jsonl", self.faulty).out
        self.assertEqual(self.decode("--format", "jsonl", "-", input=content).out, expected)
        self.assertEqual(self.decode("--format", "jsonl", self.file("f.gz", gzip.compress(content))).out, expected)

    def test_output_files(self):
        expected = self.decode("--format", "jsonl", self.faulty).out
        done = self.decode("-o", "rows.jsonl", self.faulty)
        self.assertEqual((done.out, (self.dir / "rows.jsonl").read_text()), ("", expected))
        done = self.decode("-o", "jsonl=b.jsonl", "-o", "text=c.txt", "--format", "jsonl", self.faulty)
        self.assertEqual((done.out, (self.dir / "b.jsonl").read_text()), (expected, expected))
        self.assertEqual((self.dir / "c.txt").read_text(), self.decode(self.faulty).out)
        self.assertEqual(len(list(self.dir.iterdir())), 5, "no temporary file is left")

    def test_never_over_a_capture(self):
        before = open(self.healthy, "rb").read()
        self.assertIn("will not be overwritten", self.one_error("decode", "-o", self.healthy, self.faulty))
        self.assertIn("capture", self.one_error("decode", "-o", self.healthy, self.healthy))
        self.assertEqual(open(self.healthy, "rb").read(), before)

    def test_full_disk(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("no /dev/full")
        with open("/dev/full", "w") as full:
            done = self.run_program("decode", self.faulty, stdout=full)
        self.assertEqual(done.returncode, 2)
        self.assertIn("cannot write to standard output", done.err)

    def long_capture(self):
        bus = scanned_bus()
        for _ in range(20000):
            bus.read(0x0130, b"\1\0")
        return self.file("long.pcap", bus.pcap())

    def test_reader_that_leaves_early(self):
        process = subprocess.Popen([PROGRAM, "decode", "--format", "jsonl", self.long_capture()],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.stdout.readline()
        process.stdout.close()
        error = process.stderr.read()
        process.stderr.close()
        self.assertEqual((process.wait(60), error), (0, b""))

    def test_a_reader_that_leaves_does_not_cut_files(self):
        path = self.long_capture()
        process = subprocess.Popen([PROGRAM, "decode", "-o", "jsonl=all.jsonl", path], cwd=self.dir,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.stdout.close()
        error = process.stderr.read()
        process.stderr.close()
        self.assertEqual((process.wait(60), error), (0, b""))
        with open(self.dir / "all.jsonl") as file:
            self.assertEqual(sum(1 for _ in file), 40006)

    def test_damage_is_said_once_and_what_stands_before_it_is_shown(self):
        content = open(self.healthy, "rb").read()
        done = self.decode("--format", "jsonl", self.file("cut.pcap", content[:-20]))
        self.assertEqual(len(done.out.splitlines()), 45)
        self.assertEqual(done.err.count("\n"), 1)
        self.assertIn("damaged", done.err)
        self.assertIn("everything up to frame 45 was read", done.err)

    def test_no_ethercat(self):
        done = self.decode("--format", "jsonl", self.file("arp.pcap", foreign_capture()))
        self.assertEqual(done.out, "")
        self.assertIn("no EtherCAT frame among 3 packets", done.err)

    def test_unreadable_captures(self):
        self.assertEqual(self.one_error("decode", "nowhere.pcap"), "no such file: nowhere.pcap")
        self.assertIn("not a capture", self.one_error("decode", self.file("n.txt", "text\n" * 100)))

    @unittest.skipUnless(os.path.exists("/proc/self/status"), "needs /proc")
    def test_memory_does_not_grow_with_the_capture(self):
        def peak_kib(path):
            with open(os.devnull, "w") as null:
                process = subprocess.Popen([PROGRAM, "decode", "--format", "jsonl", path], stdout=null)
                _, status, usage = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
            self.assertEqual(process.returncode, 0)
            return usage.ru_maxrss
        # Bigger than the look-ahead of the decoder, so that only growth with the length remains.
        bus = scanned_bus()
        for _ in range(3000):
            bus.read(0x0130, b"\1\0")
        short = peak_kib(self.file("short.pcap", bus.pcap()))
        self.assertLess(peak_kib(self.long_capture()), short + 2048)
