"""Runs lumend for tests of pictures: one way to name cases and to render them so that they repeat."""
import subprocess


def listed(lumend, what):
    """Names of "scenes" or "methods"."""
    lines = subprocess.run([lumend, what], check=True, capture_output=True, text=True).stdout.splitlines()
    return [line.split()[0] for line in lines if line.strip()]


def render_command(lumend, case, size, threads, out, more=()):
    """case: (scene, method)."""
    return [lumend, "render", "--scene", case[0], "--method", case[1], "--size", size, "--deterministic", "--threads", str(threads),
            "--out", out, *more]


def render(*arguments):
    """As render_command."""
    command = render_command(*arguments)
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr}")
