"""Certificates for a test, by the command openssl: an authority of its own, and what it signs."""
import os
import ssl
import subprocess


def openssl(*arguments):
    subprocess.run(["openssl", *arguments], check=True, capture_output=True)


class Authority:
    """In a folder, which is the caller's. Elliptic keys: they are made at once."""

    def __init__(self, folder, name="authority"):
        self.folder, self.name = folder, name
        self.certificate, self._key = (os.path.join(folder, f"{name}.{kind}") for kind in ("pem", "key"))
        openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "30",
                "-subj", f"/CN={name}", "-addext", "keyUsage=critical,keyCertSign,cRLSign",
                "-out", self.certificate, "-keyout", self._key)

    def trust(self):
        """What a client that has the authority's certificate makes connections of."""
        return ssl.create_default_context(cafile=self.certificate)

    def issue(self, name, names="DNS:localhost,IP:127.0.0.1", days="20", key=("ec", "ec_paramgen_curve:prime256v1")):
        """(certificate, key): paths. names: of subjectAltName. days: from now; may be negative."""
        certificate, secret, request, more = (os.path.join(self.folder, f"{name}.{kind}") for kind in ("pem", "key", "csr", "ext"))
        openssl("req", "-new", "-newkey", key[0], "-pkeyopt", key[1], "-nodes", "-subj", f"/CN={name}", "-out", request,
                "-keyout", secret)
        os.chmod(secret, 0o600)
        with open(more, "w", encoding="ascii") as file:
            file.write(f"subjectAltName={names}\n")
        openssl("x509", "-req", "-in", request, "-CA", self.certificate, "-CAkey", self._key, "-CAcreateserial",
                "-days", days, "-extfile", more, "-out", certificate)
        return certificate, secret
