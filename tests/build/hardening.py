"""Whether the program is hardened as it is meant to be, by what readelf says. Exit status 77: there is no readelf.
_FORTIFY_SOURCE need not leave a trace: no buffer of this program has a size that the compiler knows.

  hardening.py PROGRAM [assertions]
"""
import re
import shutil
import subprocess
import sys


def readelf(program: str, *options: str) -> str:
    return subprocess.run(["readelf", "-W", *options, program], check=True, stdout=subprocess.PIPE).stdout.decode()


def main() -> int:
    if shutil.which("readelf") is None:
        print("readelf is not installed")
        return 77
    program = sys.argv[1]
    header, segments, dynamic = readelf(program, "-h"), readelf(program, "-l"), readelf(program, "-d")
    symbols = readelf(program, "--dyn-syms")
    stack = re.search(r"GNU_STACK.*", segments)
    wrong = [what for what, right in {
        "no position-independent executable": re.search(r"Type:\s+DYN", header),
        "no GNU_RELRO segment": "GNU_RELRO" in segments,
        "functions are bound late, so their table stays writable": re.search(r"BIND_NOW|\bNOW\b", dynamic),
        "the stack can be executed": stack and "E" not in stack.group().split()[-2],
        "no stack protector": "__stack_chk_fail" in symbols,
        "no assertion of the standard library": "assertions" not in sys.argv[2:] or "__glibcxx_assert_fail" in symbols,
    }.items() if not right]
    for what in wrong:
        print(f"{program}: {what}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
