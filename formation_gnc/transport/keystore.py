"""A keystore as ROS 2 reads it (`ROS_SECURITY_KEYSTORE`): an authority, and keys with signed permissions by enclave.

Laid out as the tools of sros2 lay one out, which list and extend it too.
"""

import os
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path

from formation_gnc.errors import ConfigurationError
from formation_gnc.flight.access import Access
from formation_gnc.transport.dds_security import governance, permissions
from formation_gnc.transport.security import SHARED

try:
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.hazmat.primitives.serialization import pkcs7
except ImportError:
    raise ConfigurationError("cryptography is not installed: pip install cryptography") from None

VALIDITY = timedelta(days=365)
"""For how long certificates and permissions hold, from a day before they are made: clocks differ."""

AUTHORITY = "formation_gnc"
"""Common name of the authority that signs all others."""


class _Authority:
    """Signs identities, governance and permissions; keeps its key to itself, in files that only their owner reads."""

    def __init__(self, folder: Path) -> None:
        """Make its key and certificate in a keystore."""
        self.begin = datetime.now(UTC).replace(microsecond=0) - timedelta(days=1)
        self.end = self.begin + VALIDITY
        self._key = ec.generate_private_key(ec.SECP256R1())
        self._name = _named(AUTHORITY)
        self._certificate = self._certify(self._name, self._key.public_key(), x509.BasicConstraints(True, 1))
        public, private = folder / "public", folder / "private"
        for place in (public, private):
            place.mkdir(mode=0o700)
        _write(public / "ca.cert.pem", self._certificate.public_bytes(serialization.Encoding.PEM))
        _write(private / "ca.key.pem", _pem(self._key))
        for kind in ("identity_ca", "permissions_ca"):
            (public / f"{kind}.cert.pem").symlink_to("ca.cert.pem")
            (private / f"{kind}.key.pem").symlink_to("ca.key.pem")

    def _certify(
        self, name: x509.Name, key: ec.EllipticCurvePublicKey, basis: x509.BasicConstraints
    ) -> x509.Certificate:
        builder = x509.CertificateBuilder(self._name, name, key, x509.random_serial_number(), self.begin, self.end)
        return builder.add_extension(basis, critical=basis.ca).sign(self._key, hashes.SHA256())

    def identify(self, name: str) -> tuple[bytes, bytes]:
        """A key of its own for an enclave, and the certificate that it is the enclave's."""
        key = ec.generate_private_key(ec.SECP256R1())
        certificate = self._certify(_named(name), key.public_key(), x509.BasicConstraints(False, None))
        return _pem(key), certificate.public_bytes(serialization.Encoding.PEM)

    def sign(self, document: bytes) -> bytes:
        """A document with its signature, as S/MIME."""
        builder = pkcs7.PKCS7SignatureBuilder().set_data(document)
        signed = builder.add_signer(self._certificate, self._key, hashes.SHA256())
        options = [pkcs7.PKCS7Options.Text, pkcs7.PKCS7Options.DetachedSignature]
        return signed.sign(serialization.Encoding.SMIME, options)


def make_keystore(folder: Path, accesses: Mapping[str, Access]) -> None:
    """Make a keystore in a folder, which it makes, with an enclave of each name and what it may do.

    Raises:
        ConfigurationError: the folder exists.
    """
    try:
        folder.mkdir(mode=0o700, parents=True)
    except FileExistsError:
        raise ConfigurationError(f"keystore {folder}: exists already; name a folder that does not") from None
    authority = _Authority(folder)
    enclaves = folder / "enclaves"
    enclaves.mkdir(mode=0o700)
    _write(enclaves / "governance.xml", governance())
    _write(enclaves / "governance.p7s", authority.sign(governance()))
    for name, access in accesses.items():
        place = enclaves / name.strip("/")
        place.mkdir(mode=0o700, parents=True)
        for shared in SHARED:
            (place / shared).symlink_to(os.path.relpath(folder / "public" / shared, place))
        (place / "governance.p7s").symlink_to(os.path.relpath(enclaves / "governance.p7s", place))
        key, certificate = authority.identify(name)
        document = permissions(name, access, authority.begin, authority.end)
        contents = {"key.pem": key, "cert.pem": certificate, "permissions.xml": document}
        contents["permissions.p7s"] = authority.sign(document)
        for file, data in contents.items():
            _write(place / file, data)


def _named(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(x509.oid.NameOID.COMMON_NAME, name)])


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    form = serialization.PrivateFormat.PKCS8
    return key.private_bytes(serialization.Encoding.PEM, form, serialization.NoEncryption())


def _write(path: Path, data: bytes) -> None:
    """Write a file that only its owner may read."""
    path.touch(mode=0o600, exist_ok=False)
    path.write_bytes(data)
