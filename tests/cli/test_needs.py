"""tests/needs.txt, which lists the tests that may skip, and CMakeLists.txt, which lists the suites."""
import importlib
import pathlib
import re
import sys
import unittest

from support import SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "support"))
import needs

HERE = pathlib.Path(__file__).resolve().parent


def all_tests() -> set:
    """Names of all tests here as the file spells them: cli.CLASS.METHOD."""
    names = set()
    for file in sorted(HERE.glob("test_*.py")):
        module = importlib.import_module(file.stem)
        for name, value in vars(module).items():
            if isinstance(value, type) and issubclass(value, unittest.TestCase) and value.__module__ == module.__name__:
                names |= {f"cli.{name}.{method}" for method in unittest.defaultTestLoader.getTestCaseNames(value)}
    return names


class Needs(unittest.TestCase):
    def test_each_line_names_a_test(self):
        tests = all_tests()
        for need, pattern in needs.read(needs.FILE.read_text()):
            if pattern.startswith("cli."):
                with self.subTest(pattern):
                    self.assertTrue(any(needs.fnmatch.fnmatchcase(name, pattern) for name in tests))

    def test_each_suite_is_run(self):
        listed = set(re.findall(r"\w+", (HERE / "CMakeLists.txt").read_text()))
        self.assertEqual({name.split(".")[1] for name in all_tests()} - listed, set())

    def test_lines_are_sorted_and_of_known_programs(self):
        lines = needs.read(needs.FILE.read_text())
        self.assertEqual(lines, sorted(set(lines)))
        self.assertEqual({pattern.split(".")[0] for _, pattern in lines}, {"cli", "laws", "unit"})

    def test_what_is_left_out_on_a_system_is_a_test(self):
        tests = all_tests()
        lines = needs.left_out("windows")
        for pattern in lines:
            with self.subTest(pattern):
                self.assertTrue(any(needs.fnmatch.fnmatchcase(name, f"cli.{pattern}") for name in tests))
        pattern, why = next(iter(lines.items()))
        self.assertEqual(needs.why_left_out(pattern, lines), why)
        self.assertEqual(needs.why_left_out("Usage.test_unknown_command", lines), "")

    def test_only_what_is_named_may_skip(self):
        lines = needs.read("# why\nshared cli.Lab.*  # all\n\ntshark cli.Lab.test_compares\n")
        there, absent = pathlib.Path("/"), pathlib.Path("/nowhere-at-all")
        self.assertEqual(needs.problem_of_skip("cli.Lab.test_works", lines, absent), "")
        self.assertIn("is there", needs.problem_of_skip("cli.Lab.test_works", lines, there))
        self.assertEqual(needs.problem_of_skip("cli.Lab.test_compares", lines, there), "")
        self.assertIn("does not say", needs.problem_of_skip("cli.Other.test_works", lines, absent))
        for line in ("\nshared", "\nshared Lab.test_works", "\nshared cli.Lab.test_works more"):
            with self.assertRaisesRegex(ValueError, "line 2: "):
                needs.read(line)


if __name__ == "__main__":
    unittest.main()
