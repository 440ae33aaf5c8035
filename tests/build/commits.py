"""The check of commit messages (.ci/check_commits.sh) accepts a good message and names what is wrong with others.

usage: commits.py SOURCE_DIR. Exit status 77 without git.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

GOOD = "mailbox: count a request whose frame never returned"
BODY = "A refused download was not reported.\nCause: the request was dropped.\nChange: keep it.\nTest: violates-4.trace."
BAD = [
    ("A message that stands there is told", BODY, "not \"area: imperative\""),
    ("mailbox: " + "count " * 12, BODY, "more than 72"),
    ("mailbox: added a count", BODY, "no imperative"),
    ("mailbox: the count is wrong", BODY, "no imperative"),
    ("mailbox: count requests.", BODY, "full stop"),
    (GOOD, "", "no body"),
]


def main() -> None:
    if shutil.which("git") is None or shutil.which("bash") is None:
        sys.exit(77)
    check = pathlib.Path(sys.argv[1]).resolve() / ".ci" / "check_commits.sh"
    with tempfile.TemporaryDirectory() as folder:
        def run(*words):
            return subprocess.run(words, cwd=folder, capture_output=True, text=True)

        def commit(subject, body):
            text = subject + ("\n\n" + body if body else "")
            made = run("git", "-c", "user.name=Test", "-c", "user.email=test@example.org", "commit", "--quiet",
                       "--allow-empty", "--no-verify", "-m", text)
            if made.returncode != 0:
                sys.exit("cannot commit: " + made.stderr)

        run("git", "init", "--quiet")
        wrong = []
        for subject, body, expected in BAD:
            commit(subject, body)
            done = run("bash", str(check))
            if done.returncode != 1 or expected not in done.stdout:
                wrong.append(f"{subject!r}: {expected!r} is not in {done.stdout!r} {done.stderr!r}")
        commit(GOOD, BODY)
        done = run("bash", str(check))  # the last commit only: no upstream
        if done.returncode != 0 or "1 checked" not in done.stdout:
            wrong.append(f"a good message: {done.stdout!r} {done.stderr!r}")
        done = run("bash", str(check), "HEAD~2..HEAD")
        if done.returncode != 1 or "no body" not in done.stdout:
            wrong.append(f"a range: {done.stdout!r} {done.stderr!r}")
        if wrong:
            sys.exit("\n".join(wrong))
    print(f"commits: {len(BAD)} wrong messages found")


if __name__ == "__main__":
    main()
