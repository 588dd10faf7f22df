// Serves figures of a server and its rooms to Prometheus, as text over HTTP, to this machine alone.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "common/core/result.hpp"

namespace osteon {

class RoomServer;

// Gathers figures when they are requested; between two requests this costs nothing.
class Metrics {
 public:
  // `listen`: PORT or HOST:PORT; 0 lets the system choose. `certificate`: the server's; empty: none. `server` outlives
  // this object. Errors: invalid_input (not HOST:PORT, or reachable from other machines), unavailable (the system
  // refuses).
  [[nodiscard]] static Result<std::unique_ptr<Metrics>> start(const std::string& listen, RoomServer& server,
                                                              const std::filesystem::path& certificate);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  [[nodiscard]] const std::string& address() const;  // HOST:PORT with the real port; the path is /metrics

 private:
  struct Impl;
  explicit Metrics(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
