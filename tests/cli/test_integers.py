"""Every command over every capture: no number overflows, wraps or loses bits. Where the program is built so that it says so."""
import os
import re
import unittest

from support import SHARED, SOURCE, CliTest

CAPTURES = (".pcap", ".pcapng", ".gz", ".zst")
CHECK = ("check", "-o", "json=report.json", "-o", "html=report.html", "-o", "junit=report.xml", "-o", "sarif=report.sarif",
         "-o", "gitlab=gitlab.json", "-o", "github=github.txt")
# Two forms of one content each: captures take them in turn, and long ones, of which many are of a kind, one of all.
FORMS = ((("decode",), ("decode", "--format", "jsonl")), (("events",), ("events", "--format", "jsonl")),
         (("signals", "--format", "csv"), ("signals", "--format", "jsonl")), (("startup",), ("startup", "--format", "json")))
LONG_BYTES = 1_000_000
# A finding names file, line and what happened; all of them are shown, not the first one only.
GO_ON = {**os.environ, "UBSAN_OPTIONS": "halt_on_error=0:print_stacktrace=0"}


class Integers(CliTest):
    maxDiff = None

    def captures(self):
        folders = [SOURCE / "samples" / "captures", *sorted((SHARED / "captures").glob("*"))]
        return [p for folder in folders if folder.is_dir() for p in sorted(folder.iterdir()) if p.suffix in CAPTURES]

    def test_all_commands_over_all_captures(self):
        captures = self.captures()
        self.assertGreater(len(captures), 80)
        found = {}  # the first of each place
        for turn, capture in enumerate(captures):
            in_turn = [forms[turn // len(FORMS) % 2] for forms in FORMS]
            if capture.stat().st_size > LONG_BYTES:
                in_turn = [in_turn[turn % len(FORMS)]]
            for command in (CHECK, *in_turn):
                done = self.run_program(*command, capture, env=GO_ON)
                for place, what in re.findall(r"(\S+): runtime error: (.*)", done.err):
                    found.setdefault(place, f"{what} ({' '.join(command)} {capture.name})")
                self.assertIn(done.returncode, (0, 1, 2), f"{command} {capture}: {done.err[-2000:]}")
        self.assertEqual(found, {})


if __name__ == "__main__":
    unittest.main()
