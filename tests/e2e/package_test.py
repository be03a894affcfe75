"""The Debian package: what is in it, and that it runs from where it is unpacked."""
import glob
import os
import re
import shutil
import subprocess
import tempfile
import unittest

import daemon
from daemon import Daemon

HERE = os.path.dirname(os.path.abspath(__file__))
BUILD = os.environ["LUMEND_BUILD"]


def run(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise AssertionError(f"{command}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


@unittest.skipUnless(all(map(shutil.which, ("cpack", "dpkg-deb", "dpkg-shlibdeps"))), "needs cpack and dpkg-dev")
class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="lumend-package-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run("cpack", "-G", "DEB", "--config", f"{BUILD}/CPackConfig.cmake", "-B", cls.folder)
        (cls.package,) = glob.glob(cls.folder + "/lumend_*.deb")
        cls.root = cls.folder + "/root"

    def test_1_what_is_in_it(self):
        files = {line.split()[-1]: line.split()[0] for line in run("dpkg-deb", "-c", self.package).splitlines()
                 if not line.startswith("d")}
        self.assertEqual({name: mode for name, mode in files.items() if name.startswith("./usr/bin/")},
                         {f"./usr/bin/{name}": "-rwxr-xr-x" for name in ("lumend", "lumend-import", "lumend-replay")})
        for name in ("etc/default/lumend", "usr/lib/systemd/system/lumend.service", "usr/share/man/man1/lumend.1",
                     "usr/share/man/man1/lumend-import.1", "usr/share/man/man1/lumend-replay.1",
                     "usr/share/doc/lumend/copyright"):
            self.assertEqual(files.pop(f"./{name}"), "-rw-r--r--", name)
        self.assertFalse([name for name in files if not name.startswith(("./usr/bin/", "./usr/share/doc/lumend/"))])
        depends = run("dpkg-deb", "-f", self.package, "Depends")
        for library in ("libembree3-3", "libwebsockets17", "libc6", "libseccomp2", "libassimp5"):
            self.assertRegex(depends, rf"\b{library} \(>= ")
        self.assertRegex(run("dpkg-deb", "-f", self.package, "Version"), r"^\d+\.\d+\.\d+-1\n$")
        self.assertRegex(run("dpkg-deb", "-f", self.package, "Description"), r"\A[^\n]+\n( [^ \n].*\n)+ \.\n( [^ \n].*\n)+\Z")

    def unpack(self):
        """Installs it into a root of its own, as root with dpkg, which runs its scripts; else without."""
        if os.geteuid() != 0:
            run("dpkg-deb", "-x", self.package, self.root)
            return False
        os.makedirs(self.root + "/var/lib/dpkg")
        open(self.root + "/var/lib/dpkg/status", "wb").close()
        self.dpkg("-i", self.package)
        return True

    def dpkg(self, *arguments):
        run("dpkg", f"--root={self.root}", "--force-script-chrootless", "--force-depends", *arguments,
            env={**os.environ, "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"})

    def test_2_it_runs_from_where_it_is(self):
        by_dpkg = self.unpack()
        with open(self.root + "/usr/lib/systemd/system/lumend.service", encoding="utf-8") as unit:
            self.assertIn("\nExecStart=/usr/bin/lumend serve\n", unit.read())
        options = ["--state", self.folder + "/state", "--assets", os.path.join(HERE, "web")]
        token = self.root + "/etc/lumend/token"
        if by_dpkg:
            self.assertEqual(os.stat(token).st_mode & 0o777, 0o600)
            options += ["--token-file", token]
        daemon.LUMEND = self.root + "/usr/bin/lumend"
        with Daemon(*options) as server:
            status, _, page = server.get("/")
            self.assertEqual(status, 200)
            if os.environ["LUMEND_WEB"] == "ON":  # the browser client, its script and its style
                for path in re.findall(rb'(?:src|href)="(?:\./|/)?(assets/[^"]+)"', page) or self.fail(page):
                    self.assertEqual(server.get("/" + path.decode())[0], 200)
            ws = server.connect()
            ws.call("scene.apply", {"ops": [{"op": "import", "id": "a", "asset": "lamp.gltf"}]})  # by its own importer
            server.assert_well()
        self.assertIn("revision 2,", run(daemon.LUMEND, "state", "check", self.folder + "/state"))
        if by_dpkg:
            self.dpkg("-P", "lumend")
            left = [os.path.join(top, name) for top, _, names in os.walk(self.root) for name in names]
            self.assertEqual([name for name in left if "/var/l" not in name], [])


if __name__ == "__main__":
    unittest.main()
