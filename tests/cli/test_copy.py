"""slice and annotate: captures with the findings as packet comments."""
import gzip
import shutil
import struct
import subprocess
import unittest

from support import SOURCE, Bus, CliTest, faulty_bus, faulty_capture, foreign_capture, scanned_bus

SAMPLES = SOURCE / "samples" / "captures"
REFUSED = SAMPLES / "init-to-op-refused.pcapng"  # f1 in frame 109 with 108, f2 in frame 112 because of it


def blocks(data):
    """(type, body) of a little-endian pcapng file."""
    at = 0
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        assert length == struct.unpack_from("<I", data, at + length - 4)[0]
        yield kind, data[at + 8:at + length - 4]
        at += length


def options(data):
    at = 0
    while at + 4 <= len(data):
        code, length = struct.unpack_from("<HH", data, at)
        if code == 0:
            return
        yield code, data[at + 4:at + 4 + length]
        at += 4 + (length + 3) // 4 * 4


def packets(data):
    """(interface, ticks, original length, bytes, comments) of each enhanced packet block."""
    for kind, body in blocks(data):
        if kind != 6:
            continue
        interface, high, low, captured, original = struct.unpack_from("<IIIII", body)
        rest = body[20 + (captured + 3) // 4 * 4:]
        yield (interface, high << 32 | low, original, body[20:20 + captured],
               [value.decode() for code, value in options(rest) if code == 1])


def interfaces(data):
    for kind, body in blocks(data):
        if kind == 1:
            yield struct.unpack_from("<H", body)[0], dict(options(body[8:]))


class CopyTest(CliTest):
    def copy(self, command, *arguments):
        """Runs the command into a new file; returns its bytes."""
        out = self.dir / "copy.pcapng"
        out.unlink(missing_ok=True)
        done = self.run_program(command, *arguments, "-o", out)
        self.assertEqual(done.returncode, 0, done.err)
        self.assertEqual(done.err, "")
        self.assertEqual(done.out.count("\n"), 1)
        return out.read_bytes()

    def numbers(self, data):
        """The frame numbers that the comments name."""
        return [int(comments[0].split(":")[0].removeprefix("frame ")) for *_, comments in packets(data)]


class Slice(CopyTest):
    def test_a_finding_with_its_related_frames_and_its_cause(self):
        data = self.copy("slice", REFUSED, "--finding", "f1", "--context", "0")
        self.assertEqual(self.numbers(data), [108, 109])
        data = self.copy("slice", REFUSED, "--finding", "f2", "--context", "0")
        self.assertEqual(self.numbers(data), [108, 109, 112])
        comments = [c for *_, c in packets(data)]
        self.assertTrue(comments[1][0].startswith("frame 109: f1 error al-illegal-transition, slave 0 (0x1001): "))
        self.assertIn("\nConsequence of f1 error", comments[2][0])

    def test_packets_are_the_same_bytes_at_the_same_time(self):
        original = list(packets(REFUSED.read_bytes()))
        data = self.copy("slice", REFUSED, "--frames", "100-120")
        copied = list(packets(data))
        self.assertEqual([p[:4] for p in copied], [p[:4] for p in original[99:120]])
        self.assertEqual(self.numbers(data), list(range(100, 121)))
        self.assertEqual(copied[0][4], ["frame 100"])
        self.assertEqual(list(interfaces(data)), list(interfaces(REFUSED.read_bytes())))

    def test_context(self):
        self.assertEqual(self.numbers(self.copy("slice", REFUSED, "--finding", "f1", "--context", "2")),
                         list(range(106, 112)))
        self.assertEqual(self.numbers(self.copy("slice", REFUSED, "--finding", "f1")), list(range(98, 120)))
        self.assertEqual(self.numbers(self.copy("slice", REFUSED, "--frames", "2", "--context", "5")),
                         list(range(1, 8)))
        self.assertEqual(self.numbers(self.copy("slice", REFUSED, "--frames", f"220-{2**64 - 1}", "--context", "3")),
                         list(range(217, 229)))
        self.assertIn("must be a number of packets",
                      self.one_error("slice", REFUSED, "--finding", "f1", "--context", "-1", "-o", "x"))

    def test_several_findings_and_rules(self):
        both = self.numbers(self.copy("slice", REFUSED, "--finding", "f1,f2", "--context", "0"))
        self.assertEqual(both, [108, 109, 112])
        self.assertEqual(self.numbers(self.copy("slice", REFUSED, "--finding", "al-refused", "--context", "0")), both)

    def test_ids_are_those_of_check_with_the_same_options(self):
        off = ["--rule", "al-illegal-transition=off"]
        report = self.report(*off, REFUSED, status=1)
        frame = report["reports"][0]["findings"][0]["frame"]
        self.assertEqual(frame, 112)
        self.assertIn(frame, self.numbers(self.copy("slice", *off, REFUSED, "--finding", "f1", "--context", "0")))

    def test_range_bounds_what_is_written_not_what_is_judged(self):
        data = self.copy("slice", REFUSED, "--finding", "f2", "--from", "#110")
        self.assertEqual(self.numbers(data), list(range(110, 123)))
        self.assertTrue(any("f2 error" in c[0] for *_, c in packets(data)))
        self.assertEqual(self.numbers(self.copy("slice", REFUSED, "--frames", "100-", "--to", "0.00417")),
                         list(range(100, 110)))

    def test_mistakes(self):
        self.assertEqual(self.one_error("slice", REFUSED, "-o", "x"), "give --finding ID or --frames A-B")
        self.assertEqual(self.one_error("slice", REFUSED, "--finding", "f1", "--frames", "1-2", "-o", "x"),
                         "give either --finding ID or --frames A-B, not both")
        self.assertIn("with -o PATH", self.one_error("slice", REFUSED, "--finding", "f1"))
        self.assertIn("there is no finding f7; the report has f1 to f2",
                      self.one_error("slice", REFUSED, "--finding", "f7", "-o", "x"))
        self.assertIn("did you mean 'al-refused'?",
                      self.one_error("slice", REFUSED, "--finding", "al-refusd", "-o", "x"))
        self.assertIn("there is nothing to write", self.one_error("slice", REFUSED, "--frames", "900-", "-o", "x"))
        self.assertIn("slice reads one capture",
                      self.one_error("slice", REFUSED, self.healthy, "--frames", "1", "-o", "x"))
        self.assertIn("has no slave 7", self.one_error("slice", REFUSED, "--frames", "1", "--slave", "7", "-o", "x"))
        self.assertFalse((self.dir / "x").exists())

    def test_nothing_is_overwritten_unasked(self):
        out = self.file("out.pcapng", b"precious")
        message = self.one_error("slice", REFUSED, "--finding", "f1", "-o", out)
        self.assertEqual(message, f"{out} exists; give --force to overwrite it")
        self.assertEqual((self.dir / "out.pcapng").read_bytes(), b"precious")
        self.assertEqual(self.run_program("slice", REFUSED, "--finding", "f1", "-o", out, "--force").returncode, 0)
        self.assertGreater(len(list(packets((self.dir / "out.pcapng").read_bytes()))), 2)

    def test_never_over_the_capture_itself(self):
        before = (self.dir / "faulty.pcap").read_bytes()
        message = self.one_error("slice", self.faulty, "--frames", "1", "-o", self.faulty, "--force")
        self.assertIn("is read as a capture", message)
        self.assertEqual((self.dir / "faulty.pcap").read_bytes(), before)


class Annotate(CopyTest):
    def test_all_frames_and_only_those_of_findings_have_comments(self):
        original = list(packets(REFUSED.read_bytes()))
        copied = list(packets(self.copy("annotate", REFUSED)))
        self.assertEqual([p[:4] for p in copied], [p[:4] for p in original])
        self.assertEqual([i + 1 for i, p in enumerate(copied) if p[4]], [108, 109, 112])

    def test_only_ethercat_leaves_the_capture_unless_asked(self):
        sample = SAMPLES / "foreign-traffic.pcapng"
        original = {p[3] for p in packets(sample.read_bytes())}
        ethercat = {p[3] for p in packets(self.copy("annotate", sample))}
        self.assertEqual({frame[12:14] for frame in ethercat}, {b"\x88\xa4"})
        self.assertLess(ethercat, original)
        self.assertEqual({p[3] for p in packets(self.copy("annotate", "--all-traffic", sample))}, original)
        self.assertIn("--all-traffic", self.one_error("annotate", self.file("f.pcap", foreign_capture()), "-o", "x"))

    def test_two_interfaces(self):
        sample = SAMPLES / "two-interfaces.pcapng"
        data = self.copy("annotate", sample)
        self.assertEqual([p[:4] for p in packets(data)], [p[:4] for p in packets(sample.read_bytes())])
        self.assertEqual(list(interfaces(data)), list(interfaces(sample.read_bytes())))
        self.assertEqual(len(list(interfaces(data))), 2)

    def test_every_container_gives_the_same_copy(self):
        plain = list(packets(self.copy("annotate", self.faulty)))
        self.assertGreater(sum(bool(p[4]) for p in plain), 1)
        packed = self.file("faulty.pcap.gz", gzip.compress(faulty_capture()))
        self.assertEqual(list(packets(self.copy("annotate", packed))), plain)
        if shutil.which("zstd"):
            subprocess.run(["zstd", "-q", self.faulty], check=True)
            self.assertEqual(list(packets(self.copy("annotate", self.faulty + ".zst"))), plain)
        done = subprocess.run([self.program(), "annotate", "-", "-o", "-"], input=faulty_capture(),
                              capture_output=True, check=True, timeout=60)
        self.assertEqual(list(packets(done.stdout)), plain)

    def test_messages_do_not_name_the_temporary_file_of_a_pipe(self):
        for command in (("annotate", "-o", "out.pcapng"), ("signals",)):
            done = subprocess.run([self.program(), *command, "-"], input=b"this is no capture at all", capture_output=True,
                                  cwd=self.dir, timeout=60)
            self.assertEqual(done.returncode, 2)
            self.assertIn(b"the input is not a capture", done.stderr)

    @staticmethod
    def program():
        from support import PROGRAM
        return PROGRAM

    def test_pcap_keeps_its_resolution(self):
        data = self.copy("annotate", SAMPLES / "pcap-microseconds.pcap")
        [(link_type, option)] = interfaces(data)
        self.assertEqual((link_type, option[9]), (1, b"\x06"))

    def test_comments_that_the_capture_has_stay(self):
        first = self.dir / "first.pcapng"
        self.run_program("annotate", REFUSED, "-o", first)
        again = list(packets(self.copy("annotate", first)))
        self.assertEqual([len(p[4]) for p in again if p[4]], [2, 4, 2])

    def test_files_of_a_ring_buffer(self):
        data = faulty_capture()
        half = 24 + 8 * (16 + 60)
        a = self.file("a.pcap", data[:half])
        b = self.file("b.pcap", data[:24] + data[half:])
        joined = list(packets(self.copy("annotate", "--join", b, a)))
        self.assertEqual(joined, list(packets(self.copy("annotate", self.faulty))))

    def test_damaged_capture(self):
        out = self.dir / "o.pcapng"
        done = self.run_program("annotate", SAMPLES / "truncated.pcapng", "-o", out)
        self.assertEqual(done.returncode, 0)
        self.assertIn("is damaged", done.err)
        self.assertEqual(len(list(packets(out.read_bytes()))), 331)

    def test_copy_is_judged_like_the_original(self):
        self.copy("annotate", REFUSED)
        ours, theirs = (self.report(path, status=1)["reports"][0] for path in (self.dir / "copy.pcapng", REFUSED))
        self.assertEqual(ours["findings"], theirs["findings"])
        self.assertEqual(ours["slaves"], theirs["slaves"])


class TwoBusses(CopyTest):
    def test_each_is_judged_by_its_interface(self):
        """A faulty bus, and a healthy one with more traffic on another interface."""
        healthy, faulty = scanned_bus(), faulty_bus(Bus())
        for _ in range(40):
            healthy.read(0x0130, b"\x01\0")
        packets = [(time, frame, 0) for time, frame in healthy.packets]
        packets += [(time + 300_000, frame[:7] + bytes([0x20] * 5) + frame[12:], 1) for time, frame in faulty.packets]
        out = [struct.pack("<IIIHHqI", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1, 28)]
        out += [struct.pack("<IIHHIHHB3xHHI", 1, 32, 1, 0, 0, 9, 1, 9, 0, 0, 32)] * 2
        for time, frame, interface in sorted(packets):
            length = 32 + (len(frame) + 3) // 4 * 4
            out.append(struct.pack("<IIIIIII", 6, length, interface, time >> 32, time & 0xFFFFFFFF, len(frame),
                                   len(frame)) + frame.ljust(length - 32, b"\0") + struct.pack("<I", length))
        both = self.file("both.pcapng", b"".join(out))
        report = self.report(both, status=0)
        self.assertEqual(report["summary"]["verdict"], "limited")
        findings = report["reports"][0]["findings"]
        self.assertEqual([f["rule"] for f in findings], ["capture-truncated"])
        self.assertIn("--interface 1", findings[0]["message"])
        self.assertEqual(self.report("--interface", "0", both, status=0)["summary"]["verdict"], "pass")
        second = self.report("--interface", "1", both, status=1)["reports"][0]
        self.assertEqual(second["settings"]["interfaces"], [1])
        self.assertEqual([f["rule"] for f in second["findings"]],
                         [f["rule"] for f in self.report(self.faulty, status=1)["reports"][0]["findings"]])
        lines = self.run_program("decode", "--interface", "1", both).out.splitlines()
        self.assertEqual(len(lines), 1 + len(faulty.packets))
        for command in ("check", "decode", "events"):
            nobody = self.run_program(command, "--interface", "7", both)
            self.assertEqual(nobody.returncode, 2, command)
            self.assertIn("--interface 7", nobody.err)
        out = self.dir / "named.pcapng"
        done = self.run_program("anonymize", "--interface", "1", both, "-o", out)
        self.assertEqual(done.returncode, 0, done.err)
        self.assertEqual(self.report("--interface", "1", out, status=1)["reports"][0]["findings"], second["findings"])
        wrong = self.run_program("check", "--interface", "eth0", both)
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("--interface is 'eth0'", wrong.err)


class TapWithTwoClocks(CopyTest):
    """A tap whose second interface has a clock of its own: the packets stand in the file as they are stamped."""

    @staticmethod
    def tap(bus, ahead_ns):
        """What went out is on interface 0, what came back on 1, stamped `ahead_ns` later; sorted by stamps."""
        stamped = [(time + (ahead_ns if frame[6] & 2 else 0), frame) for time, frame in bus.packets]
        out = [struct.pack("<IIIHHqI", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1, 28)]
        out += [struct.pack("<IIHHIHHB3xHHI", 1, 32, 1, 0, 0, 9, 1, 9, 0, 0, 32)] * 2
        for time, frame in sorted(stamped, key=lambda packet: packet[0]):
            length = 32 + (len(frame) + 3) // 4 * 4
            out.append(struct.pack("<IIIIIII", 6, length, 1 if frame[6] & 2 else 0, time >> 32, time & 0xFFFFFFFF,
                                   len(frame), len(frame)) +
                       frame.ljust(length - 32, b"\0") + struct.pack("<I", length))
        return b"".join(out)

    def judged(self, path):
        findings = self.report(path, status=1)["reports"][0]["findings"]
        about_file = [f for f in findings if f["rule"].startswith("capture-")]
        return [f for f in findings if f not in about_file], about_file

    def test_frames_are_those_of_the_copy(self):
        bus = faulty_bus(Bus())
        for _ in range(40):
            bus.read(0x0130, b"\x11\0")
        one_clock, about_one = self.judged(self.file("one.pcapng", self.tap(bus, 0)))
        self.assertEqual(about_one, [])
        apart = self.file("apart.pcapng", self.tap(bus, 37_000_000_000))
        moved, about_apart = self.judged(apart)
        self.assertEqual([f["rule"] for f in about_apart], ["capture-timestamps"])
        self.assertAlmostEqual(about_apart[0]["evidence"]["clocks_apart_ns"], 37_000_000_000, delta=20_000)
        self.assertIn("stamps of interface 1 are 37.000 s later than those of interface 0", about_apart[0]["message"])
        self.assertIn("ecaudit annotate", about_apart[0]["message"])
        same = ("rule", "severity", "frame", "last_frame", "count", "related_frames", "title", "message")
        self.assertEqual([[f[k] for k in same] for f in moved], [[f[k] for k in same] for f in one_clock])
        self.copy("annotate", apart)
        again, about_copy = self.judged(self.dir / "copy.pcapng")
        self.assertEqual(again, moved)
        self.assertEqual(about_copy, [])


@unittest.skipIf(shutil.which("tshark") is None, "tshark is not installed")
class CopiesInWireshark(CopyTest):
    @staticmethod
    def tshark(path, *fields):
        arguments = ["tshark", "-r", str(path), "-T", "fields", "-E", "separator=|"]
        for field in fields:
            arguments += ["-e", field]
        return subprocess.run(arguments, capture_output=True, text=True, check=True, timeout=60).stdout.splitlines()

    def test_comments_are_shown(self):
        self.copy("slice", REFUSED, "--finding", "f2", "--context", "0")
        lines = self.tshark(self.dir / "copy.pcapng", "frame.number", "frame.comment")
        self.assertEqual([line.split("|")[0] for line in lines], ["1", "2", "3"])
        self.assertIn("frame 109: f1 error al-illegal-transition", lines[1])
        self.assertIn("frame 112: f2 error al-refused", lines[2])

    def test_packets_are_unchanged(self):
        fields = ["frame.time_epoch", "frame.len", "frame.cap_len", "frame.interface_name", "eth.src", "ecat.cnt"]
        for name in ("init-to-op-refused.pcapng", "two-interfaces.pcapng", "snaplen.pcapng", "esl-probe.pcapng",
                     "udp-encapsulated.pcapng", "vlan-tagged.pcapng"):
            with self.subTest(name):
                self.copy("annotate", SAMPLES / name)
                self.assertEqual(self.tshark(self.dir / "copy.pcapng", *fields), self.tshark(SAMPLES / name, *fields))
