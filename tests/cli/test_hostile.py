"""Captures and files of others: no crash, nothing lost without a word, nothing written where it was not meant to be."""
import fcntl
import json
import os
import pathlib
import signal
import struct
import subprocess
import time
import unittest

from support import BRD, PROGRAM, SOURCE, Bus, CliTest, faulty_capture, healthy_capture, scanned_bus

LRD = 10
NOBODY = 65534  # a user that is neither this one nor root


def block(kind: int, body: bytes) -> bytes:
    body += b"\0" * (-len(body) % 4)
    length = 12 + len(body)
    return struct.pack("<II", kind, length) + body + struct.pack("<I", length)


def option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + value + b"\0" * (-len(value) % 4)


def pcapng(packets, link_type=1, flags=None, dropped=None, prefix=b"") -> bytes:
    """`packets` as Bus has them. @param flags of each packet. @param dropped by the interface statistics"""
    out = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    out += block(1, struct.pack("<HHI", link_type, 0, 0) + option(9, b"\x09"))
    for time_ns, frame in packets:
        frame = prefix + frame
        body = struct.pack("<IIIII", 0, time_ns >> 32, time_ns & 0xFFFFFFFF, len(frame), len(frame))
        body += frame + b"\0" * (-len(frame) % 4)
        if flags is not None:
            body += option(2, struct.pack("<I", flags)) + option(0, b"")
        out += block(6, body)
    if dropped is not None:
        out += block(5, struct.pack("<III", 0, 0, 0) + option(5, struct.pack("<Q", dropped)) + option(0, b""))
    return out


def packets_of(content: bytes) -> list:
    bus = Bus()
    at = 24
    while at < len(content):
        seconds, nanoseconds, length, _ = struct.unpack_from("<IIII", content, at)
        bus.packets.append((seconds * 10**9 + nanoseconds, content[at + 16:at + 16 + length]))
        at += 16 + length
    return bus.packets


class HostileCaptures(CliTest):
    def one_report(self, name, content, status):
        return self.report(self.file(name, content), status=status)["reports"][0]

    def set_aside(self, report):
        return [f for f in report["findings"] if f["rule"] == "capture-truncated"]

    def test_four_frames_that_ended_the_program(self):
        """A broadcast with index 15 and its return, one with index 1 without, and a return of which nothing was sent."""
        def frame(first, command, index, wkc):
            datagram = struct.pack("<BBHHHH", command, index, wkc, 0x0130, 2, 0) + b"\0\0" + struct.pack("<H", wkc)
            source = bytes([first]) + bytes([0x10] * 5)
            return (b"\xff" * 6 + source + b"\x88\xa4" + struct.pack("<H", len(datagram) | 0x1000) + datagram).ljust(60, b"\0")

        bus = Bus()
        for n, packet in enumerate((frame(0x10, BRD, 15, 0), frame(0x12, BRD, 15, 1), frame(0x10, BRD, 1, 0),
                                    frame(0x12, LRD, 0, 1))):
            bus.packets.append((10**9 + n * 1000, packet))
        path = self.file("four.pcap", bus.pcap())
        for command in ("check", "events", "startup", "decode", "signals"):
            self.assertIn(self.run_program(command, path).returncode, (0, 1, 2), command)

    def test_frames_marked_bad_are_no_pass(self):
        report = self.one_report("crc.pcapng", pcapng(packets_of(healthy_capture()), flags=1 << 24), 0)
        self.assertEqual(report["summary"]["verdict"], "limited")
        (finding,) = self.set_aside(report)
        self.assertEqual(finding["arguments"]["marked_bad"]["value"], 46)
        self.assertEqual(report["capture"]["crc_error_frames"], report["capture"]["packets"])

    def test_flags_that_say_nothing_bad_change_nothing(self):
        report = self.one_report("flags.pcapng", pcapng(packets_of(healthy_capture()), flags=1), 0)
        self.assertEqual(report["summary"]["verdict"], "pass")
        self.assertEqual(report["findings"], [])

    def test_link_types_that_are_not_read_are_named(self):
        packets = packets_of(faulty_capture())
        for link_type, name in ((189, "USB"), (147, "user 0")):
            report = self.one_report(f"{link_type}.pcapng", pcapng(packets, link_type, prefix=b"\0\0\0\0"), 0)
            self.assertEqual(report["summary"]["verdict"], "limited")
            (finding,) = self.set_aside(report)
            self.assertIn(f"link type {link_type} ({name})", finding["message"])

    def test_packets_dropped_by_the_capturing_machine(self):
        report = self.one_report("drops.pcapng", pcapng(packets_of(healthy_capture()), dropped=100_000), 0)
        (finding,) = self.set_aside(report)
        self.assertEqual(finding["arguments"]["dropped"]["text"], "100,000 packets")
        self.assertEqual(report["summary"]["verdict"], "limited")
        self.assertEqual(self.set_aside(self.one_report("none.pcapng", pcapng(packets_of(healthy_capture()), dropped=0), 0)), [])

    def test_one_answer_with_a_flipped_bit(self):
        """The answer that shows the error bit is altered: what hides in it has to be said."""
        packets = packets_of(faulty_capture())
        at = next(i for i, (_, p) in enumerate(packets) if p[6] == 0x12 and p[26:28] == b"\x11\0")
        time_ns, packet = packets[at]
        packets[at] = (time_ns, packet[:20] + bytes([packet[20] ^ 8]) + packet[21:])
        report = self.one_report("altered.pcapng", pcapng(packets), self.check(self.file("x.pcapng", pcapng(packets)), status=1).returncode)
        self.assertTrue(any("returned with flipped bits" in f["message"] for f in self.set_aside(report)), report["findings"])

    def test_many_tags_are_read(self):
        tags = b"\x81\x00\x00\x05" * 6
        packets = [(t, p[:12] + tags + p[12:]) for t, p in packets_of(faulty_capture())]
        report = self.one_report("tags.pcapng", pcapng(packets), 1)
        self.assertIn("al-refused", [f["rule"] for f in report["findings"]])

    def test_a_bad_length_in_the_first_record(self):
        content = bytearray(healthy_capture())
        struct.pack_into("<I", content, 24 + 8, 0x7FFFFFFF)
        path = self.file("first.pcap", bytes(content))
        report = self.report(path, status=0)["reports"][0]
        self.assertEqual(report["summary"]["verdict"], "limited")
        self.assertIn("capture-truncated", [f["rule"] for f in report["findings"]])
        self.assertFalse(report["capture"]["complete"])
        self.assertNotIn("no packet", self.run_program("check", path).err)

    def test_two_masters_in_one_capture(self):
        """The second one sends a frame that nobody answers, and is heard of again with its faults when it is forgotten."""
        first, second = scanned_bus(), Bus()
        for _ in range(200):
            first.read(0x0130, b"\x01\0")
        packets = list(first.packets)
        other = packets_of(faulty_capture())
        swap = lambda p: p[:6] + bytes([p[6]]) + b"\x20" * 5 + p[12:]
        packets.insert(4, (packets[4][0] - 1, swap(other[0][1])))
        end = packets[-1][0]
        packets += [(end + 1000 * (n + 1), swap(p)) for n, (_, p) in enumerate(other)]
        report = self.one_report("two.pcapng", pcapng(packets), 0)
        self.assertTrue(any("of other masters" in f["message"] for f in self.set_aside(report)), report["findings"])

    def test_two_masters_from_the_first_packet_on(self):
        """A bus without faults, and another one that is seen as often: neither is taken for a part of the other."""
        first, second = scanned_bus(), scanned_bus()
        second.index = 100
        for _ in range(60):
            first.read(0x0130, b"\x01\0")
            second.read(0x0130, b"\x01\0")
            second.read(0x0110, b"\0\0")
        for _ in range(40):
            first.read(0x0130, b"\x01\0")
        second.write(0x0120, b"\x08\0")
        second.read(0x0130, b"\x11\0")

        def swap(packet):
            """Another address; and there are two slaves."""
            packet = bytearray(packet[:6] + packet[6:7] + b"\x20" * 5 + packet[12:])
            if packet[6] == 0x12 and packet[16] in (BRD, 2):
                packet[18] += 1
                packet[28] = 2 if packet[16] == BRD else packet[28]
            return bytes(packet)

        begin = second.packets[0][0]  # the other one is twice as fast: its bus is the one that is judged
        faster = [(begin + (t - begin) // 2 + 5000, swap(p)) for t, p in second.packets]
        report = self.one_report("both.pcapng", pcapng(sorted([*first.packets, *faster])), 1)
        rules = {f["rule"] for f in report["findings"]}
        self.assertIn("al-refused", rules)
        # The slaves' numbers differ: two segments, not two masters on one.
        self.assertNotIn("bus-second-master", rules)
        self.assertTrue(any("of other masters" in f["message"] for f in self.set_aside(report)), report["findings"])

    def test_a_redundant_line_is_one_bus(self):
        """The same frames go out at both ends, each with an address of its own; at the far one they pass nobody."""
        bus = scanned_bus()
        for _ in range(100):
            bus.read(0x0130, b"\x01\0")
        far = lambda p, bit: p[:6] + bytes([p[6] | bit]) + b"\x20" * 5 + p[12:]
        sent = [(t, p) for t, p in bus.packets if not p[6] & 2]
        packets = sorted([*bus.packets, *((t + 500, far(p, 0)) for t, p in sent), *((t + 700, far(p, 2)) for t, p in sent)])
        report = self.one_report("redundant.pcapng", pcapng(packets), 0)
        self.assertEqual(self.set_aside(report), [])


class CutStartups(CliTest):
    """A start-up of more steps than are kept: what was cut is neither the same nor missing."""

    def setUp(self):
        super().setUp()
        bus = scanned_bus()
        for n in range(1300):
            bus.write(0x0800 + 8 * (n % 8), struct.pack("<HHI", 0x1000 + n, 16, 0))
        bus.write(0x0120, b"\x02\0")
        bus.read(0x0130, b"\x02\0")
        self.long = self.file("long.pcap", bus.pcap())

    def test_diff_does_not_call_it_the_same(self):
        done = self.run_program("diff", self.long, self.file("again.pcap", pathlib.Path(self.long).read_bytes()))
        self.assertEqual(done.returncode, 1, done.out)
        self.assertRegex(done.out, r"A \d+ steps not kept")

    def test_an_expectation_does_not_miss_it(self):
        self.assertIn("without its last", self.run_program("startup", "--save", "m.json", self.long).err)
        wanted = json.loads((self.dir / "m.json").read_text())
        steps = wanted["slaves"][0]["steps"]
        steps.append(dict(steps[-1], value="ffee100000000000"))
        path = self.file("more.json", json.dumps(wanted))
        report = json.loads(self.run_program("startup", "--expect", path, "--format", "json", self.long).out)["reports"][0]
        self.assertEqual(report["findings"], [])
        self.assertIn("more start-up steps than the report keeps", [n["reason"] for n in report["not_evaluable"] if n["rule"] == "startup-step-missing"][0])
        self.assertTrue(any("start-up" in r["what"] for r in report["limits_reached"]))


class HostileFiles(CliTest):
    def test_pipes_and_devices_are_not_read_as_settings(self):
        fifo = self.dir / "fifo"
        os.mkfifo(fifo)
        for path in (str(fifo), "/dev/zero"):
            for arguments in (("check", "--baseline", path, self.healthy), ("check", "--config", path, self.healthy),
                              ("startup", "--expect", path, self.healthy), ("merge", path),
                              ("check", "--eni", path, self.healthy), ("check", "--esi", path, self.healthy)):
                with self.subTest(arguments):
                    self.assertRegex(self.one_error(*arguments), "is a pipe or device, not a file|not a file")

    @unittest.skipIf(os.geteuid() != 0, "only root may give files away")
    def test_configuration_of_another_user(self):
        self.file("in/.ecaudit.json", '{"rules": {"al-refused": "off"}, "fail_on": "never"}')
        path = self.file("in/deep/a.pcap", faulty_capture())
        os.chown(self.dir / "in" / ".ecaudit.json", NOBODY, NOBODY)
        self.assertIn("belongs to another user", self.one_error("check", path))
        batch = self.run_program("batch", path)  # the other captures are still checked
        self.assertEqual(batch.returncode, 2)
        self.assertIn("belongs to another user", batch.out)
        self.check("--config", self.dir / "in" / ".ecaudit.json", path, status=0)
        self.check("--config", self.file("mine.json", "{}"), path, status=1)
        os.chown(self.dir / "in" / ".ecaudit.json", 0, 0)
        self.check(path, status=0)
        os.chmod(self.dir / "in" / ".ecaudit.json", 0o666)
        self.assertIn("is writable by all users", self.one_error("check", path))

    def test_the_summary_names_configurations(self):
        self.file("in/.ecaudit.json", '{"fail_on": "never"}')
        self.file("in/a.pcap", faulty_capture())
        done = self.run_program("batch", "in")
        self.assertIn("Configuration files", done.out)
        self.assertRegex(done.out, r"in[/\\]\.ecaudit\.json: 1 capture")

    def test_a_link_under_the_name_of_a_report_is_replaced(self):
        self.file("in/a.pcap", healthy_capture())
        self.assertEqual(self.run_program("batch", "in").returncode, 0)
        (report,) = (self.dir / "ecaudit-reports").iterdir()
        target = pathlib.Path(self.file("precious", "mine"))
        report.unlink()
        report.symlink_to(target)
        self.assertEqual(self.run_program("batch", "in").returncode, 0)
        self.assertEqual(target.read_text(), "mine")
        self.assertFalse(report.is_symlink())
        self.assertEqual(json.loads(report.read_text())["schema"], "ecaudit.report/1")

    @unittest.skipIf(os.geteuid() != 0, "only root may give links away")
    def test_a_link_of_another_user_is_not_followed(self):
        target = pathlib.Path(self.file("precious", "mine"))
        link = self.dir / "out.json"
        link.symlink_to(target)
        self.check("-o", link, self.healthy, status=0)
        target.write_text("mine")
        os.chown(link, NOBODY, NOBODY, follow_symlinks=False)
        self.assertIn("a link that another user made", self.one_error("check", "-o", link, self.healthy))
        self.assertEqual(target.read_text(), "mine")

    def test_unfinished_reports_of_another_run_stay(self):
        self.file("in/a.pcap", healthy_capture())
        self.assertEqual(self.run_program("batch", "in").returncode, 0)
        folder = self.dir / "ecaudit-reports"
        (report,) = folder.iterdir()
        unfinished = folder / (report.name + ".AbCdEf")
        unfinished.write_text("{")
        held = os.open(folder, os.O_RDONLY)
        fcntl.flock(held, fcntl.LOCK_SH)
        self.assertEqual(self.run_program("batch", "in").returncode, 0)
        self.assertTrue(unfinished.exists(), "another batch may be writing it")
        os.close(held)
        self.assertEqual(self.run_program("batch", "in").returncode, 0)
        self.assertFalse(unfinished.exists())

    def test_what_a_folder_holds_besides_is_named(self):
        self.file("in/a.pcap", healthy_capture())
        self.file("in/b.pcap.xz", "packed")
        self.file("in/c.pcapng.bz2", "packed")
        self.file("in/notes.txt", "no capture")
        (self.dir / "in" / "gone.pcap").symlink_to("nowhere")
        os.mkfifo(self.dir / "in" / "pipe.pcap")
        done = self.run_program("batch", "in")
        self.assertEqual(done.returncode, 0, done.err)
        for name in ("b.pcap.xz", "c.pcapng.bz2", "gone.pcap", "pipe.pcap"):
            self.assertIn(f"in/{name} is ignored", done.err)
        self.assertNotIn("notes.txt", done.err)

    def test_names_of_any_length(self):
        long = "a" * 60_000
        self.assertEqual(self.run_program("batch", "--join", long, self.healthy).returncode, 2)
        self.assertEqual(self.run_program("batch", "--join", "b_00001_" * 7000, self.healthy).returncode, 2)

    def test_long_names_are_not_repeated_with_each_finding(self):
        name = "N" * 1_000_000
        eni = self.file("eni.xml", f"""<EtherCATConfig><Config><Slave><Info><Name>{name}</Name><PhysAddr>4097</PhysAddr>
            <AutoIncAddr>0</AutoIncAddr></Info></Slave></Config></EtherCATConfig>""")
        for arguments in ((), ("--format", "json")):
            self.assertLess(len(self.check("--eni", eni, *arguments, self.faulty, status=1).out), 100_000)

    def test_names_are_no_formulas_in_csv(self):
        eni = (SOURCE / "samples" / "descriptions" / "two-axes.eni.xml").read_text().replace("Axis X", "=cmd()")
        path = self.file("evil.eni.xml", eni)
        capture = SOURCE / "samples" / "captures" / "mid-run.pcapng"
        header = self.run_program("signals", "--eni", path, capture).out.splitlines()[0]
        self.assertIn("'=cmd()", header)
        for cell in header.split(","):
            self.assertNotIn(cell.lstrip('"')[:1], "=+-@", header)

    def test_elements_with_attributes_without_end(self):
        many = " ".join(f'a{n}="1"' for n in range(200_000))
        path = self.file("evil.esi.xml", f"<EtherCATInfo {many}></EtherCATInfo>")
        begin = time.monotonic()
        self.assertIn("more than 1,000 attributes", self.one_error("check", "--esi", path, self.healthy))
        self.assertLess(time.monotonic() - begin, 10)


class CrashedWorker(CliTest):
    def workers(self, parent: int) -> list:
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            try:
                if entry.name.isdigit() and int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1]) == parent:
                    found.append(int(entry.name))
            except (OSError, IndexError, ValueError):
                pass
        return found

    def test_a_signal_says_where(self):
        pipe = self.dir / "slow.pcap"
        os.mkfifo(pipe)
        with subprocess.Popen([PROGRAM, "check", pipe], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              stdin=subprocess.DEVNULL, cwd=self.dir) as child:
            with open(pipe, "wb") as slow:
                slow.write(healthy_capture())
                slow.flush()
                time.sleep(0.5)
                child.send_signal(signal.SIGSEGV)
                out, err = child.communicate(timeout=60)
        if b"Sanitizer" in err:
            self.skipTest("sanitizers have a report of their own")
        self.assertEqual(child.returncode, 3)
        self.assertEqual(out, b"")
        self.assertRegex(err.decode(), r"^ecaudit: internal error: ecaudit [\d.]+ was ended by signal 11.*; please report it")

    def test_the_others_are_whole(self):
        """A worker that reads from a pipe is ended by a signal: its capture has failed, and is named."""
        for n in range(6):
            self.file(f"in/{n}.pcap", healthy_capture())
        pipe = self.dir / "slow.pcap"
        os.mkfifo(pipe)
        with subprocess.Popen([PROGRAM, "batch", "in", pipe, "--jobs", "2", "-o", "json=s.json"], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, cwd=self.dir) as child:
            with open(pipe, "wb") as slow:
                slow.write(healthy_capture()[:200])
                slow.flush()
                folder = self.dir / "ecaudit-reports"
                for _ in range(600):
                    if folder.exists() and len([p for p in folder.iterdir() if p.name.endswith(".json")]) == 6:
                        break
                    time.sleep(0.05)
                busy = [pid for pid in self.workers(child.pid)
                        if any(os.path.realpath(f"/proc/{pid}/fd/{fd}") == str(pipe.resolve())
                               for fd in os.listdir(f"/proc/{pid}/fd"))]
                self.assertEqual(len(busy), 1)
                os.kill(busy[0], signal.SIGSEGV)
                out, err = child.communicate(timeout=60)
        self.assertEqual(child.returncode, 3, err)
        self.assertRegex(err.decode(), r"slow\.pcap: internal error: ecaudit [\d.]+ (was ended by signal 11|ended with)")
        summary = json.loads((self.dir / "s.json").read_text())
        status = {pathlib.Path(c["path"]).name: c["status"] for c in summary["captures"]}
        self.assertEqual(status.pop("slow.pcap"), "unreadable")
        self.assertEqual(set(status.values()), {"pass"})
        self.assertEqual(len(status), 6)
        # Its report says so, too, and is tried again.
        self.assertEqual(self.run_program("merge", "ecaudit-reports").returncode, 2)


if __name__ == "__main__":
    unittest.main()
