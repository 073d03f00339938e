"""Make certificates: of an authority (CA), and of those that it vouches for."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from ipaddress import ip_address
from typing import NamedTuple

from hand_models.base import UnsupportedError, to_install

try:
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.hazmat.primitives.serialization import (
        Encoding,
        NoEncryption,
        PrivateFormat,
        load_pem_private_key,
    )
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
except ImportError:
    raise UnsupportedError(
        f"keys need cryptography, which is not installed: {to_install('keys')}"
    ) from None

__all__ = ["Authority", "Certified"]

CLOCKS_DIFFER = datetime.timedelta(hours=1)
"""A certificate is valid so long before it is made, as clocks of other machines are behind."""


class Certified(NamedTuple):
    """A certificate and its private key, both as PEM."""

    certificate: bytes
    key: bytes


class Authority:
    """Authority (CA) that signs certificates.

    Parameters
    ----------
    certificate, key : bytes
        Its own certificate and private key, PEM.
    """

    def __init__(self, certificate: bytes, key: bytes) -> None:
        self.certificate = certificate
        self._name = x509.load_pem_x509_certificate(certificate).subject
        private = load_pem_private_key(key, password=None)
        assert isinstance(private, ec.EllipticCurvePrivateKey)
        self._key = private

    @classmethod
    def made(cls, name: str, until: datetime.datetime) -> tuple[Authority, bytes]:
        """Make an authority that is valid until a time; return it and its private key, PEM."""
        key = ec.generate_private_key(ec.SECP256R1())
        subject = _name(name)
        signed = (
            _begun(subject, subject, key, until)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(_usage(signs=True), critical=True)
            .sign(key, hashes.SHA256())
        )
        return cls(signed.public_bytes(Encoding.PEM), _pem(key)), _pem(key)

    def certify(self, name: str, hosts: Sequence[str], until: datetime.datetime) -> Certified:
        """Make a key and its certificate, which names its owner and where it may listen.

        Parameters
        ----------
        name : str
            Common name.
        hosts : sequence of str
            Names and addresses of the machine for others who connect to it. Without any, the
            certificate is a client's only.
        until : datetime
            End of its validity.
        """
        key, usages = ec.generate_private_key(ec.SECP256R1()), [ExtendedKeyUsageOID.CLIENT_AUTH]
        if hosts:
            usages.append(ExtendedKeyUsageOID.SERVER_AUTH)
        made = (
            _begun(_name(name), self._name, key, until)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_usage(signs=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
        )
        if hosts:
            named = x509.SubjectAlternativeName([_host(each) for each in hosts])
            made = made.add_extension(named, critical=False)
        signed = made.sign(self._key, hashes.SHA256())
        return Certified(signed.public_bytes(Encoding.PEM), _pem(key))


def _begun(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    until: datetime.datetime,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(datetime.datetime.now(datetime.UTC) - CLOCKS_DIFFER)
        .not_valid_after(until)
    )


def _usage(*, signs: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs,
        crl_sign=signs,
        encipher_only=False,
        decipher_only=False,
    )


def _name(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
