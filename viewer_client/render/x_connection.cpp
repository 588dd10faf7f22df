#include "viewer_client/render/x_connection.hpp"

#include <X11/Xlib.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>

namespace osteon {

void XConnection::Close::operator()(void* display) const { XCloseDisplay(static_cast<::Display*>(display)); }

XConnection::XConnection(Display display) : display_(std::move(display)) {}

Result<XConnection> XConnection::open() {
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0') {
    return failure(ErrorCode::not_found,
                   "there is no screen to draw on: set DISPLAY to an X server's display, or start the program with "
                   "`xvfb-run -a`");
  }
  ::Display* display = XOpenDisplay(name);
  // An X server that has just lost its last client may need a moment.
  for (int attempt = 0; display == nullptr && attempt < 10; ++attempt) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    display = XOpenDisplay(name);
  }
  if (display == nullptr) {
    return failure(ErrorCode::not_found, "the X display " + std::string(name) +
                                             " named by DISPLAY cannot be opened: correct DISPLAY, or start the "
                                             "program with `xvfb-run -a`");
  }
  XConnection connection{Display(display)};
  int opcode = 0, event = 0, error = 0;
  const bool has_gl = XQueryExtension(display, "GLX", &opcode, &event, &error) != 0;
  if (!has_gl) {
    return failure(ErrorCode::not_found, "the X display " + std::string(name) +
                                             " has no OpenGL (GLX): use one that has, or start the program with "
                                             "`xvfb-run -a`");
  }
  return connection;
}

}  // namespace osteon
