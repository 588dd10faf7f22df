"""A desk for a test: a virtual screen, hands on its mouse and keys, and eyes that read what a window says.

The eyes read what a screen reader reads (AT-SPI). Nothing here reaches into the window.
"""
import contextlib
import ctypes
import os
import signal
import struct
import subprocess
import time
import zlib
from pathlib import Path

from processes import Failure

LAUNCHER = Path("/usr/libexec/at-spi-bus-launcher")
NEEDED = {"Xvfb": "xvfb", "openbox": "openbox", "xdotool": "xdotool", "dbus-daemon": "dbus-daemon"}
OPENBOX_RULES = Path("/etc/xdg/openbox/rc.xml")
MAXIMISE = "<applications>\n<application type='normal'><maximized>yes</maximized></application>\n"
PR_SET_CHILD_SUBREAPER = 36


def missing_package():
    """One Debian package that the desk needs and that is not installed. Empty: none."""
    for program, package in NEEDED.items():
        if not any(os.access(Path(folder) / program, os.X_OK) for folder in os.get_exec_path()):
            return package
    if not LAUNCHER.exists():
        return "at-spi2-core"
    try:
        import dbus  # noqa: F401
    except ImportError:
        return "python3-dbus"
    return ""


def own_orphans():
    """Programs whose parents end become children of this process, so that end_orphans() knows their ids."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def children():
    """The ids of this process's children."""
    lists = [task / "children" for task in Path("/proc/self/task").iterdir()]
    return [int(child) for file in lists if file.exists() for child in file.read_text().split()]


def program_of(process):
    """Its name, of which the kernel keeps 15 letters. Empty: it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return ""
    return "" if "\nState:\tZ" in status else status.split(maxsplit=2)[1]


def end_orphans():
    """Ends what is still a child of this process, by its id."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        deadline = time.monotonic() + 3.0
        while left := children():
            for child in left:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(child, number)
                with contextlib.suppress(ChildProcessError):
                    os.waitpid(child, os.WNOHANG)
            if time.monotonic() > deadline:
                break
            time.sleep(0.05)


class Screen:
    """A virtual screen with a window manager and an accessibility bus."""

    def __init__(self, household, folder: Path, width, height):
        self._memory = folder / "screen"
        self._memory.mkdir()
        xvfb = household.start("Xvfb", ["Xvfb", "-displayfd", "1", "-screen", "0", f"{width}x{height}x24", "-nolisten",
                                        "tcp", "-noreset", "-fbdir", self._memory])
        number = xvfb.next_line(20.0)
        if not number:
            raise Failure("Xvfb, the virtual screen, did not start; its last lines:", xvfb.last_words())
        self.environment = dict(os.environ, DISPLAY=f":{number.strip()}", LIBGL_ALWAYS_SOFTWARE="1",
                                QT_LINUX_ACCESSIBILITY_ALWAYS_ON="1")
        for name in ("WAYLAND_DISPLAY", "XAUTHORITY", "AT_SPI_BUS_ADDRESS"):
            self.environment.pop(name, None)
        rules = folder / "openbox.xml"
        rules.write_text(OPENBOX_RULES.read_text(encoding="utf-8").replace("<applications>", MAXIMISE, 1),
                         encoding="utf-8")
        household.start("openbox", ["openbox", "--config-file", rules], self.environment)
        bus = household.start("dbus-daemon", ["dbus-daemon", "--session", "--nofork", "--print-address"],
                              self.environment)
        self.environment["DBUS_SESSION_BUS_ADDRESS"] = bus.next_line(20.0) or ""

    def pixels(self):
        """(width, height, RGB bytes) of what the screen shows, with the mouse's arrow."""
        data = (self._memory / "Xvfb_screen0").read_bytes()  # a picture in the format of xwd
        header = struct.unpack(">25I", data[:100])
        first, width, height, line, colours = header[0], header[4], header[5], header[12], header[19]
        start = first + 12 * colours
        rows = b"".join(data[start + y * line:start + y * line + 4 * width] for y in range(height))
        rgb = bytearray(3 * width * height)
        for channel in range(3):
            rgb[channel::3] = rows[2 - channel::4]
        return width, height, bytes(rgb)


def write_png(file: Path, picture):
    width, height, rgb = picture
    rows = b"".join(b"\0" + rgb[3 * width * y:3 * width * (y + 1)] for y in range(height))

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows, 6)) + chunk(b"IEND", b""))


def share_that_differs(one, other, place):
    """Of the pixels within `place`, an (x, y, width, height) of the screen."""
    x, y, width, height = place
    differing = 0
    for row in range(y, y + height):
        begin, end = 3 * (one[0] * row + x), 3 * (one[0] * row + x + width)
        a, b = one[2][begin:end], other[2][begin:end]
        if a != b:
            differing += sum(a[i:i + 3] != b[i:i + 3] for i in range(0, len(a), 3))
    return differing / (width * height)


class Hands:
    """On the mouse and the keys, by xdotool. Counts the presses of the left and right button."""

    def __init__(self, environment):
        self._environment = environment
        self._at = (0, 0)
        self.clicks = 0

    def _do(self, *words):
        done = subprocess.run(["xdotool", *map(str, words)], env=self._environment, capture_output=True,
                              encoding="utf-8", timeout=60, check=False)
        if done.returncode != 0:
            raise Failure(f"xdotool {' '.join(map(str, words))} failed:", done.stderr.strip())
        return done.stdout

    def move(self, to, steps=12):
        words = []
        for step in range(1, steps + 1):
            words += ["mousemove", *(round(a + (b - a) * step / steps) for a, b in zip(self._at, to)), "sleep", "0.02"]
        self._do(*words)
        self._at = to

    def press(self):
        self.clicks += 1
        self._do("mousedown", 1)

    def release(self):
        self._do("mouseup", 1)

    def click(self, at=None):
        if at is not None:
            self.move(at)
        self.press()
        time.sleep(0.05)
        self.release()

    def drag(self, start, to, button):
        self.move(start)
        self._do("mousedown", button)
        self.move(to)
        self._do("mouseup", button)

    def wheel(self, notches):
        """Up: positive."""
        self._do("click", "--repeat", abs(notches), "--delay", 40, 4 if notches > 0 else 5)

    def keys(self, *keys):
        self._do("key", *keys)

    def type(self, text):
        self._do("type", "--delay", 15, text)

    def titles(self):
        """Of all windows on the screen."""
        titles = []
        found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", "."], env=self._environment,
                               capture_output=True, encoding="utf-8", timeout=60, check=False)
        for window in found.stdout.split():
            named = subprocess.run(["xdotool", "getwindowname", window], env=self._environment, capture_output=True,
                                   encoding="utf-8", errors="replace", timeout=60, check=False)
            titles.append(named.stdout.rstrip("\n"))
        return titles


class Eyes:
    """Reads a program's window. A node is the (bus name, path) of a part of it. Made before the program starts, because
    the first question starts the accessibility bus."""

    SHOWING = 1 << 25
    ACCESSIBLE = "org.a11y.atspi.Accessible"

    def __init__(self, session_address, patience_s=20.0):
        import dbus
        import dbus.bus
        self._error = dbus.DBusException
        deadline = time.monotonic() + patience_s
        while True:
            try:
                session = dbus.bus.BusConnection(session_address)
                address = session.call_blocking("org.a11y.Bus", "/org/a11y/bus", "org.a11y.Bus", "GetAddress", "", ())
                break
            except self._error as error:
                if time.monotonic() > deadline:
                    raise Failure("the accessibility bus does not start:", str(error)) from error
                time.sleep(0.2)
        self._bus = dbus.bus.BusConnection(str(address))

    def _ask(self, node, method, signature="", *arguments, interface=ACCESSIBLE):
        return self._bus.call_blocking(*node, interface, method, signature, arguments, timeout=30.0)

    def _get(self, node, what):
        return str(self._ask(node, "Get", "ss", self.ACCESSIBLE, what, interface="org.freedesktop.DBus.Properties"))

    def name(self, node):
        return self._get(node, "Name")

    def description(self, node):
        return self._get(node, "Description")

    def children(self, node):
        return [(str(bus), str(path)) for bus, path in self._ask(node, "GetChildren")]

    def is_showing(self, node):
        return bool(int(self._ask(node, "GetState")[0]) & self.SHOWING)

    def place(self, node):
        """(x, y, width, height) on the screen."""
        return tuple(map(int, self._ask(node, "GetExtents", "u", 0, interface="org.a11y.atspi.Component")))

    def middle(self, node):
        x, y, width, height = self.place(node)
        return x + width // 2, y + height // 2

    def walk(self, node=("org.a11y.atspi.Registry", "/org/a11y/atspi/accessible/root"), inside=()):
        """(node, role, name, roles of what it is in) of a node and all that it consists of."""
        try:
            role, name = str(self._ask(node, "GetRoleName")), self.name(node)
            yield node, role, name, inside
            parts = self.children(node)
        except self._error:
            return  # it has gone meanwhile
        for part in parts:
            if part != node:
                yield from self.walk(part, (*inside, role))

    def find(self, name, role=None, inside=None, showing=True, nth=0):
        """The node of this name. `role`, `inside`: roles, or parts of them, to tell it from others. None: not there."""
        for node, its_role, its_name, around in self.walk():
            if its_name != name or (role is not None and role not in its_role):
                continue
            if inside is not None and not any(inside in one for one in around):
                continue
            if showing and not self.is_showing(node):
                continue
            if nth == 0:
                return node
            nth -= 1
        return None

    def after(self, name, role="label"):
        """The node that follows the label of this name: the value beside it."""
        found = False
        for node, its_role, its_name, _ in self.walk():
            if found:
                return node
            found = its_name == name and role in its_role
        return None

    def statuses(self):
        """Nodes of status bars."""
        return [node for node, role, _, _ in self.walk() if "status" in role]
