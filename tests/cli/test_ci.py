"""The templates of docs/ci: their commands work with this program."""
import json
import os
import pathlib
import re
import subprocess
import textwrap
import unittest
import xml.etree.ElementTree as ET

from support import PROGRAM, SOURCE, CliTest

TEMPLATES = SOURCE / "docs" / "ci"


class CiTemplates(CliTest):
    def setUp(self):
        super().setUp()
        (self.dir / "bin").mkdir()
        (self.dir / "bin" / "ecaudit").symlink_to(pathlib.Path(PROGRAM).resolve())
        for name, capture in (("captures/good.pcap", self.healthy), ("captures/bad.pcap", self.faulty)):
            self.file(name, pathlib.Path(capture).read_bytes())

    def run_script(self, script: str, **variables) -> subprocess.CompletedProcess:
        environment = os.environ | {"PATH": f"{self.dir / 'bin'}:{os.environ['PATH']}"} | variables
        return subprocess.run(["bash", "-e", "-o", "pipefail", "-c", script], cwd=self.dir, env=environment,
                              capture_output=True, text=True, timeout=120)

    def action(self, **inputs) -> subprocess.CompletedProcess:
        """Runs the step as GitHub does: with each variable of `env` set to its input or the default of it."""
        text = (TEMPLATES / "action.yml").read_text()
        script = textwrap.dedent(re.search(r"^      run: \|\n((?:        .*\n)+)", text, re.M).group(1))
        variables = {}
        for name, wanted in re.findall(r"^        (\w+): \$\{\{ inputs\.(\w+) \}\}$", text, re.M):
            default = re.search(rf'^  {wanted}:\n    description: .*\n    default: "?(.*?)"?$', text, re.M).group(1)
            variables[name] = inputs.get(wanted, default)
        self.assertEqual(len(variables), 3)
        return self.run_script(script, GITHUB_STEP_SUMMARY=str(self.dir / "job.md"), **variables)

    def test_action_fails_on_findings(self):
        done = self.action()
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stdout, r"(?m)^::error ")
        self.assertIn("bad.pcap", (self.dir / "job.md").read_text())
        sarif = json.loads((self.dir / "ecaudit-reports" / "summary.sarif").read_text())
        self.assertTrue(sarif["runs"][0]["results"])

    def test_action_passes_its_inputs(self):
        done = self.action(captures="captures/good.pcap captures/bad.pcap", options="--fail-on never --jobs 1", reports="out")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.dir / "out" / "summary.sarif").exists())
        self.assertEqual(self.action(captures="captures/nothing").returncode, 2)

    def test_gitlab_job(self):
        text = (TEMPLATES / "gitlab-ci.yml").read_text()
        script = "\n".join(re.findall(r"^    - (.*)$", text, re.M))
        defaults = dict(re.findall(r'^    (ECAUDIT_\w+): "?(.*?)"?$', text, re.M))
        done = self.run_script(script, **defaults)
        self.assertEqual(done.returncode, 1, done.stderr)
        for kind, path in re.findall(r"^      (junit|codequality): (.*)$", text, re.M):
            content = (self.dir / path).read_text()
            self.assertTrue(ET.fromstring(content) is not None if kind == "junit" else json.loads(content), kind)
        self.assertEqual(self.run_script(script, **defaults | {"ECAUDIT_OPTIONS": "--fail-on never"}).returncode, 0)

    def test_image_installs_what_a_build_needs(self):
        wanted = re.search(r"^BUILD_PACKAGES=\((.*?)\)", (SOURCE / ".ci" / "packages.sh").read_text(), re.M | re.S).group(1)
        image = (TEMPLATES / "Containerfile").read_text()
        installed = re.search(r"install -y --no-install-recommends \\\n(.*?)\nCOPY", image, re.S).group(1).replace("\\\n", " ").split()
        self.assertEqual(set(installed) - set(wanted.split()), {"dpkg-dev", "npm"})
        self.assertLessEqual(set(wanted.split()), set(installed))
        # The same commands as in docs and quickstart, whose results other tests look at.
        quickstart = (SOURCE / "cli" / "quickstart.sh").read_text()
        for command in re.search(r"^RUN (cmake --preset .*)$", image, re.M).group(1).split(" && "):
            self.assertIn(command, quickstart)


if __name__ == "__main__":
    unittest.main()
