"""`explain` for what is not a rule: codes, numbers, objects, registers, commands, states."""
import json
import unittest

from support import SOURCE, CliTest


class Explain(CliTest):
    def explain(self, *arguments) -> str:
        done = self.run_program("explain", *arguments)
        self.assertEqual(done.returncode, 0, done.err)
        self.assertEqual(done.err, "")
        return done.out

    def meanings(self, *arguments) -> list:
        answer = json.loads(self.explain(*arguments, "--format", "json"))
        self.assertEqual((answer["schema"], answer["what"]), ("ecaudit.explanation/1", arguments[0]))
        return answer["meanings"]

    def kinds(self, what) -> list:
        return [meaning["kind"] for meaning in self.meanings(what)]

    def test_al_status_code(self):
        page = self.explain("0x0017")
        self.assertTrue(page.startswith("0x0017 invalid sync manager configuration (AL status code)\n"), page)
        # The manual binds the code to two transitions and the standard does not; both name their place.
        self.assertIn("refuses only INIT -> PREOP, PREOP -> SAFEOP", page)
        self.assertIn("[AKD-2011, 4.3.3]", " ".join(page.split()))
        self.assertIn("[ETG1000.6, table 11", " ".join(page.split()))
        self.assertEqual(self.kinds("0x0017")[0], "AL status code")

    def test_a_code_that_a_complete_list_lacks(self):
        rows = [m for m in self.meanings("0x001d") if m["kind"] == "AL status code"][0]["statements"]
        missing = {row["family"] for row in rows if row["text"].startswith("not in its list")}
        self.assertLessEqual({"kollmorgen-akd-2010", "kollmorgen-akd-2011"}, missing)
        self.assertNotIn("standard", missing)

    def test_sdo_abort_code(self):
        self.assertEqual(self.kinds("0x06090011"), ["SDO abort code"])
        self.assertIn("subindex", self.explain("0x06090011").lower())

    def test_every_emergency_of_every_family(self):
        for file in sorted((SOURCE / "decoder/device/profiles").glob("*.json")):
            profile = json.loads(file.read_text())
            for row in (profile.get("emergency") or {}).get("codes", []):
                if "last_code" in row or int(row["code"], 16) < 0x1000:
                    continue
                found = [m for m in self.meanings(row["code"], "--profile", profile["id"])
                         if m["kind"] == "emergency error code"]
                texts = [s["text"] for m in found for s in m["statements"]]
                self.assertTrue(any(row["text"] in text for text in texts), (row, texts))
                if row.get("id"):
                    break  # one run of the program for each of hundreds of codes is enough for one family

    def test_numbers_that_drives_show(self):
        everything = " ".join(self.explain("F503").split())
        self.assertIn("0x3130 F503 (fault): DC bus capacitor overload [MKD, 5.1.2]", everything)
        warning = " ".join(self.explain("n503").split())
        self.assertIn("0x3180 n503 (warning): DC bus capacitor overload [MKD, 5.1.2]", warning)
        self.assertNotIn("fault", warning)
        both = " ".join(self.explain("503").split())
        acme = self.explain("e52", "--profiles", SOURCE / "samples" / "families")
        self.assertIn("encoder: no signal [AS-2024, 9.1]", acme)
        self.assertTrue("F503" in both and "n503" in both, both)

    def test_names_that_only_a_manual_has(self):
        for name, expected in {
            "F28": "without synchronisation sets F28 after a time-out",
            "n17": "warning n17",
            "F17": "printed F17 here",
            "FBUS.PARAM05": "faults reset only by control word bit 7",
            "PARAM05": "faults reset only by control word bit 7",
            "SAMPLEPERIOD": "a multiple of 62500 ns",
            "DRV.NAME": "object 2031h:0",
            "STRINGS.STOSTATUS": "safe torque off of the strings",
        }.items():
            self.assertIn(expected, " ".join(self.explain(name).split()), name)
        self.assertIn("kollmorgen-akd-2011", self.explain("F125"))
        self.assertIn("unknown rule 'FBUS.PARAM99'", self.one_error("explain", "FBUS.PARAM99"))
        self.assertIn("nothing is known of 'F29999'", self.one_error("explain", "F29999"))

    def test_bits_of_objects_and_parameters(self):
        for what, expected in {
            "36E9h": "FBUS.PARAM05 bit 11 = 1: no emergency message for warnings; print says over CANopen [MKD, 3.4]",
            "36E9h=0x800": "bit 11 = 1: no emergency message for warnings",
            "1002h": "bit 15: fault active on MKD-C [MKD, 5.2]",
            "1002h=0x8100": "bit 8 warning active on MKD-C, bit 15 fault active on MKD-C",
            "3000h": "bits 1-15: reserved [MKD, 5.2]",
            "2000h=439": "n439 user following error [MKD, 5.3.3]",
            "2001h=562": "F562 more than 8 MKD-N on string 1 [MKD, 5.2]",
            "606Ch": "in the process data scale 1:1, in the process data unit rpm",
            "2031h": "at most 10 bytes",
        }.items():
            self.assertIn(expected, " ".join(self.explain(what).split()), what)
        self.assertNotIn("0 bits", self.explain("1B03h"))

    def test_names_of_the_manuals(self):
        for name, words in (("F125", ["kollmorgen-akd-2011", "more than 7 missing frames", "AKD-2011, 4.13"]),
                            ("F29", ["pilz-pmcprotego-d", "CLRFAULT", "SERCSET"]),
                            ("F17", ["n17", "PILZ, 4.8"]),
                            ("PTBASE", ["250000 ns", "2 ms = 8"]),
                            ("sercset", ["switch off synchronisation monitoring"]),
                            ("FBUS.PARAM02", ["internal PLL off", "36E6h"]),
                            ("DRV.NVSAVE", ["FBUS.PARAM03"])):
            with self.subTest(name=name):
                output = " ".join(self.explain(name).split())
                for word in words:
                    self.assertIn(word, output)

    def test_words_of_sentences_are_no_names(self):
        for word in ("the", "zzz", "motor", "fault", "enable", "with"):
            self.one_error("explain", word)

    def test_warning_has_the_moments_of_its_manual(self):
        page = " ".join(self.explain("n17").split())
        self.assertIn("warning n17 appears because there is no cyclic interrupt yet", page)
        self.assertNotIn("consecutive cycle", page)

    def test_rows_left_out_are_counted(self):
        for meaning in self.meanings("FBUS.PARAM05"):
            rows = [row for row in meaning["statements"] if row["family"] == "kollmorgen-mkd-n"]
            self.assertTrue(len(rows) <= 60 or rows[-1]["text"].endswith("more rows"), rows)

    def test_objects_have_the_name_of_a_dictionary(self):
        self.assertIn("3496h:1 fieldbus synchronisation", " ".join(self.explain("3496h:1").split()).lower())
        self.assertNotIn("object of a sister family) (object)", self.explain("36E6h"))

    def test_bits_of_the_words_of_a_drive(self):
        for name, words in (("6040h", ["mode 6 (Homing (hm)): bit 4 homing_operation_start", "rising edge of bit 12",
                                       "command Quick stop: bit 2 = 0, bit 1 = 1; transitions 7, 10, 11"]),
                            ("6060h", ["DRV.OPMODE 2, DRV.CMDSOURCE 0"]),
                            ("20A4h", ["enable external latch 2 falling"]),
                            ("20A5h", ["state of digital input 4"]),
                            ("60C2h", ["60C2h Interpolation time period", "exponent, -3 = ms"]),
                            ("1704h", ["appears in an example only"])):
            with self.subTest(name=name):
                output = " ".join(self.explain(name).split())
                for word in words:
                    self.assertIn(word, output)
                self.assertNotIn("see the mode bits", output)

    def test_objects_by_family(self):
        for what in ("6040h", "0x6040:0", "0x6040"):
            found = [m for m in self.meanings(what) if m["kind"] == "object"]
            self.assertEqual(len(found), 1, what)
            rows = found[0]["statements"]
            self.assertLessEqual({"standard", "kollmorgen-mkd-n", "pilz-pmcprotego-d"}, {r["family"] for r in rows})
            self.assertTrue(any(r["text"].startswith("bit 3: ") for r in rows), rows)
        self.assertEqual(len(self.meanings("1018h:1")), 1)
        self.assertIn("Identity", self.meanings("1018h:1")[0]["name"])
        self.assertIn("RxPDO mapping", self.explain("1601h"))

    def test_registers_with_bits(self):
        page = " ".join(self.explain("0x0130").split())
        self.assertIn("0x0130 AL Status (register)", page)
        self.assertIn("0x0130-0x0131, 2 bytes", page)
        self.assertIn("bits 4:0", page)
        self.assertIn("[ESC-2, page ", page)
        self.assertIn("asked for byte 1", self.explain("0x0131"))
        unit = self.explain("0x0810")
        self.assertIn("SM2 Start", unit)
        self.assertIn("SM2 Length", unit)

    def test_commands_and_states(self):
        for command in ("NOP APRD APWR APRW FPRD FPWR FPRW BRD BWR BRW LRD LWR LRW ARMW FRMW").split():
            self.assertEqual(self.kinds(command), ["datagram command"], command)
        self.assertEqual(self.kinds("fprd"), ["datagram command"])
        for state in ("INIT", "PREOP", "BOOT", "SAFEOP", "OP"):
            self.assertEqual(self.kinds(state)[0], "AL state", state)

    def test_every_statement_names_its_source(self):
        for what in ("0x0017", "0x06090011", "0x8611", "F503", "6040h", "6041h", "1018h", "0x0120", "0x0810", "LRW"):
            for meaning in self.meanings(what):
                for row in meaning["statements"]:
                    self.assertTrue(row["source"] or row["note"], (what, row))

    def test_one_family_only(self):
        families = {row["family"] for m in self.meanings("0x0017", "--profile", "kollmorgen-akd-2011")
                    for row in m["statements"]}
        self.assertEqual(families, {"standard", "kollmorgen-akd-2011"})
        self.assertIn("unknown profile 'foo'", self.one_error("explain", "0x0017", "--profile", "foo"))

    def test_codes_without_a_mark(self):
        # AL status code 27 in decimal is 0x001b; masters print it in both forms.
        names = [m["name"] for m in self.meanings("27") if m["kind"] == "AL status code"]
        self.assertEqual([name.split()[0] for name in names], ["0x001b", "0x0027"])
        self.assertEqual(self.kinds("6041")[0], "object")
        self.assertEqual([m["kind"] for m in self.meanings("1C12:1")], ["object"])
        self.assertEqual(self.meanings("1c12:1")[0]["name"], self.meanings("1C12h:1")[0]["name"])
        self.assertIn("emergency error code", self.kinds("8611"))
        self.assertIn("register", self.kinds("0130"))

    def test_usual_causes_of_a_status_code(self):
        page = " ".join(self.explain("0x001b").split())
        self.assertIn("usual causes no process data within the watchdog time", page)
        self.assertNotIn("usual causes", self.explain("0x0002"))

    def test_a_state_with_its_error_bit(self):
        page = " ".join(self.explain("SAFEOP+ERR").split())
        self.assertIn("0x14 in bits 3:0", page)
        self.assertIn("AL Status Code 0x0134 has the reason", page)
        self.assertNotIn("has the reason", " ".join(self.explain("SAFEOP").split()))

    def test_values_of_objects(self):
        for what in ("6041h=0x1237", "6041=0x1237", "0x6041=4663"):
            first = self.meanings(what)[0]
            self.assertEqual((first["kind"], first["name"]), ("value of an object", "6041h = 0x1237"))
            text = next(s["text"] for s in first["statements"] if s["family"] == "standard")
            self.assertTrue(text.startswith("Operation enabled; bits set: 0 Ready to switch on, 1 "), text)
        self.assertIn("bits set: ", self.explain("6040h=0x000f"))
        modes = self.meanings("6060h=8")[0]["statements"]
        self.assertIn("ynchronous position", modes[0]["text"])
        self.assertIn("following error", self.explain("603Fh=0x8611"))
        self.assertIn("none of its modes", self.explain("6061h=77"))
        for wrong in ("6041h=", "6041h=0x", "=5", "what=5"):
            self.one_error("explain", wrong)

    def test_error_codes_of_drives_one_by_one(self):
        self.assertIn("DC link overvoltage", self.explain("0x3210", "--profile", "generic"))
        self.assertIn("motor blocked", self.explain("0x7121", "--profile", "generic"))

    def test_every_rung_has_its_page(self):
        schema = json.loads((SOURCE / "cli" / "report" / "ecaudit-report-1.schema.json").read_text())
        rungs = schema["$defs"]["rung"]["properties"]["rung"]["enum"]
        rules = {rule["id"] for rule in json.loads(self.run_program("rules", "--format", "json").out)["rules"]}
        for rung in rungs:
            page = next(m for m in self.meanings(rung) if m["kind"].startswith("rung of"))
            named = {row["label"]: row["text"] for row in page["details"]}
            self.assertLessEqual(set(named["rules"].split(", ")), rules, rung)
            self.assertTrue(named["reached"] and named["held by"] and named["look at"], rung)

    def test_questions_lead_through_the_rungs(self):
        page = " ".join(self.explain("axis does not move").split())
        for part in ("Progress", "drive-not-enabled", "bit 2 is active at 0", "drive-not-commanded"):
            self.assertIn(part, page)
        self.assertEqual(self.explain("Drive does not move").split(), self.explain("axis does not move").split())
        order = [row["label"] for row in self.meanings("does not reach OP")[0]["details"]]
        self.assertEqual(order[1:], ["answers", "known", "preop", "mailbox", "configured", "safeop", "exchange", "op"])
        self.assertIn("--around", self.explain("drops out of OP"))
        self.assertIn("(did you mean 'axis does not move'?)", self.one_error("explain", "axis does not mvoe"))

    def test_what_nobody_knows(self):
        for what in ("0x0f0f0f0f", "F99999", "5fffh"):
            self.assertEqual(self.one_error("explain", what),
                             f"nothing is known of '{what}' (see 'ecaudit explain --help')")
        for what in ("", ":", "0x", "h", "6040h:", "6040h:999", "F", "0x123456789"):
            self.one_error("explain", what)


if __name__ == "__main__":
    unittest.main()
