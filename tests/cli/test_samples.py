"""The committed samples against what their builder says a correct report holds (samples/captures/expected.json)."""
import json
import subprocess
import unittest

from support import PROGRAM, SOURCE

CAPTURES = SOURCE / "samples" / "captures"
EXPECTED = json.loads((CAPTURES / "expected.json").read_text())


def catalogue():
    out = subprocess.run([PROGRAM, "rules", "--format", "json"], capture_output=True, text=True, check=True).stdout
    return {rule["id"] for rule in json.loads(out)["rules"]}


def report(name):
    run = subprocess.run([PROGRAM, "check", "--format", "json", str(CAPTURES / name)], capture_output=True, text=True)
    if run.returncode > 1:
        raise AssertionError(f"{name}: exit {run.returncode}: {run.stderr}")
    return json.loads(run.stdout)["reports"][0]


class Samples(unittest.TestCase):
    """One expectation a sample: each finding once, at one of its frames, with its number of repetitions; no other."""

    def test_each_sample_gives_what_its_builder_expects(self):
        rules = catalogue()
        for name, expected in EXPECTED.items():
            with self.subTest(sample=name):
                self.check(name, expected, rules)

    def check(self, name, expected, rules):
        found = report(name)
        self.assertEqual(found["capture"]["packets"], expected["packets"])
        left = list(found["findings"])
        for wanted in expected["findings"]:
            self.assertIn(wanted["rule"], rules, "not a rule of the catalogue")
            match = [f for f in left if f["rule"] == wanted["rule"] and f["slave"] == wanted.get("slave")
                     and self.first(wanted) <= f["frame"] <= self.last(wanted)]
            if not match and wanted.get("optional"):
                continue
            self.assertTrue(match, f"{wanted} is missing; there is {[(f['rule'], f['slave'], f['frame']) for f in left]}")
            if "count" in wanted:
                self.assertEqual(match[0]["count"], wanted["count"], wanted)
            left.remove(match[0])
        # A consequence that names its cause does not stand alone.
        surplus = [(f["rule"], f["slave"], f["frame"], f["title"]) for f in left
                   if f["severity"] != "info" and f["caused_by"] is None]
        self.assertEqual(surplus, [], "findings that the sample does not hold")

    @staticmethod
    def first(wanted):
        return wanted.get("sent", wanted.get("returned", 0))

    @staticmethod
    def last(wanted):
        return wanted.get("until", wanted.get("returned", wanted.get("sent", 1 << 62)))

    def test_every_sample_has_an_expectation(self):
        captures = {p.name for p in CAPTURES.iterdir() if p.suffix in (".pcap", ".pcapng")}
        self.assertEqual(captures, set(EXPECTED))


if __name__ == "__main__":
    unittest.main()
