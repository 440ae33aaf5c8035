"""Ended from outside. Ctrl-C at any moment: status 130, and what was found so far. A full disk: status 2, and one clear
line. A reader that leaves: quietly."""
import array
import fcntl
import gzip
import json
import os
import pathlib
import resource
import signal
import subprocess
import termios
import threading
import time
import unittest

from support import PROGRAM, SOURCE, CliTest, healthy_capture

# Ctrl-C has to work within a second; a busy machine and a build with sanitizers get some more.
SOON_S = 10
HEADER, PACKETS = healthy_capture()[:24], healthy_capture()[24:]


def listens(pid) -> bool:
    """The program catches SIGINT."""
    with open(f"/proc/{pid}/status") as status:
        caught = next(line for line in status if line.startswith("SigCgt:"))
    return bool(int(caught.split()[1], 16) & 1 << (signal.SIGINT - 1))


def sleeps(pid) -> bool:
    """The program has worked off what it got, and waits."""
    for _ in range(5):
        with open(f"/proc/{pid}/stat") as status:
            if status.read().rsplit(")", 1)[1].split()[0] != "S":
                return False
        time.sleep(0.01)
    return True


def unread(descriptor) -> int:
    """Bytes in a pipe that nobody has taken yet."""
    count = array.array("i", [0])
    fcntl.ioctl(descriptor, termios.FIONREAD, count)
    return count[0]


KEPT = '{"schema": "ecaudit.baseline/1", "findings": []}'


@unittest.skipUnless(os.path.exists("/proc/self/status"), "this system has no /proc")
class InterruptionTest(CliTest):
    def wait_until(self, condition, child):
        until = time.monotonic() + 60
        while not condition():
            self.assertIsNone(child.poll(), "it ended too early")
            self.assertLess(time.monotonic(), until)
            time.sleep(0.01)

    def interrupted(self, *arguments, ready=lambda child: True, number=signal.SIGINT, stdout=subprocess.PIPE,
                    **options):
        """Starts the program, interrupts it when it listens and `ready`; standard output and error."""
        with subprocess.Popen([PROGRAM, *arguments], stdout=stdout, stderr=subprocess.PIPE, cwd=self.dir,
                              **options) as child:
            try:
                self.wait_until(lambda: listens(child.pid) and ready(child), child)
                child.send_signal(number)
                out, err = child.communicate(timeout=SOON_S)
            finally:
                child.kill()
        self.assertEqual(child.returncode, 130, f"{arguments}\n{err.decode()}")
        self.assertIn("interrupted", err.decode(), arguments)
        return (out or b"").decode(errors="replace"), err.decode()

    def on_silent_pipe(self, *arguments, given=b"", number=signal.SIGINT):
        """The pipe gives `given` and stays open."""
        read_end, write_end = os.pipe()
        try:
            os.write(write_end, given)
            return self.interrupted(*arguments, stdin=read_end, number=number,
                                    ready=lambda child: unread(read_end) == 0 and sleeps(child.pid))
        finally:
            os.close(read_end)
            os.close(write_end)

    def on_endless_pipe(self, *arguments):
        """Packets come and come."""
        read_end, write_end = os.pipe()
        given = 0

        def feed():
            nonlocal given
            try:
                os.write(write_end, HEADER)
                while True:
                    given += os.write(write_end, PACKETS)
            except BrokenPipeError:
                pass

        feeder = threading.Thread(target=feed)
        feeder.start()
        try:
            return self.interrupted(*arguments, stdin=read_end, stdout=subprocess.DEVNULL,
                                    ready=lambda child: given > 1_000_000)
        finally:
            os.close(read_end)
            feeder.join(SOON_S)
            os.close(write_end)

    def nothing_left(self, *names):
        """No file that the program was to write, nor a part of one."""
        self.assertEqual([path.name for path in self.dir.iterdir() if path.name.startswith(names)], [])


class InterruptedReading(InterruptionTest):
    READERS = [["check", "-"], ["check", "--join", "-", "healthy.pcap"], ["decode", "-"], ["events", "-"],
               ["signals", "-"], ["startup", "-"], ["diff", "healthy.pcap", "-"], ["diff", "-", "healthy.pcap"],
               ["slice", "-", "--frames", "1-3", "-o", "out.pcapng"], ["annotate", "-", "-o", "out.pcapng"]]

    def test_a_silent_pipe(self):
        for arguments in self.READERS:
            with self.subTest(arguments):
                self.on_silent_pipe(*arguments)
                self.nothing_left("out.pcapng")

    def test_a_pipe_that_falls_silent(self):
        for arguments in self.READERS:
            with self.subTest(arguments):
                self.on_silent_pipe(*arguments, given=healthy_capture())
                self.nothing_left("out.pcapng")

    def test_sigterm_is_the_same(self):
        self.on_silent_pipe("check", "-", given=healthy_capture(), number=signal.SIGTERM)

    def test_packets_without_end(self):
        for arguments in self.READERS:
            with self.subTest(arguments):
                self.on_endless_pipe(*arguments)
                self.nothing_left("out.pcapng")

    def test_a_named_pipe_that_nobody_opens(self):
        for name in ("one", "two"):
            os.mkfifo(self.dir / name)
        for arguments in (["check", "one"], ["check", "--join", "one", "two"], ["decode", "one"], ["events", "one"],
                          ["signals", "one"], ["startup", "one"], ["diff", "healthy.pcap", "one"],
                          ["annotate", "one", "-o", "out.pcapng"], ["batch", "one", "two", "--jobs", "2"]):
            with self.subTest(arguments):
                self.interrupted(*arguments, stdin=subprocess.DEVNULL)
                self.nothing_left("out.pcapng")

    def test_a_named_pipe_that_is_opened_late_is_read(self):
        os.mkfifo(self.dir / "late")
        for command, lines in (("check", "no findings in 46 EtherCAT frames"), ("signals", "time_s,")):
            with subprocess.Popen([PROGRAM, command, "late"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                  stdin=subprocess.DEVNULL, cwd=self.dir) as child:
                self.wait_until(lambda: listens(child.pid), child)
                time.sleep(0.2)
                (self.dir / "late").write_bytes(healthy_capture())
                out, err = child.communicate(timeout=60)
            self.assertEqual(child.returncode, 0, err)
            self.assertIn(lines, out.decode())

    def big(self):
        """Minutes of packets in a small file: a gzip file of many members."""
        member = gzip.compress(PACKETS * 1000)
        with open(self.dir / "big.pcap.gz", "wb") as file:
            file.write(gzip.compress(HEADER))
            for _ in range(70):
                file.write(member)
        return "big.pcap.gz"

    def test_in_the_middle_of_a_large_file(self):
        big = self.big()

        def reading(child):
            """It, or a worker of a batch, has decompressed for a moment."""
            with open(f"/proc/{child.pid}/task/{child.pid}/children") as children:
                processes = [str(child.pid), *children.read().split()]
            ticks = 0
            for process in processes:
                with open(f"/proc/{process}/stat") as stat:
                    ticks += int(stat.read().rsplit(")", 1)[1].split()[11])
            return ticks > 0.2 * os.sysconf("SC_CLK_TCK")

        for arguments in (["check", big], ["check", "-o", "report.html", big], ["check", "--join", big, "healthy.pcap"],
                          ["startup", big], ["signals", big], ["diff", "healthy.pcap", big],
                          ["annotate", big, "-o", "out.pcapng"], ["batch", big]):
            with self.subTest(arguments):
                self.interrupted(*arguments, stdin=subprocess.DEVNULL, ready=reading)
                self.nothing_left("out.pcapng")

    def test_long_stretches_without_packets(self):
        # pcapng with nothing but blocks that nobody knows, in a sparse file: read through, no packet ever comes.
        block = (0x0BAD).to_bytes(4, "little") + (1 << 20).to_bytes(4, "little")
        with open(self.dir / "blocks.pcapng", "wb") as file:
            file.write(bytes.fromhex("0a0d0d0a1c0000004d3c2b1a01000000ffffffffffffffff1c000000"))
            for _ in range(20_000):
                file.write(block)
                file.seek((1 << 20) - 12, os.SEEK_CUR)
                file.write(block[4:])
        for command in ("check", "decode"):
            self.interrupted(command, "blocks.pcapng", stdin=subprocess.DEVNULL)


class InterruptedReports(InterruptionTest):
    """What was found so far is delivered, and says that it is not all."""

    def test_check(self):
        out, err = self.on_silent_pipe("check", "-", given=healthy_capture())
        self.assertIn("no findings in 46 EtherCAT frames of 1 slave, as far as the capture was read", out)
        self.assertIn("the report covers only the part of the capture that was read", out)
        self.assertEqual(err, "ecaudit: -: interrupted after 46 packets\n")

    def test_json(self):
        out, _ = self.on_silent_pipe("check", "--format", "json", "-o", "json=a.json", "-", given=healthy_capture())
        for text in (out, (self.dir / "a.json").read_text()):
            capture = json.loads(text)["reports"][0]["capture"]
            self.assertIs(capture["complete"], False)
            self.assertEqual(capture["packets"], 46)

    def test_findings_count_nothing_against_the_interruption(self):
        out, _ = self.on_silent_pipe("check", "-", given=open(self.faulty, "rb").read())
        self.assertIn("FAIL -: ", out)

    def test_captures_that_were_not_reached_are_counted(self):
        out, err = self.on_silent_pipe("check", "faulty.pcap", "-", "healthy.pcap", "faulty.pcap",
                                       given=healthy_capture())
        self.assertIn("FAIL faulty.pcap: ", out)
        self.assertIn("PASS -: ", out)
        self.assertNotIn("healthy.pcap", out)
        self.assertEqual(err, "ecaudit: -: interrupted after 46 packets\necaudit: 2 captures not read\n")

    def test_before_the_first_packet_files_tell(self):
        out, _ = self.on_silent_pipe("check", "-o", "json=a.json", "-")
        self.assertEqual(out, "")
        self.assertEqual(json.loads((self.dir / "a.json").read_text())["reports"], [])

    def test_a_slave_that_did_not_come_yet(self):
        out, err = self.on_silent_pipe("check", "--slave", "0x1234", "-", given=healthy_capture())
        self.assertNotIn("no slave", err)
        self.assertIn("as far as the capture was read", out)

    def test_startup(self):
        out, _ = self.on_silent_pipe("startup", "-", given=healthy_capture())
        self.assertIn("incomplete: only a part of the capture was read", out)
        self.assertIn("slave 0 (0x1001): INIT reached", out)
        self.assertNotIn("incomplete", self.run_program("startup", self.healthy).out)

    def test_half_a_startup_is_no_expectation(self):
        self.assertEqual(self.run_program("startup", "--save", "good.json", self.healthy).returncode, 0)
        before = (self.dir / "good.json").read_text()
        _, err = self.on_silent_pipe("startup", "--save", "good.json", "-", given=healthy_capture())
        self.assertIn("interrupted: good.json was not written", err)
        self.assertEqual((self.dir / "good.json").read_text(), before)

    def test_startup_with_an_expectation(self):
        self.assertEqual(self.run_program("startup", "--save", "good.json", self.healthy).returncode, 0)
        half = HEADER + PACKETS[:len(PACKETS) // 2]
        self.on_silent_pipe("startup", "--expect", "good.json", "-", given=half)

    def test_half_a_baseline_is_none(self):
        self.file("known.json", KEPT)
        for command in (["check", "-"], ["startup", "--expect", "good.json", "-"]):
            self.run_program("startup", "--save", "good.json", self.healthy)
            _, err = self.on_silent_pipe(*command, "--write-baseline", "known.json", given=healthy_capture())
            self.assertIn("interrupted", err)
            self.assertEqual((self.dir / "known.json").read_text(), KEPT)

    def test_batch(self):
        os.mkfifo(self.dir / "pipe")
        self.file("known.json", KEPT)
        reports = self.dir / "ecaudit-reports"
        out, err = self.interrupted("batch", "healthy.pcap", "pipe", "--jobs", "1", "--write-baseline", "known.json",
                                    stdin=subprocess.DEVNULL,
                                    ready=lambda child: any(reports.glob("healthy.pcap-*.json")))
        self.assertIn("INCOMPLETE", out)
        self.assertIn("interrupted, 1 not checked", err)
        self.assertIn("known.json was not written", err)
        self.assertEqual((self.dir / "known.json").read_text(), KEPT)
        self.assertEqual(len(list(reports.iterdir())), 1)

    def test_decode_and_events_give_whole_lines(self):
        for command in ("decode", "events"):
            out, err = self.on_silent_pipe(command, "--format", "jsonl", "-", given=healthy_capture())
            self.assertGreater(len([json.loads(line) for line in out.splitlines()]), 0)
            self.assertEqual(err, "ecaudit: -: interrupted after 46 packets\n")

    def test_a_copy_on_standard_output_says_that_it_ends_early(self):
        for arguments in (["annotate", "-", "-o", "-"], ["slice", "--frames", "1-2", "-", "-o", "-"]):
            self.on_silent_pipe(*arguments, given=healthy_capture())

    def test_diff_compares_nothing(self):
        out, err = self.on_silent_pipe("diff", "healthy.pcap", "-", given=healthy_capture())
        self.assertEqual(out, "")
        self.assertEqual(err, "ecaudit: -: interrupted after 46 packets\n")


START_UP = str(pathlib.Path(SOURCE) / "samples" / "captures" / "clean-startup.pcapng")
# Every command that prints or writes, with the files it may write.
PRINTING = [["check", "healthy.pcap"], ["check", "--format", "json", "healthy.pcap"],
            ["check", "--format", "junit", "healthy.pcap"], ["check", "--format", "sarif", "healthy.pcap"],
            ["decode", "healthy.pcap"], ["decode", "--format", "jsonl", "healthy.pcap"], ["events", "healthy.pcap"],
            ["signals", "healthy.pcap"], ["startup", "healthy.pcap"], ["diff", START_UP, START_UP],
            ["diff", "--format", "json", START_UP, START_UP], ["annotate", "healthy.pcap", "-o", "-"],
            ["slice", "healthy.pcap", "--frames", "1-3", "-o", "-"], ["batch", "healthy.pcap"],
            ["merge", "made"], ["rules"], ["explain", "al-refused"], ["profiles"], ["profiles", "generic"],
            ["--help"], ["--version"], ["check", "--help"]]
WRITING = [["check", "-o", "{}", "healthy.pcap"], ["check", "-o", "json={}", "healthy.pcap"],
           ["check", "-o", "junit={}", "healthy.pcap"], ["check", "-o", "sarif={}", "healthy.pcap"],
           ["check", "--write-baseline", "{}", "faulty.pcap", "--fail-on", "never"], ["decode", "-o", "{}", "healthy.pcap"],
           ["decode", "-o", "jsonl={}", "healthy.pcap"], ["events", "-o", "{}", "healthy.pcap"],
           ["signals", "-o", "csv={}", "healthy.pcap"], ["startup", "-o", "{}", "healthy.pcap"],
           ["startup", "--save", "{}", "healthy.pcap"], ["diff", "-o", "json={}", START_UP, START_UP],
           ["annotate", "healthy.pcap", "-o", "{}"], ["slice", "healthy.pcap", "--frames", "1-3", "-o", "{}"],
           ["batch", "-o", "json={}", "healthy.pcap"], ["merge", "-o", "json={}", "made"]]


class FullDisk(CliTest):
    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_program("batch", "--output-dir", "made", "healthy.pcap").returncode, 0)

    @unittest.skipUnless(os.path.exists("/dev/full"), "this system has no /dev/full")
    def test_standard_output(self):
        for arguments in PRINTING:
            with self.subTest(arguments), open("/dev/full", "wb") as full:
                done = self.run_program(*arguments, stdout=full)
                self.assertEqual(done.returncode, 2, done.err)
                self.assertIn("ecaudit: cannot write to standard output: No space left on device\n", done.err)

    @unittest.skipUnless(os.path.exists("/dev/full"), "this system has no /dev/full")
    def test_a_full_device(self):
        for arguments in WRITING:
            with self.subTest(arguments):
                done = self.run_program(*[a.format("/dev/full") for a in arguments])
                self.assertEqual(done.returncode, 2, done.err)
                self.assertIn("ecaudit: cannot write /dev/full: No space left on device\n", done.err)

    def test_a_file_that_cannot_grow_leaves_nothing(self):
        def small_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # write() fails instead
            resource.setrlimit(resource.RLIMIT_FSIZE, (10, 10))

        for arguments in WRITING:
            with self.subTest(arguments):
                before = {path.name for path in self.dir.iterdir()}
                done = self.run_program(*[a.format("out.file") for a in arguments], preexec_fn=small_files)
                self.assertEqual(done.returncode, 2, done.err)
                self.assertRegex(done.err, r"ecaudit: cannot write \S+: File too large\n")
                self.assertEqual({path.name for path in self.dir.iterdir()} - before - {"ecaudit-reports"}, set())
        self.assertEqual(list((self.dir / "ecaudit-reports").glob("*")), [])

    def test_an_old_file_stays(self):
        def small_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (10, 10))

        old = self.file("old.json", "old")
        done = self.run_program("check", "-o", f"json={old}", self.healthy, preexec_fn=small_files)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(open(old).read(), "old")


class ReadersThatLeave(CliTest):
    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_program("batch", "--output-dir", "made", "healthy.pcap").returncode, 0)

    def test_a_closed_pipe_is_quiet(self):
        for arguments in PRINTING:
            with self.subTest(arguments):
                whole = self.run_program(*arguments, stdout=subprocess.DEVNULL)
                read_end, write_end = os.pipe()
                os.close(read_end)
                done = self.run_program(*arguments, stdout=write_end)
                os.close(write_end)
                self.assertEqual(done.returncode, whole.returncode)
                self.assertEqual(done.err, whole.err)

    def test_the_first_line_is_enough(self):
        long = self.file("long.pcap", HEADER + PACKETS * 500)
        for arguments in (["decode", long], ["decode", "--format", "jsonl", long], ["events", long],
                          ["annotate", long, "-o", "-"], ["rules"]):
            with self.subTest(arguments):
                with subprocess.Popen([PROGRAM, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                      cwd=self.dir) as child:
                    self.assertNotEqual(child.stdout.readline(), b"")
                    child.stdout.close()
                    err = child.stderr.read()
                    self.assertEqual((child.wait(60), err), (0, b""))
