"""Runs the test classes named on the command line; see CMakeLists.txt. Exit status 77: everything was skipped."""
import importlib
import os
import pathlib
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))


def main() -> int:
    if "ECAUDIT" not in os.environ:
        sys.exit("set ECAUDIT to the program's path, or run ctest")
    wanted = set(sys.argv[1:])
    loader = unittest.TestLoader()
    suite = unittest.TestSuite()
    for file in sorted(HERE.glob("test_*.py")):
        module = importlib.import_module(file.stem)
        for name, value in vars(module).items():
            if isinstance(value, type) and issubclass(value, unittest.TestCase) and value.__module__ == module.__name__:
                if not wanted or name in wanted:
                    suite.addTests(loader.loadTestsFromTestCase(value))
    if suite.countTestCases() == 0:
        print(f"no test class named {', '.join(sorted(wanted))}")
        return 1
    result = unittest.TextTestRunner(verbosity=2, stream=sys.stdout).run(suite)
    if not result.wasSuccessful():
        return 1
    return 77 if len(result.skipped) == result.testsRun else 0


if __name__ == "__main__":
    sys.exit(main())
