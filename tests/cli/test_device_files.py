"""--esi and --eni: what they change, and what is said when a file cannot be used. All files here are our own."""
import re
import unittest

from support import FPRD, FPWR, SOURCE, CliTest, scanned_bus

SAMPLES = SOURCE / "samples" / "captures"

ESI = """<?xml version="1.0"?>
<EtherCATInfo>
  <Vendor><Id>#x6A</Id><Name>Example</Name></Vendor>
  <Descriptions><Devices><Device>
    <Type ProductCode="#x00414B44" RevisionNo="#x2">AKD</Type>
    <Name>Drive \u009b31m of the test</Name>
  </Device></Devices></Descriptions>
</EtherCATInfo>
"""

TEXTS = """<Profile><DiagMessages><DiagMessage><TextId>#x3702</TextId>
  <MessageText LcId="1033">Short circuit in module %d</MessageText></DiagMessage></DiagMessages></Profile>"""

MAILBOXES = bytes.fromhex("0018800026000100 001c800022000100")

ENI = """<?xml version="1.0"?>
<EtherCATConfig><Config>
  <Slave><Info>
    <Name>Axis X</Name><PhysAddr>4097</PhysAddr><AutoIncAddr>0</AutoIncAddr>
    <VendorId>{vendor}</VendorId><ProductCode>4279108</ProductCode><RevisionNo>2</RevisionNo>
  </Info></Slave>
</Config></EtherCATConfig>
"""


class DeviceFileOptions(CliTest):
    def setUp(self):
        super().setUp()
        self.capture = SAMPLES / "clean-startup.pcapng"

    def slave(self, *arguments):
        return self.report(*arguments, status=0)["reports"][0]["slaves"][0]

    def test_esi_is_named_beside_the_family(self):
        slave = self.slave(self.capture, "--esi", self.file("drive.xml", ESI))
        self.assertTrue(slave["profile"].startswith("kollmorgen-akd-"), slave)
        self.assertTrue(slave["profile_source"].endswith(", with drive.xml"), slave["profile_source"])

    def test_esi_may_be_repeated(self):
        other = self.file("other.xml", ESI.replace("#x6A", "#x6B"))
        slave = self.slave(self.capture, "--esi", other, "--esi", self.file("drive.xml", ESI))
        self.assertTrue(slave["profile_source"].endswith(", with drive.xml"), slave["profile_source"])

    def test_a_folder_of_esi_files(self):
        self.file("esi/a-drive.xml", ESI)
        self.file("esi/B-OTHER.XML", ESI.replace("#x6A", "#x6B"))
        self.file("esi/network.xml", ENI.format(vendor=106))
        self.file("esi/broken.xml", "<EtherCATInfo><Vendor>")
        self.file("esi/notes.txt", "no XML")
        done = self.check(self.capture, "--esi", self.dir / "esi", "--format", "json", status=0)
        self.assertEqual(done.err.count("warning: ignored: "), 2, done.err)
        for name in ("network.xml", "broken.xml"):
            self.assertRegex(done.err, rf"esi[/\\]{re.escape(name)}: ")
        self.assertIn(", with a-drive.xml", done.out)
        # As with the file alone; and every command that judges says what it left out, once.
        alone = self.report(self.capture, "--esi", self.dir / "esi" / "a-drive.xml", status=0)["reports"][0]["slaves"]
        self.assertEqual(self.report(self.capture, "--esi", self.dir / "esi", status=0)["reports"][0]["slaves"], alone)
        for command in (["events"], ["batch"], ["check", self.healthy]):
            done = self.run_program(*command, "--esi", self.dir / "esi", self.capture)
            self.assertEqual(done.err.count("ignored: "), 2, (command, done.err))
        self.file("none/notes.txt", "")
        self.assertIn("none of its 0 XML files describes a device",
                      self.one_error("check", "--esi", self.dir / "none", self.capture))

    def test_esi_has_the_text_of_a_diagnosis_message(self):
        bus = scanned_bus()
        bus.exchange(FPWR, 0x1001, 0x0800, MAILBOXES, MAILBOXES, 1)
        request = bytes.fromhex("0a000000001300 2040f3100600000000").ljust(128, b"\0")
        answer = bytes.fromhex("1d000000001300 3041f3100613000000 00e81042 0201 0237" + 8 * "00" + "0500 02").ljust(128, b"\0")
        bus.exchange(FPWR, 0x1001, 0x1800, request, request, 1)
        bus.exchange(FPRD, 0x1001, 0x1C00, bytes(128), answer, 1)
        capture = self.file("history.pcap", bus.pcap())
        esi = self.file("texts.xml", ESI.replace("</Device>", TEXTS + "</Device>"))
        for command in ("decode", "events"):
            self.assertIn("error: Short circuit in module 2 (text ID 0x3702)",
                          self.run_program(command, "--esi", esi, capture).out)
            self.assertIn("text ID 0x3702, parameter 2", self.run_program(command, capture).out)

    def test_eni_names_the_slave(self):
        slave = self.slave(self.capture, "--eni", self.file("network.xml", ENI.format(vendor=106)))
        self.assertEqual(slave["name"], "Axis X")
        self.assertNotIn("expects another", slave["profile_source"])

    def test_eni_gives_the_identity_where_the_capture_does_not(self):
        slave = self.slave(self.healthy, "--eni", self.file("network.xml", ENI.format(vendor=106)))
        self.assertTrue(slave["profile"].startswith("kollmorgen-akd-"), slave)
        self.assertEqual(slave["identity"]["vendor_id"], 0x6A)
        self.assertIsNone(slave["identity"]["frame"])
        self.assertTrue(slave["profile_source"].startswith("identity in the ENI"), slave["profile_source"])

    def test_slaves_of_the_eni_are_met_where_only_process_data_show_them(self):
        """Nothing but process data: whose they are the ENI says, and that they are theirs the working counter."""
        eni = SOURCE / "samples" / "descriptions" / "two-axes.eni.xml"
        healthy = self.report(SAMPLES / "mid-run.pcapng", "--eni", eni, status=0)["reports"][0]
        self.assertEqual([(s["name"], s["station_address"]) for s in healthy["slaves"]],
                         [("Axis X", 0x1001), ("Axis Y", 0x1002)])
        self.assertEqual(healthy["findings"], [])
        fault = self.report(SAMPLES / "mid-run-in-fault.pcapng", "--eni", eni, status=1)["reports"][0]
        self.assertEqual([(f["rule"], f["slave"], f["confidence"]) for f in fault["findings"]],
                         [("drive-fault", 0, "inferred"), ("drive-fault", 1, "inferred")])
        self.assertEqual(self.report(SAMPLES / "mid-run-in-fault.pcapng", status=0)["reports"][0]["slaves"], [])

    def test_named_in_the_configuration_file_relative_to_it(self):
        self.file("machine/files/drive.xml", ESI)
        self.file("machine/network.xml", ENI.format(vendor=106))
        self.file("machine/run/trace.pcapng", self.capture.read_bytes())
        for esi in ('"files/drive.xml"', '["files/drive.xml"]'):
            self.file("machine/.ecaudit.json", '{"esi": %s, "eni": "network.xml"}' % esi)
            slave = self.slave("machine/run/trace.pcapng")
            self.assertTrue(slave["profile_source"].endswith(", with drive.xml"), slave["profile_source"])
            self.assertEqual(slave["name"], "Axis X")

    def test_typed_files_take_the_place_of_configured_ones(self):
        self.file("c.json", '{"esi": "missing.xml", "eni": "missing.xml"}')
        self.assertIn("missing.xml", self.one_error("check", "--config", "c.json", self.capture))
        esi, eni = self.file("drive.xml", ESI), self.file("network.xml", ENI.format(vendor=106))
        self.assertEqual(self.slave("--config", "c.json", "--esi", esi, "--eni", eni, self.capture)["name"], "Axis X")

    def test_mistakes_in_the_configuration_file(self):
        for content, message in (('{"esi": 3}', "'esi' must be a file name or a list of them"),
                                 ('{"esi": [3]}', "'esi' must be a file name or a list of them"),
                                 ('{"eni": []}', "'eni' must be a string")):
            self.assertIn(message, self.one_error("check", "--config", self.file("c.json", content), self.capture))

    def test_eni_does_not_beat_the_capture(self):
        slave = self.slave(self.capture, "--eni", self.file("network.xml", ENI.format(vendor=2)))
        self.assertNotEqual(slave["name"], "Axis X")
        self.assertEqual(slave["identity"]["vendor_id"], 0x6A)
        self.assertIn("network.xml expects another device here (vendor 0x00000002", slave["profile_source"])

    def test_events_know_the_names_of_the_esi(self):
        objects = """<Profile><Dictionary><DataTypes><DataType><Name>DT1C12</Name><BitSize>48</BitSize>
              <SubItem><SubIdx>0</SubIdx><Name>Count</Name><Type>USINT</Type><BitSize>8</BitSize></SubItem>
              <SubItem><SubIdx>1</SubIdx><Name>First</Name><Type>UINT</Type><BitSize>16</BitSize></SubItem>
            </DataType></DataTypes>
            <Objects><Object><Index>#x1C12</Index><Name>Assigned by the test</Name><Type>DT1C12</Type><BitSize>48</BitSize>
            </Object></Objects></Dictionary></Profile>"""
        esi = self.file("drive.xml", ESI.replace("</Device>", objects + "</Device>"))
        done = self.run_program("events", "--type", "sdo", self.capture, "--esi", esi)
        self.assertEqual(done.returncode, 0, done.err)
        self.assertIn("1C12h:1 Assigned by the test: First = 1701h", done.out)

    def test_control_characters_of_a_file_do_not_reach_the_terminal(self):
        done = self.check(self.healthy, "--esi", self.file("drive.xml", ESI), "--eni",
                          self.file("network.xml", ENI.format(vendor=106).replace("Axis X", "A\u009b31mB")), status=0)
        self.assertNotIn("\u009b", done.out)
        self.assertIn("A\\xc2\\x9b31mB", done.out)

    def test_bad_files_are_one_line_with_the_place(self):
        broken = self.file("broken.xml", ESI.replace("</Vendor>", "</Vend>"))
        self.assertRegex(self.one_error("check", self.capture, "--esi", broken),
                         r"^\S*broken\.xml: line 3, column \d+: .+")
        number = self.file("number.xml", ENI.format(vendor="many"))
        self.assertRegex(self.one_error("decode", self.capture, "--eni", number),
                         r'^\S*number\.xml: line 5, column \d+: "many" is not a number')
        swapped = self.file("swapped.xml", ENI.format(vendor=1))
        self.assertRegex(self.one_error("events", self.capture, "--esi", swapped),
                         r"^\S*swapped\.xml: line 2, column \d+: expected the element EtherCATInfo, got EtherCATConfig")
        self.assertEqual(self.one_error("check", self.capture, "--eni", "nowhere.xml"), "nowhere.xml: no such file")
        self.assertIn("expected the element", self.one_error("check", self.capture, "--eni", self.file("e.xml", ESI)))

    def test_files_without_content(self):
        empty = self.file("empty.xml", "<EtherCATInfo><Vendor><Id>1</Id></Vendor></EtherCATInfo>")
        self.assertRegex(self.one_error("check", self.capture, "--esi", empty), "empty.xml: describes no device$")
        none = self.file("none.xml", "<EtherCATConfig><Config/></EtherCATConfig>")
        self.assertRegex(self.one_error("check", self.capture, "--eni", none), "none.xml: describes no slave$")


if __name__ == "__main__":
    unittest.main()
