"""Ed25519 as RFC 8032, section 5.1, describes it, in whole numbers of Python: slow, open to whoever measures time, and
independent of any library. The tests hold the signatures of the C++ side to it."""
import hashlib

P = 2**255 - 19
L = 2**252 + 27742317777372353535851937790883648493  # order of the base point
D = -121665 * pow(121666, P - 2, P) % P
ROOT = pow(2, (P - 1) // 4, P)  # of -1


def _hash_number(data):
    return int.from_bytes(hashlib.sha512(data).digest(), "little")


# Points in extended coordinates (X, Y, Z, T): x = X / Z, y = Y / Z, x y = T / Z.
def _add(p, q):
    a, b = (p[1] - p[0]) * (q[1] - q[0]) % P, (p[1] + p[0]) * (q[1] + q[0]) % P
    c, d = 2 * p[3] * q[3] * D % P, 2 * p[2] * q[2] % P
    e, f, g, h = b - a, d - c, d + c, b + a
    return e * f % P, g * h % P, f * g % P, e * h % P


def _multiply(number, point):
    out = (0, 1, 1, 0)
    while number:
        if number & 1:
            out = _add(out, point)
        point, number = _add(point, point), number >> 1
    return out


def _x_of(y, sign):
    square = (y * y - 1) * pow(D * y * y + 1, P - 2, P) % P
    x = pow(square, (P + 3) // 8, P)
    if (x * x - square) % P:
        x = x * ROOT % P
    return P - x if x & 1 != sign else x


_Y = 4 * pow(5, P - 2, P) % P
BASE = (_x_of(_Y, 0), _Y, 1, _x_of(_Y, 0) * _Y % P)


def _packed(point):
    inverse = pow(point[2], P - 2, P)
    x, y = point[0] * inverse % P, point[1] * inverse % P
    return (y | (x & 1) << 255).to_bytes(32, "little")


def _expanded(seed):
    digest = hashlib.sha512(seed).digest()
    number = int.from_bytes(digest[:32], "little") & ((1 << 254) - 8) | 1 << 254
    return number, digest[32:]


def public_key(seed):
    """32 bytes from the 32 bytes that the RFC calls the private key."""
    return _packed(_multiply(_expanded(seed)[0], BASE))


def sign(seed, message):
    """64 bytes."""
    number, prefix = _expanded(seed)
    public = public_key(seed)
    r = _hash_number(prefix + message) % L
    head = _packed(_multiply(r, BASE))
    return head + ((r + _hash_number(head + public + message) * number) % L).to_bytes(32, "little")
