"""Whether a program was built with a sanitizer: it is slower then by a factor of ten, and keeps what was freed."""
import pathlib

MARKS = (b"__asan_init", b"__tsan_init")


def sanitized(binary):
    content = pathlib.Path(binary).read_bytes()
    return any(mark in content for mark in MARKS)
