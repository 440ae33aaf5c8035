"""What cpack makes: complete, reproducible, and working where it is unpacked."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tarfile
import unittest

from support import PROGRAM, SOURCE, CliTest

BUILD = pathlib.Path(PROGRAM).resolve().parents[1]


@unittest.skipUnless(all(map(shutil.which, ("cpack", "dpkg-deb", "dpkg-shlibdeps"))), "cpack or dpkg-dev is not installed")
@unittest.skipUnless((BUILD / "CPackConfig.cmake").exists() and (BUILD / "pages" / "man1").is_dir(),
                     "no build folder with man pages (target ecaudit_pages)")
class Package(CliTest):
    @classmethod
    def setUpClass(cls):
        import tempfile
        cls.folder = tempfile.TemporaryDirectory(prefix="ecaudit-package-")
        cls.out = pathlib.Path(cls.folder.name)
        cls.addClassCleanup(cls.folder.cleanup)
        for name in ("first", "second"):
            done = subprocess.run(["cpack", "--config", BUILD / "CPackConfig.cmake", "-G", "DEB;TGZ", "-B", cls.out / name],
                                  capture_output=True, timeout=600, cwd=BUILD,
                                  env=os.environ | {"SOURCE_DATE_EPOCH": "1700000000"})
            if done.returncode != 0:
                raise AssertionError(done.stdout.decode() + done.stderr.decode())
        cls.deb = next((cls.out / "first").glob("*.deb"))
        cls.root = cls.out / "root"
        subprocess.run(["dpkg-deb", "-x", cls.deb, cls.root], check=True)

    def field(self, name) -> str:
        return subprocess.run(["dpkg-deb", "-f", self.deb, name], capture_output=True, check=True).stdout.decode().strip()

    def installed(self, *arguments):
        done = subprocess.run([self.root / "usr" / "bin" / "ecaudit", *map(str, arguments)], capture_output=True,
                              cwd=self.dir, timeout=120)
        return done.returncode, done.stdout.decode(), done.stderr.decode()

    def test_the_same_bytes_twice(self):
        names = [p.name for p in sorted((self.out / "first").glob("ecaudit*")) if p.is_file()]
        self.assertEqual(len(names), 2, names)
        for name in names:
            self.assertEqual((self.out / "first" / name).read_bytes(), (self.out / "second" / name).read_bytes(), name)

    def test_sources(self):
        for name in ("one", "two"):
            done = subprocess.run(["cpack", "--config", BUILD / "CPackSourceConfig.cmake", "-B", self.out / name],
                                  capture_output=True, timeout=300, cwd=BUILD,
                                  env=os.environ | {"SOURCE_DATE_EPOCH": "1700000000"})
            self.assertEqual(done.returncode, 0, done.stderr.decode())
        first, = (self.out / "one").glob("*.tar.gz")
        self.assertEqual(first.read_bytes(), (self.out / "two" / first.name).read_bytes())
        with tarfile.open(first) as archive:
            names = {name.split("/", 1)[-1] for name in archive.getnames()}
        for path in ("CMakeLists.txt", "cli/main.cpp", "samples/builder/main.cpp", "tests/build/names.py", "LICENSE"):
            self.assertIn(path, names)
        self.assertFalse([n for n in names if n.startswith(("build/", ".git/"))])

    def test_control(self):
        self.assertEqual(self.field("Package"), "ecaudit")
        for library in ("libpcap", "libqt6core6", "libzstd1", "zlib1g", "libc6"):
            self.assertIn(library, self.field("Depends"))

    def test_contents(self):
        share = self.root / "usr" / "share"
        for path in ("man/man1/ecaudit.1.gz", "man/man1/ecaudit-check.1.gz", "man/man1/ecaudit-anonymize.1.gz",
                     "bash-completion/completions/ecaudit", "zsh/vendor-completions/_ecaudit",
                     "fish/vendor_completions.d/ecaudit.fish", "ecaudit/ecaudit-profile-1.schema.json",
                     "ecaudit/ecaudit-report-1.schema.json", "ecaudit/profiles/generic.json", "doc/ecaudit/copyright",
                     "doc/ecaudit/changelog.gz", "doc/ecaudit/families.md",
                     "doc/ecaudit/examples/captures/al-timeout.pcapng", "doc/ecaudit/examples/families/acme-servo.json"):
            self.assertTrue((share / path).is_file(), path)
        notices = (share / "doc" / "ecaudit" / "copyright").read_text()
        for name in ("uPlot", "CLI11", "nlohmann", "Leon Sorokin", "MIT", "BSD-3-Clause"):
            self.assertIn(name, notices)
        with tarfile.open(self.deb.parent / next(p.name for p in self.deb.parent.glob("*.tar.gz"))) as archive:
            self.assertTrue(any(name.endswith("bin/ecaudit") for name in archive.getnames()))
        for file in self.root.rglob("*"):
            self.assertNotIn(str(SOURCE), str(file))

    def test_documents_have_no_dead_links(self):
        folder = self.root / "usr" / "share" / "doc" / "ecaudit"
        pages = sorted(folder.glob("*.md"))
        self.assertIn("README.md", [page.name for page in pages])
        for page in pages:
            for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
                if "://" in link or link.startswith("#"):
                    continue
                self.assertTrue((folder / link.split("#")[0]).exists(), f"{page.name}: {link}")

    def test_an_installation_of_the_program_alone(self):
        # As after cli/quickstart.sh of an earlier version: the pages were not built.
        # The build folder stays as it is, for tests that run at the same time and for those after an interruption.
        script = (BUILD / "cmake_install.cmake").read_text()
        self.assertIn(f'"{BUILD}/pages', script)
        script = self.file("install.cmake", script.replace(f'"{BUILD}/pages', f'"{self.dir}/pages')
                           .replace(f"FOLDER={BUILD}/pages", f"FOLDER={self.dir}/pages")
                           .replace(f'"{BUILD}/${{CMAKE_INSTALL_MANIFEST}}"', f'"{self.dir}/manifest.txt"'))
        done = subprocess.run(["cmake", "-D", f"CMAKE_INSTALL_PREFIX={self.dir}/there", "-P", script],
                              capture_output=True, timeout=300, cwd=self.dir)
        self.assertEqual(done.returncode, 0, done.stderr.decode())
        self.assertTrue((self.dir / "pages" / "man1").is_dir())
        self.assertTrue((self.dir / "there/share/man/man1/ecaudit-check.1.gz").is_file())

    def test_the_main_job(self):
        capture = self.root / "usr/share/doc/ecaudit/examples/captures/init-to-op-refused.pcapng"
        status, out, err = self.installed("check", "--format", "json", capture)
        self.assertEqual((status, err), (1, ""))
        self.assertIn("al-illegal-transition", [f["rule"] for f in json.loads(out)["reports"][0]["findings"]])
        self.assertTrue(self.installed("--version")[1].startswith("ecaudit "))

    def test_it_goes_as_it_came(self):
        root = self.dir / "system"
        database = root / "var" / "lib" / "dpkg"
        for folder in ("info", "updates", "triggers"):
            (database / folder).mkdir(parents=True)
        for file in ("status", "available"):
            (database / file).touch()
        dpkg = ["dpkg", f"--root={root}", "--force-depends", "--force-not-root", "--log=/dev/null"]
        for step in (["-i", self.deb], ["--purge", "ecaudit"]):
            done = subprocess.run([*dpkg, *step], capture_output=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr.decode())
            self.assertEqual((root / "usr" / "bin" / "ecaudit").exists(), step[0] == "-i")
        self.assertEqual([p for p in root.rglob("*") if p.is_file() and database not in p.parents], [])

    def test_families_for_all_users(self):
        profiles = self.root / "usr" / "share" / "ecaudit" / "profiles"
        listed = json.loads(self.installed("profiles", "--format", "json")[1])["profiles"]
        self.assertEqual([p["id"] for p in listed if p["path"]], [], "copies of built-in ones change nothing")
        added = profiles / "acme-servo.json"
        shutil.copy(SOURCE / "samples" / "families" / "acme-servo.json", added)
        self.addCleanup(added.unlink)
        listed = json.loads(self.installed("profiles", "--format", "json")[1])["profiles"]
        self.assertEqual([p["id"] for p in listed if p["path"]], ["acme-servo"])

    @unittest.skipUnless(shutil.which("lintian"), "lintian is not installed")
    def test_lintian(self):
        done = subprocess.run(["lintian", "--fail-on", "error", self.deb], capture_output=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout.decode())


if __name__ == "__main__":
    unittest.main()
