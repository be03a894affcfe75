"""CPU seconds of each test, run alone, with all processes that it starts: the dearest first, and their sum. On a machine that others use,
too, these say more than the time on a clock, and they are what all of .ci/run comes to.

usage: cpu_seconds.py BUILD [ctest options]     for example: cpu_seconds.py build/release -R e2e.web"""
import ctypes
import json
import os
import resource
import subprocess
import sys
import time

PR_SET_CHILD_SUBREAPER = 36  # linux/prctl.h: who lost its parent comes to us


def tests(build, options):
    asked = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1", *options], capture_output=True, text=True, check=True)
    return [t for t in json.loads(asked.stdout)["tests"] if "command" in t]


def cpu_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def wait_for_all():
    """Children of the test that outlive it, a few seconds long."""
    end = time.monotonic() + 5
    while time.monotonic() < end:
        try:
            if os.waitpid(-1, os.WNOHANG)[0] == 0:
                time.sleep(0.05)
        except ChildProcessError:
            return


def run(test, build):
    properties = {p["name"]: p["value"] for p in test.get("properties", [])}
    environment = dict(entry.split("=", 1) for entry in properties.get("ENVIRONMENT", []))
    before = cpu_s()
    status = subprocess.run(test["command"], env={**os.environ, **environment}, cwd=properties.get("WORKING_DIRECTORY", build),
                            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode
    wait_for_all()
    return cpu_s() - before, test["name"], status


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    build = os.path.abspath(sys.argv[1])
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    done = sorted((run(test, build) for test in tests(build, sys.argv[2:])), reverse=True)
    for seconds, name, status in done:
        print(f"{seconds:8.2f}  {name}" + (f"  status {status}" if status else ""))
    print(f"{sum(seconds for seconds, _, _ in done):8.2f}  all {len(done)}")


if __name__ == "__main__":
    main()
