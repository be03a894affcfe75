"""Fails when a built-in scene is not what its generator writes.   usage: scenes.py SOURCE_DIR"""
import filecmp
import os
import subprocess
import sys
import tempfile

folder = os.path.join(sys.argv[1], "server", "scenes")
with tempfile.TemporaryDirectory() as fresh:
    subprocess.run([sys.executable, os.path.join(folder, "generate.py"), fresh], check=True)
    names = sorted(os.listdir(fresh))
    committed = sorted(n for n in os.listdir(folder) if n.endswith(".jsonl"))
    differing = [n for n in names if not os.path.exists(os.path.join(folder, n)) or
                 not filecmp.cmp(os.path.join(folder, n), os.path.join(fresh, n), shallow=False)]
for n in differing + [n for n in committed if n not in names]:
    print(f"server/scenes/{n} is not what generate.py writes: run it, and commit both")
print(f"{len(names)} scenes")
sys.exit(1 if differing or committed != names else 0)
