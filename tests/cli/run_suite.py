"""Runs the test classes named on the command line; see CMakeLists.txt. Exit status 77: everything was skipped.

A test that skips and is not named in tests/needs.txt makes the run fail. With ECAUDIT_SYSTEM=windows the tests of
tests/windows are there as well, and those that its skipped.txt lists are left out.
"""
import importlib
import os
import pathlib
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
sys.path.insert(0, str(HERE.parent / "support"))
import needs
from support import SHARED

SYSTEM = os.environ.get("ECAUDIT_SYSTEM")
FOLDERS = [HERE] + ([HERE.parent / SYSTEM] if SYSTEM else [])
sys.path += map(str, FOLDERS[1:])


def unnamed_skips(result: unittest.TestResult) -> list:
    """One line for each test that skipped and should not have."""
    lines = needs.read(needs.FILE.read_text())
    left_out = needs.left_out(SYSTEM)
    problems = set()
    for test, why in result.skipped:
        if why in left_out.values():
            continue
        # "test_html.HtmlPages.test_signals"; a blank and the parameters of a subtest may follow.
        name = test.id().split(" ")[0].partition(".")[2]
        problems.add(needs.problem_of_skip(f"cli.{name}", lines, SHARED))
    return sorted(problems - {""})


def main() -> int:
    if "ECAUDIT" not in os.environ:
        sys.exit("set ECAUDIT to the program's path, or run ctest")
    wanted = set(sys.argv[1:])
    loader = unittest.TestLoader()
    suite = unittest.TestSuite()
    left_out = needs.left_out(SYSTEM)
    for file in sorted(file for folder in FOLDERS for file in folder.glob("test_*.py")):
        module = importlib.import_module(file.stem)
        for name, value in vars(module).items():
            if isinstance(value, type) and issubclass(value, unittest.TestCase) and value.__module__ == module.__name__:
                if not wanted or name in wanted:
                    for method in loader.getTestCaseNames(value):
                        if why := needs.why_left_out(f"{name}.{method}", left_out):
                            setattr(value, method, unittest.skip(why)(getattr(value, method)))
                    suite.addTests(loader.loadTestsFromTestCase(value))
    if suite.countTestCases() == 0:
        print(f"no test class named {', '.join(sorted(wanted))}")
        return 1
    result = unittest.TextTestRunner(verbosity=2, stream=sys.stdout).run(suite)
    problems = unnamed_skips(result)
    print("\n".join(problems), end="\n" if problems else "")
    if problems or not result.wasSuccessful():
        return 1
    return 77 if len(result.skipped) == result.testsRun else 0


if __name__ == "__main__":
    sys.exit(main())
