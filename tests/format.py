"""Fails where a C file is not as .clang-format has it.   usage: format.py SOURCE_DIR"""
import os
import shutil
import subprocess
import sys

source = sys.argv[1]
failures = []

tracked = subprocess.run(["git", "-C", source, "ls-files", "*.c", "*.h"], capture_output=True, text=True).stdout.split()
names = [n for n in tracked if os.path.exists(os.path.join(source, n))]
if not names or not shutil.which("clang-format"):
    print("skipped: " + ("there is no clang-format" if names else "this is no checkout"))
    sys.exit(77)

out = subprocess.run(["clang-format", "--dry-run", "-Werror", *names], cwd=source, capture_output=True, text=True)
failures += sorted({line.split(":")[0] + ": clang-format -i changes it" for line in out.stderr.splitlines() if ": error:" in line})
for failure in failures:
    print(failure)
print(f"{len(names)} files, {len(failures)} failures")
sys.exit(1 if failures or out.returncode else 0)
