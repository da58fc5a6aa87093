"""unittest for CTest: what lacks a package is reported as skipped, never as passed.

A test skipped for a reason that begins with LACKS makes the whole program exit with 77, CTest's
SKIP_RETURN_CODE, if nothing failed. Other reasons (a stub, a race) are of the test itself.
"""
import sys
import unittest

SKIPPED = 77
LACKS = "lacks "


def main(argv=None, **more):
    result = unittest.main(module=sys.modules["__main__"], argv=argv, exit=False, **more).result
    if not result.wasSuccessful():
        sys.exit(1)
    if result.testsRun == 0:
        sys.exit("no test was run")
    lacking = sorted({why for _, why in result.skipped if why.startswith(LACKS)})
    for why in lacking:
        print(f"skipped: this machine {why}", file=sys.stderr)
    sys.exit(SKIPPED if lacking else 0)
