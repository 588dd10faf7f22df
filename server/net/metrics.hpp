// Figures of a server and its rooms for Prometheus, as text over HTTP to this machine alone.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "common/core/result.hpp"

namespace osteon {

class RoomServer;

// What is asked for is gathered when it is asked for: between two questions it costs nothing.
class Metrics {
 public:
  // `listen`: PORT or HOST:PORT, 0 lets the system choose. `certificate`: the server's, empty where it has none.
  // `server` outlives it. Errors: invalid_input (not HOST:PORT, or not of this machine alone), unavailable (the system
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
