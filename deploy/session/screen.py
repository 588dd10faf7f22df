"""The screen of a session, and the window `osteon` on it. As a program: exit code 0 if the display in DISPLAY opens."""
import ctypes
import os
import sys

from processes import Failure, Household

WINDOW_PATIENCE_S = 10.0


def start_screen(household: Household, size="1280x720", virtual=False):
    """The environment to draw in and its name: the caller's display, or a virtual one of this session."""
    environment = dict(os.environ)
    opens = display_opens()
    if opens and not virtual:
        return environment, "a window on your display"
    xvfb = household.start("Xvfb", ["Xvfb", "-displayfd", "1", "-screen", "0", f"{size}x24", "-nolisten", "tcp",
                                    "-noreset"])
    number = xvfb.next_line(20.0)
    if not number:
        raise Failure("Xvfb, the virtual screen, did not start; its last lines:", xvfb.last_words())
    for name in ("WAYLAND_DISPLAY", "XAUTHORITY"):
        environment.pop(name, None)
    environment.update(DISPLAY=f":{number.strip()}", LIBGL_ALWAYS_SOFTWARE="1")
    return environment, "a virtual screen" + ("" if opens else ", since no display opens")


def display_opens():
    """Whether the display in DISPLAY accepts us. It may be stale, or refuse."""
    if not os.environ.get("DISPLAY"):
        return False
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if display:
        x11.XCloseDisplay(display)
    return bool(display)


class Watcher:
    """The window `osteon` on the caller's display, which watches the session's room. The session does not need it: the
    user may close it at any time. `shown` false: there is no window."""

    def __init__(self, household, programs, address, credentials, say, shown=True):
        self._say, self._child, self._stays = say, None, sys.stdin.isatty()
        if not shown:
            return
        self._child = household.start("osteon", [programs / "osteon", "--server", address, *credentials, "--watch"])
        self._child.may_end = True
        say("Window: osteon on your display shows the work. A drag with the mouse turns the bone. It "
            + ("stays open after the work." if self._stays else "closes when the work is done."))

    def check(self):
        """Says it once if the window is gone."""
        if self._child is None or self._child.exit_code is None:
            return
        words = "" if self._child.exit_code == 0 else f" Its last lines:\n{self._child.last_words()}"
        self._say(f"The window is closed; the demo goes on without it.{words}")
        self._child = None

    def wait_until_closed(self):
        """After the work a user at a terminal looks at the bone. Without one, the window closes at once."""
        self.check()
        if self._child is not None and self._stays:
            self._say("The work is done. Turn the bone to see all its sides. Close the window, or press Ctrl-C, for "
                      "the report.")
            try:
                while self._child.wait(3600.0) is None:
                    pass
            except KeyboardInterrupt:
                self._say("")  # the terminal has written ^C
        if self._child is not None:
            self._child.end(WINDOW_PATIENCE_S)
        self._child = None


if __name__ == "__main__":
    sys.exit(0 if display_opens() else 1)
