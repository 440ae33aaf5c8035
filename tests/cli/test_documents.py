"""The documents name what the program writes."""
import json
import re
import shlex
import shutil
import subprocess
import unittest

from support import PROGRAM, SCHEMA, SOURCE, CliTest


def fields(node, path, found):
    """All fields of a schema by their paths; `found` gets (path, node)."""
    for key, value in node.get("properties", {}).items():
        found.append((path + key, value))
        inner = value.get("items", value) if "items" in value else value
        step = path + key + ("[]." if "items" in value else ".")
        for part in [inner, *inner.get("oneOf", []), *inner.get("anyOf", [])]:
            if "properties" in part:
                fields(part, step, found)
            elif "items" in part:
                fields(part["items"], path + key + "[].", found)
    return found


# Rows of the table of limits in docs/SECURITY.md: their first words, and where each of their numbers stands.
LIMITS = {
    "slaves that are modelled": [("decoder/bus/slave_set.h", "kMaxSlaves")],
    "findings of one rule, slave": [("analyzers/judge/finding_store.h", "kMaxPerRuleAndSlave")],
    "findings of one severity": [("analyzers/judge/finding_store.h", "kMaxFindings"),
                                 ("analyzers/judge/finding_store.h", "kMaxWithFirstOnes")],
    "lines about what could not": [("analyzers/judge/finding_store.h", "kMaxListed")],
    "different reasons of one rule": [("analyzers/judge/finding_store.h", "kMaxReasons")],
    "steps of a start-up": [("analyzers/collect/startup_recorder.h", "kMaxSteps"),
                            ("analyzers/collect/startup_recorder.h", "kMaxAllSteps"),
                            ("analyzers/collect/startup_recorder.h", "kAtOnce"),
                            ("analyzers/collect/startup_recorder.h", "kBytesAStep")],
    "steps of an AL history": [("analyzers/collect/al_history.h", "kMaxSteps"),
                               ("analyzers/collect/al_history.h", "kOwnSteps"),
                               ("analyzers/collect/al_history.h", "kMaxAllSteps"),
                               ("analyzers/collect/al_history.h", "kAtOnce"),
                               ("analyzers/collect/al_history.h", "kBytesAStep")],
    "steps of a drive history": [("analyzers/collect/drive_history.h", "kMaxSteps"),
                                 ("analyzers/collect/drive_history.h", "kMaxAllSteps")],
    "writes to the distributed clock": [("analyzers/sync/dc_unit.h", "kMaxSteps"),
                                        ("analyzers/sync/dc_unit.h", "kMaxBroadcasts")],
    "settings of sync managers and FMMUs": [("analyzers/judge/crowded_lists.h", "kUnits"),
                                            ("analyzers/judge/crowded_lists.h", "kBytesAUnit")],
    "writes to distributed clocks": [("analyzers/judge/crowded_lists.h", "kDcSteps"),
                                     ("analyzers/judge/crowded_lists.h", "kBytesADcStep")],
    "distributed clocks that only": [("analyzers/judge/crowded_lists.h", "kDcByBroadcast"),
                                    ("analyzers/judge/crowded_lists.h", "kBytesADc")],
    "slaves that receive broadcasts": [("decoder/track/slave_work.h", "kAtOnce")],
    "lines of `events`": [("cli/stream/event_output.h", "kRoom"), ("cli/stream/event_output.h", "kTimesInput")],
    "incomplete mailbox messages": [("decoder/track/mailbox_tracker.h", "kBoxBytes"),
                               ("decoder/track/slave_mailboxes.h", "kMessageBytes")],
    "object values": [("analyzers/model/object_values.h", "kMaxObjects")],
    "a transfer's data": [("decoder/mailbox/sdo_transfer.h", "kMaxStoredBytes")],
    "signals of process data": [("analyzers/model/process_data.h", "kMaxSignals")],
    "masters that are distinguished": [("decoder/bus/direction.h", "kMaxMasters")],
    "packets compared for their return": [("decoder/bus/sent_frames.h", "kSlots")],
    "packet comments": [("decoder/capture/pcapng_source.cpp", "kMaxComments"),
                        ("decoder/capture/pcapng_source.cpp", "kMaxCommentBytes")],
    "interfaces of a file": [("decoder/capture/pcapng_source.cpp", "kMaxInterfaces")],
    "axes of which the report": [("analyzers/progress/progress_model.h", "kMostAxes")],
    "interfaces with EtherCAT frames": [("decoder/bus/interface_groups.h", "kMost")],
    "names of all interfaces": [("decoder/capture/frame_source.h", "kNameBytes")],
    "a packet of a pcap file": [("decoder/capture/pcap_source.cpp", "kMaxPacketBytes")],
    "a pcapng block": [("decoder/capture/pcapng_block.h", "kMaxReadBlockBytes"),
                       ("decoder/capture/pcapng_block.h", "kMaxBlockBytes")],
    "settings, baseline": [("cli/json_file.h", "kLargestWritten")],
    "report for `merge`": [("cli/json_file.h", "kLargestReport")],
    "ESI, ENI": [("decoder/device/xml_cursor.h", "kMaxXmlBytes"), ("decoder/device/esi_reader.cpp", "kMaxEsiRows"),
                 ("decoder/device/xml_cursor.h", "kMaxXmlAttributes"),
                 ("decoder/device/esi_reader.cpp", "kMaxInitCommands")],
    "names and comments": [("decoder/device/xml_cursor.h", "kMaxXmlLabel")],
    "window of a zstd file": [("decoder/capture/decompress.cpp", "kZstdWindowBytes")],
}


def constant(file: str, name: str) -> int:
    """The value of a constant in the sources: products and shifts of numbers."""
    text = (SOURCE / file).read_text()
    (value,) = re.findall(rf"constexpr [\w:]+ {name}\s*=\s*([^;]+);", text)
    value = re.sub(r"std::\w+\{(\d+)\}", r"\1", value).replace("'", "")
    value = re.sub(r"(\d)[UL]+", r"\1", value)
    if not re.fullmatch(r"[\d\s*<]+", value):
        raise ValueError(value)
    return eval(" ".join(value.split()))  # digits, * and << only


def numbers(text: str) -> list:
    """1,000 is 1000, 16 MiB is 16 << 20."""
    units = {"KiB": 10, "MiB": 20, "GiB": 30}
    return [int(number.replace(",", "")) << units.get(unit, 0)
            for number, unit in re.findall(r"(\d[\d,]*\d|\d)(?: (KiB|MiB|GiB))?", text)]


class Limits(unittest.TestCase):
    def test_the_table_of_limits_has_those_of_the_code(self):
        table = (SOURCE / "docs" / "SECURITY.md").read_text().split("\n## Limits\n")[1].split("\n## ")[0]
        rows = [[cell.strip() for cell in line.strip("|").split("|")]
                for line in table.splitlines() if line.startswith("| ") and not line.startswith("| what")]
        left = dict(LIMITS)
        for row in rows:
            with self.subTest(row[0]):
                key = next((k for k in left if row[0].startswith(k)), None)
                self.assertIsNotNone(key, "add it to LIMITS above")
                shown = numbers(" ".join(row))
                for file, name in left.pop(key):
                    self.assertIn(constant(file, name), shown, f"{name} in {file}")
        self.assertEqual(left, {}, "no longer in the table")


class Documents(unittest.TestCase):
    def test_every_field_of_the_report_is_described(self):
        schema = json.loads(SCHEMA.read_text())
        page = (SOURCE / "docs" / "report.md").read_text().split("\n## Values of a finding\n")[0]
        named = set(re.findall(r"^\| `([^`]+)` \|", page, re.M))
        wanted = [path for path, _ in fields(schema, "", [])]
        for name, definition in schema["$defs"].items():
            wanted += [path for path, _ in fields(definition, "", [])]
        self.assertGreater(len(wanted), 400)
        missing = sorted(set(wanted) - named)
        self.assertEqual(missing, [], "docs/report.md lacks rows: | `FIELD` | type, unit | meaning |")
        self.assertEqual(sorted(named - set(wanted)), [], "docs/report.md has rows of fields that are gone")

    def test_links_lead_somewhere(self):
        pages = [SOURCE / "README.md", *sorted((SOURCE / "docs").glob("*.md")), SOURCE / "cli" / "README.md",
                 SOURCE / "tests" / "README.md", SOURCE / "samples" / "descriptions" / "README.md"]
        for page in pages:
            for target in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
                if "://" not in target:
                    self.assertTrue((page.parent / target).exists(), f"{page.name}: {target}")

    def test_the_guide_to_changes_names_this_version(self):
        version = re.search(r"project\(ecaudit VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
        self.assertIn(f"## {version}", (SOURCE / "docs" / "CHANGELOG.md").read_text())


def examples(page):
    """The commands that the page shows behind "$ ", each with the lines under it."""
    found = []
    for block in re.findall(r"^```\n(\$ .*?)^```$", page.read_text(), re.M | re.S):
        for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
            command, *lines = part.rstrip("\n").split("\n")
            found.append((command, lines))
    return found


def missing_line(wanted, output):
    """The first line of an example that the output lacks. "..." stands for any lines, and for the end of a line."""
    at, gap = 0, False
    for line in wanted:
        if line.strip() == "...":
            gap = True
            continue

        def fits(actual, line=line):
            return actual.startswith(line[:-3]) if line.endswith("...") else actual == line

        while gap and at < len(output) and not fits(output[at]):
            at += 1
        if at == len(output) or not fits(output[at]):
            return line
        at, gap = at + 1, False
    return None if gap or at == len(output) else f"(no further line, but: {output[at]})"


class Examples(CliTest):
    """What a page shows is what the program writes."""
    FILES = {"samples": SOURCE / "samples", "acme-servo.json": SOURCE / "samples" / "families" / "acme-servo.json"}
    ANY_CAPTURE = "trace.pcapng"  # stands for one of the reader
    MISTAKEN = "--check"  # shows a file with mistakes that is not there

    def test_the_comparison(self):
        self.assertIsNone(missing_line(["a", "...", "c ..."], ["a", "b", "c d"]))
        self.assertIsNone(missing_line(["a", "..."], ["a", "b"]))
        self.assertEqual(missing_line(["a", "c"], ["a", "b", "c"]), "c")
        self.assertEqual(missing_line(["a", "...", "d"], ["a", "b", "c"]), "d")
        self.assertIn("b", missing_line(["a"], ["a", "b"]))

    def test_examples(self):
        for name, target in self.FILES.items():
            (self.dir / name).symlink_to(target)
        run = 0
        for page in [SOURCE / "README.md", *sorted((SOURCE / "docs").glob("*.md"))]:
            for command, lines in examples(page):
                program, *arguments = shlex.split(command)
                if {self.ANY_CAPTURE, self.MISTAKEN} & set(arguments) or (program != "ecaudit" and shutil.which(program) is None):
                    continue
                with self.subTest(page=page.name, command=command):
                    own = program == "ecaudit"
                    done = subprocess.run([PROGRAM if own else program, *arguments], cwd=self.dir,
                                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                          stderr=subprocess.STDOUT if own else subprocess.DEVNULL, timeout=120)
                    output = [line.rstrip() for line in done.stdout.decode().rstrip().split("\n")]
                    self.assertNotIn(done.returncode, (2, 3))
                    wanted = [line.rstrip() for line in lines] or ["..."]
                    self.assertIsNone(missing_line(wanted, output), "\n".join(output))
                    run += 1
        self.assertGreater(run, 8)


if __name__ == "__main__":
    unittest.main()
