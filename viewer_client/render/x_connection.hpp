// The connection to an X server with OpenGL. Its user draws on that server.
#pragma once
#include <memory>

#include "common/core/result.hpp"

namespace osteon {

class XConnection {
 public:
  // Connects to the server that DISPLAY names. Waits up to half a second for a server that restarts. Error not_found:
  // DISPLAY is empty, the server cannot be reached, or it has no OpenGL; the message says how to help.
  [[nodiscard]] static Result<XConnection> open();

 private:
  struct Close {
    void operator()(void* display) const;
  };
  using Display = std::unique_ptr<void, Close>;

  explicit XConnection(Display display);

  Display display_;
};

}  // namespace osteon
