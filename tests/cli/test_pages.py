"""Man pages and completions say what --help says."""
import re
import shutil
import subprocess
import unittest

from support import CliTest


class Pages(CliTest):
    def commands(self) -> list:
        return re.findall(r"^  ([a-z]+)[ A-Z\[\].]*   ", self.run_program("--help").out, re.M)

    def options_of(self, command) -> set:
        return set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", re.sub(r"(?m)^ {20,}.*$", "", self.run_program(
            command, "--help").out.split("\n\n", 2)[-1])))

    def page(self, *arguments) -> str:
        done = self.run_program("completion", *arguments)
        self.assertEqual((done.returncode, done.err), (0, ""))
        return done.out

    def test_every_command_and_option_stands_in_all_of_them(self):
        scripts = {shell: self.page(shell) for shell in ("bash", "zsh", "fish")}
        overview = self.page("man")
        for command in self.commands():
            self.assertIn(f"ecaudit\\-{command}\\fR(1)", overview)
            man = self.page("man", "--command", command).replace("\\-", "-")
            for script in scripts.values():
                self.assertIn(command, script)
            for option in sorted(self.options_of(command) - {"--help"}):
                self.assertIn(option, scripts["bash"], command)
                self.assertIn(option, scripts["zsh"], command)
                self.assertIn(f"-l {option[2:]}", scripts["fish"], command)

    def test_options_of_man_pages(self):
        man = self.page("man", "--command", "check").replace("\\-", "-")
        for option in ("--fail-on", "--rule", "--profile", "--profiles", "--esi", "--join", "-o, --output"):
            self.assertIn(f"\\fB{option}", man)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_man_pages_are_well_formed(self):
        for page in (self.page("man"), self.page("man", "--command", "check")):
            done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-rLL=110n"], input=page.encode(), capture_output=True,
                                  timeout=60)
            self.assertEqual((done.returncode, done.stderr.decode()), (0, ""))
            self.assertIn(b"SYNOPSIS", re.sub(rb"\x1b\[[0-9;]*m|.\x08", b"", done.stdout))

    @unittest.skipUnless(shutil.which("bash"), "bash is not installed")
    def test_bash_completes(self):
        script = self.file("completion", self.page("bash"))

        def complete(*words):
            line = " ".join(f"'{w}'" for w in words)
            done = subprocess.run(["bash", "-c", f"source {script}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; "
                                   "_ecaudit 2>/dev/null; printf '%s\\n' \"${COMPREPLY[@]}\""],
                                  capture_output=True, timeout=60, cwd=self.dir)
            return done.stdout.decode().split()

        self.assertEqual(complete("ecaudit", "expl"), ["explain"])
        self.assertEqual(complete("ecaudit", "check", "--fail"), ["--fail-on"])
        self.assertEqual(complete("ecaudit", "check", "--fail-on", "war"), ["warning"])
        self.assertIn("kollmorgen-akd-2011", complete("ecaudit", "check", "--profile", "koll"))
        self.assertIn("al-refused=", complete("ecaudit", "check", "--rule", "al-ref"))
        self.assertEqual(complete("ecaudit", "explain", "al-refu"), ["al-refused"])
        self.assertEqual(complete("ecaudit", "slice", "--finding", "al-refu"), ["al-refused"])
        # Each command has formats of its own.
        self.assertEqual(complete("ecaudit", "check", "--format", "git"), ["github", "gitlab"])
        self.assertEqual(complete("ecaudit", "signals", "--format", ""), ["csv", "jsonl"])
        self.assertEqual(complete("ecaudit", "decode", "--format", ""), ["text", "csv", "jsonl"])
        self.assertEqual(complete("ecaudit", "diff", "--format", ""), ["text", "json"])
        self.assertEqual(complete("ecaudit", "events", "--type", "emer"), ["emergency"])
        self.assertEqual(complete("ecaudit", "check", "--require", "re"), ["reached=OP"])
        self.assertIn("FBUS.SYNCDIST=", complete("ecaudit", "check", "--parameter", "FBUS."))
        self.assertEqual(complete("ecaudit", "check", "--color", "al"), ["always"])
        self.assertEqual(complete("ecaudit", "check", "heal"), ["healthy.pcap"])

    def test_every_format_that_help_names_is_completed(self):
        script = self.page("bash")
        for command in self.commands():
            words = re.search(rf"(?s)\n    {command}\)\n(.*?)\n      ;;", script).group(1)
            listed = re.search(r"--format\) words='([^']*)'", words)
            help_text = self.run_program(command, "--help").out
            named = re.search(r"--format FORMAT +((?:.*\n)(?: {20,}.*\n)*)", help_text)
            self.assertEqual(listed is None, named is None, command)
            for word in listed.group(1).split() if listed else []:
                self.assertRegex(named.group(1), rf"\b{word}\b", command)

    def test_what_cannot_be(self):
        self.assertIn("unknown shell 'tcsh'", self.one_error("completion", "tcsh"))
        self.assertIn("no SHELL given", self.one_error("completion"))
        self.assertIn("belongs to man", self.one_error("completion", "bash", "--command", "check"))
        self.assertIn("unknown command 'chek'", self.one_error("completion", "man", "--command", "chek"))


if __name__ == "__main__":
    unittest.main()
