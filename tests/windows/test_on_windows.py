"""What differs on Windows: names, ends of lines, consoles, Ctrl-C, files that others have open. Run by tests/portable.sh, under
wine."""
import gzip
import json
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import time
import unittest

from support import PROGRAM, SOURCE, CliTest, healthy_capture, screen
from test_interrupt import sleeps

WINE = os.environ.get("ECAUDIT_WINE", "/usr/lib/wine/wine64")
EXE = os.environ.get("ECAUDIT_EXE", "")
SILENT_PIPE = os.environ.get("ECAUDIT_SILENT_PIPE", "")
SAMPLES = SOURCE / "samples" / "captures"
REFUSED = SAMPLES / "init-to-op-refused.pcapng"
CAUSE = "slave 0: OP requested in INIT: not allowed (#109)"


def on_drive(path) -> str:
    """As Windows spells a path."""
    return "Z:" + str(path).replace("/", "\\")


class WindowsNames(CliTest):
    LETTERS = "Prüfstand 日本 😀"

    def setUp(self):
        super().setUp()
        self.capture = pathlib.Path(self.file(f"{self.LETTERS}/Anlauf größe.pcapng", REFUSED.read_bytes()))

    def test_drive_letters_and_backslashes(self):
        done = self.check("--quiet", on_drive(REFUSED), status=1)
        self.assertEqual(done.out, f"FAIL {on_drive(REFUSED)}: {CAUSE}\n")

    def test_any_letters(self):
        for name in (self.capture, on_drive(self.capture), f"{self.LETTERS}\\Anlauf größe.pcapng"):
            done = self.check("--quiet", name, status=1)
            self.assertEqual(done.out, f"FAIL {name}: {CAUSE}\n")
            self.assertEqual(done.err, "")

    def test_any_letters_in_outputs(self):
        self.check("-o", f"{self.LETTERS}\\Bericht ü.json", "-o", f"{self.LETTERS}\\seite.html", self.capture, status=1)
        report = json.loads((self.capture.parent / "Bericht ü.json").read_text())["reports"][0]
        self.assertIn("Anlauf größe.pcapng", report["capture"]["path"])
        self.assertTrue((self.capture.parent / "seite.html").read_text().startswith("<!doctype html>"))

    def test_wildcards(self):
        # cmd and PowerShell leave them to the program.
        for folder, wild in ((f"{self.LETTERS}\\", "*.PCAPNG"), (f"{on_drive(self.capture.parent)}\\", "Anlauf*"),
                             (f"{self.LETTERS}/", "*.pcapng")):
            self.assertIn(f"FAIL {folder}Anlauf größe.pcapng: {CAUSE}", self.check("--quiet", folder + wild, status=1).out)
        self.assertIn("to check the capture: ecaudit check *.pcap", self.one_error("*.pcap"))
        # Those of an option are its own: here all files and all signals match.
        done = self.run_program("signals", "--signal", "*", SAMPLES / "drive-never-enabled.pcapng")
        self.assertEqual(done.returncode, 0, done.err)
        self.assertEqual(self.one_error("check", "nothing\\*.pcap"), "no such file: nothing\\*.pcap")
        self.assertEqual(self.one_error("batch", "nothing\\*.pcap"), "nothing matches nothing\\*.pcap")

    def test_a_folder(self):
        done = self.run_program("batch", "-o", "junit=summary.xml", on_drive(self.capture.parent))
        self.assertEqual(done.returncode, 1, done.err)
        self.assertIn(CAUSE, done.out)
        self.assertIn("größe", (self.dir / "summary.xml").read_text())
        self.assertEqual(len(list((self.dir / "ecaudit-reports").glob("Anlauf größe.pcapng-*.json"))), 1)

    def test_the_same_file_by_two_names(self):
        other = on_drive(self.healthy).upper()
        self.assertEqual(self.one_error("check", "--join", self.healthy, other),
                         f"{other} is joined twice: --join reads each file once")

    def test_long_paths(self):
        folder = self.dir.joinpath(*["a folder of a long name"] * 15)
        self.assertGreater(len(str(folder)), 300)
        folder.mkdir(parents=True)
        (folder / "trace.pcapng").write_bytes(REFUSED.read_bytes())
        (folder / ".ecaudit.json").write_text('{"fail_on": "never"}')
        for name in (on_drive(folder), str(folder.relative_to(self.dir)).replace("/", "\\")):
            self.check("-o", f"{name}\\report.json", f"{name}\\trace.pcapng", status=0)
            self.assertIn(CAUSE.partition(": ")[2].partition(" (")[0], (folder / "report.json").read_text())
            (folder / "report.json").unlink()
            done = self.run_program("batch", "--output-dir", f"{name}\\new\\reports", name)
            self.assertEqual(done.returncode, 0, done.err)
            self.assertEqual(len(list((folder / "new" / "reports").glob("trace.pcapng-*.json"))), 1)
            shutil.rmtree(folder / "new")
            self.assertIn(CAUSE, self.run_program("check", "--quiet", f"{name}\\*.pcapng").out)

    def test_devices(self):
        self.check("-o", "json=NUL", self.healthy, status=0)
        self.assertEqual(self.one_error("check", "NUL"), "NUL is empty, not a capture")
        self.assertEqual({path.name for path in self.dir.iterdir()}, {"healthy.pcap", "faulty.pcap", self.LETTERS})


class WindowsText(CliTest):
    """Files that an editor of Windows has written: lines end with CR LF, and the file may begin with a mark."""

    def windows_file(self, name, text):
        return self.file(name, "\ufeff" + text.replace("\n", "\r\n"))

    def test_settings(self):
        self.windows_file(".ecaudit.json", '{\n  "fail_on": "never",\n  "limits": {"foe-error": 20}\n}\n')
        self.check(self.faulty, status=0)

    def test_mistakes_in_settings_have_their_line(self):
        self.windows_file(".ecaudit.json", '{\n  "fail_on": "never",\n}\n')
        self.assertRegex(self.one_error("check", self.faulty), r"\.ecaudit\.json:3:1: not valid JSON")

    def test_a_baseline(self):
        self.check("--write-baseline", "known.json", self.faulty, status=1)
        self.windows_file("known.json", (self.dir / "known.json").read_text())
        self.check("--baseline", "known.json", self.faulty, status=0)

    def test_an_expected_start_up(self):
        capture = SAMPLES / "clean-startup.pcapng"
        self.assertEqual(self.run_program("startup", "--save", "good.json", capture).returncode, 0)
        self.windows_file("good.json", (self.dir / "good.json").read_text())
        done = self.run_program("startup", "--expect", "good.json", capture)
        self.assertEqual(done.returncode, 0, done.out + done.err)

    def test_a_drive_family_and_device_files(self):
        done = self.run_program("profiles", "--new", "acme", "-o", "acme.json")
        self.assertEqual(done.returncode, 0, done.err)
        self.windows_file("acme.json", (self.dir / "acme.json").read_text())
        self.check("--profiles", "acme.json", "--profile", "acme", self.healthy, status=0)
        for file in sorted((SOURCE / "samples" / "descriptions").glob("*.xml")):
            text = file.read_bytes().replace(b"\r\n", b"\n").replace(b"\n", b"\r\n")
            self.file(file.name, text)
            option = "--eni" if b"<EtherCATConfig" in text else "--esi"
            same = [self.run_program("check", "--fail-on", "never", option, given, SAMPLES / "clean-startup.pcapng")
                    for given in (file, self.dir / file.name)]
            self.assertEqual(same[0].returncode, 0, same[0].err)
            self.assertEqual(same[0].out, same[1].out)

    def test_output_has_the_same_bytes_as_elsewhere(self):
        for arguments in (["check", "--format", "json"], ["decode", "--format", "csv"], ["signals"]):
            out = subprocess.run([PROGRAM, *arguments, self.healthy], cwd=self.dir, stdout=subprocess.PIPE).stdout
            self.assertNotIn(b"\r", out)


class WindowsConsole(CliTest):
    def on_console(self, *arguments, interrupt_after=None, **environment):
        """Exit status, and what a console shows. Ctrl-C is typed once it shows `interrupt_after`."""
        env = {k: v for k, v in os.environ.items() if k != "NO_COLOR"} | {"TERM": "xterm"} | environment
        child, leader = pty.fork()
        if child == 0:
            os.chdir(self.dir)
            os.execve(WINE, [WINE, EXE, *map(str, arguments)], env)
        out = b""
        try:
            while True:
                if not select.select([leader], [], [], 120)[0]:
                    os.kill(child, signal.SIGKILL)
                    break
                if not (chunk := os.read(leader, 65536)):
                    break
                out += chunk
                if interrupt_after and interrupt_after in screen(out).decode():
                    time.sleep(2)  # until it listens
                    os.write(leader, b"\x03")
                    interrupt_after = None
        except OSError:  # Linux reports the closed end so
            pass
        os.close(leader)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), screen(out).decode()

    def test_no_command(self):
        status, shown = self.on_console()
        self.assertEqual(status, 2)
        self.assertEqual(re.findall(r"^  ecaudit ([a-z]+) ", shown, re.M), ["check", "batch", "explain"])

    def test_colours(self):
        status, shown = self.on_console("check", self.faulty)
        self.assertEqual(status, 1)
        self.assertIn("\x1b[1;31mFAIL\x1b[0m", shown)
        self.assertNotIn("\x1b[1;31m", self.on_console("check", self.faulty, NO_COLOR="1")[1])

    def test_letters(self):
        name = self.file("größe 日本.pcap", healthy_capture())
        self.assertIn("größe 日本.pcap: no findings", self.on_console("check", "--color=never", name)[1])

    def test_interrupted_while_it_waits_for_the_keyboard(self):
        self.file("esi/drive.xml", (SOURCE / "samples" / "descriptions" / "drive.esi.xml").read_bytes())
        self.file("esi/broken.xml", "<broken")
        status, shown = self.on_console("check", "--esi", "esi", "-", interrupt_after="ignored")
        self.assertEqual(status, 130)
        self.assertIn("ecaudit: -: interrupted before its first packet", shown)


@unittest.skipUnless(EXE, "set ECAUDIT_EXE")
class WindowsInterrupt(CliTest):
    """wine makes Ctrl-C of SIGINT, and an exception of SIGSEGV."""

    def ended(self, *arguments, ready, by=signal.SIGINT, which=None, before=()):
        """Exit status and output of a program that gets the signal, or of one whose process `which` gets it."""
        words = [*before, EXE, *arguments] if before else [PROGRAM, *arguments]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
                              cwd=self.dir) as child:
            try:
                self.wait_until(child, ready)
                os.kill(which(child) if which else child.pid, by)
                out, err = child.communicate(timeout=60)
            finally:
                child.kill()
        return child.returncode, out.decode(), err.decode()

    def interrupted(self, *arguments, **options):
        status, out, err = self.ended(*arguments, **options)
        self.assertEqual(status, 130, f"{arguments}\n{err}")
        self.assertIn("interrupted", err)
        return out, err

    def big_captures(self):
        member = gzip.compress(healthy_capture()[24:] * 1000)
        big = self.file("big.pcap.gz", gzip.compress(healthy_capture()[:24]) + member * 70)
        os.link(big, self.dir / "next.pcap.gz")

    def wait_until(self, child, ready):
        until = time.monotonic() + 300
        while not ready(child):
            self.assertIsNone(child.poll(), "it ended too early")
            self.assertLess(time.monotonic(), until)
            time.sleep(0.05)

    @staticmethod
    def worked(process):
        """A second of work: the start of wine takes less."""
        with open(f"/proc/{process}/stat") as stat:
            return int(stat.read().rsplit(")", 1)[1].split()[11]) > os.sysconf("SC_CLK_TCK")

    def reads(self, child):
        return self.worked(child.pid)

    def test_what_was_read_is_reported(self):
        self.big_captures()
        out, err = self.interrupted("check", "-o", "json=report.json", "big.pcap.gz", ready=self.reads)
        self.assertIn("the report covers only the part of the capture that was read", out)
        self.assertRegex(err, r"^ecaudit: big\.pcap\.gz: interrupted after [\d,]+ packets\n$")
        self.assertIs(json.loads((self.dir / "report.json").read_text())["reports"][0]["capture"]["complete"], False)

    def started_by(self, child) -> list:
        """The programs that another one has started here."""
        found = []
        for folder in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                name = folder.joinpath("cmdline").read_text().split("\0")[0]
                if folder.joinpath("cwd").readlink() == self.dir and int(folder.name) != child.pid and \
                        name.endswith(pathlib.Path(EXE).name):
                    found.append(int(folder.name))
            except OSError:  # of a process that has ended
                continue
        return found

    def the_only(self, child) -> int:
        started, = self.started_by(child)
        return started

    @unittest.skipUnless(SILENT_PIPE, "set ECAUDIT_SILENT_PIPE")
    def test_a_pipe_that_falls_silent(self):
        out, err = self.interrupted("check", "-", before=[WINE, SILENT_PIPE, "healthy.pcap"], which=self.the_only,
                                    ready=lambda child: child.stdout.readline() == b"read\r\n")
        self.assertIn("the report covers only the part of the capture that was read", out)
        self.assertEqual(err, "ecaudit: -: interrupted after 46 packets\n")

    def test_a_copy_leaves_nothing(self):
        self.big_captures()
        self.interrupted("annotate", "big.pcap.gz", "-o", "out.pcapng", ready=self.reads)
        self.assertEqual([path.name for path in self.dir.iterdir() if path.name.startswith("out")], [])

    def test_a_batch_stops_its_workers(self):
        self.big_captures()
        # The report of one comes from a worker, which then reads another one.
        reports = self.dir / "ecaudit-reports"
        out, err = self.interrupted("batch", "--jobs", "1", "big.pcap.gz", "next.pcap.gz",
                                    ready=lambda child: any(reports.glob("*.json")))
        self.assertIn("INCOMPLETE", out)
        self.assertIn("interrupted, 1 not checked", err)
        self.assertEqual(len(list(reports.iterdir())), 1)

    def test_a_crash_says_where(self):
        self.big_captures()
        status, out, err = self.ended("check", "big.pcap.gz", ready=self.reads, by=signal.SIGSEGV)
        self.assertEqual((status, out), (3, ""))
        self.assertRegex(err, r"^ecaudit: internal error: ecaudit [\d.]+ was ended by exception 0xc[0-9a-f]{7} at packet \d+; ")

    def test_a_crashed_worker_leaves_the_others_whole(self):
        self.big_captures()
        status, out, err = self.ended("batch", "--jobs", "1", "big.pcap.gz", "faulty.pcap", "healthy.pcap", by=signal.SIGSEGV,
                                      ready=lambda child: any(map(self.worked, self.started_by(child))), which=self.the_only)
        self.assertEqual(status, 3, err)
        self.assertRegex(err, r"big\.pcap\.gz: internal error: ecaudit [\d.]+ (was ended by exception 0xc|ended with)")
        self.assertNotIn("Unhandled exception", out)  # a debugger would stop and wait
        self.assertRegex(out, r"(?m)^  ERROR big\.pcap\.gz")
        self.assertRegex(out, r"(?m)^  FAIL faulty\.pcap")
        self.assertRegex(out, r"(?m)^  PASS healthy\.pcap")


class WindowsPlugin(CliTest):
    def test_the_folders_of_wireshark(self):
        done = self.run_program("wireshark", "--install", self.healthy)
        self.assertEqual(done.returncode, 0, done.err)
        # Wireshark's manual, "Plugin folders" and "Configuration files".
        plugin, = re.findall(r"(?m)^plugin: C:(.*\\AppData\\Roaming\\Wireshark\\plugins\\ecaudit\.lua)$", done.out)
        drive = pathlib.Path(os.environ["WINEPREFIX"]) / "drive_c"
        installed = drive / plugin.replace("\\", "/").lstrip("/")
        self.assertEqual(installed.read_bytes(), (SOURCE / "cli" / "wireshark" / "ecaudit.lua").read_bytes())
        self.assertTrue((installed.parents[1] / "profiles" / "ecaudit" / "preferences").is_file())


class WindowsLocks(CliTest):
    def held(self, name):
        """Another program that has a file open, as a viewer or a recorder has."""
        # In a pipe of its own: it would keep that of this test open.
        child = subprocess.Popen([WINE, "cmd", "/c", f"ping -n 60 127.0.0.1 >> {name}"], cwd=self.dir,
                                 stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(child.wait)
        self.addCleanup(child.kill)
        time.sleep(3)
        self.assertIsNone(child.poll())

    def test_a_report_that_is_open_elsewhere(self):
        self.file("report.html", "old")
        self.held("report.html")
        done = self.run_program("check", "--fail-on", "never", "-o", "report.html", self.faulty)
        self.assertEqual(done.returncode, 2, done.err)
        self.assertEqual(done.err, "ecaudit: cannot write report.html: another program has it open\n")
        self.assertEqual([path.name for path in self.dir.iterdir() if path.name.startswith("report.html")], ["report.html"])

    def test_a_capture_that_is_still_recorded(self):
        self.held("healthy.pcap")
        self.assertIn("PASS", self.check("--quiet", "healthy.pcap", status=0).out)


if __name__ == "__main__":
    unittest.main()
