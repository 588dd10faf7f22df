// Carries messages between a window's socket and the session of its pointer, on a thread of its own. It connects again
// whenever the window is away.
#pragma once
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "common/input/pointer_link.hpp"
#include "common/tools/tool.hpp"
#include "haptic_client/device/connection.hpp"
#include "haptic_client/simulation/pointer_session.hpp"

namespace osteon::haptic {

class PointerFeed {
 public:
  // Connects on the calling thread. Errors: those of PointerClient::connect().
  [[nodiscard]] static Result<std::unique_ptr<PointerFeed>> start(const std::filesystem::path& socket,
                                                                  DeviceNotice notice);
  ~PointerFeed();  // ends the thread

  [[nodiscard]] PointerExchange& exchange() { return exchange_; }
  // The tools of the session, by their index. Call this before the session's first tick.
  void set_tools(std::vector<Tool> tools);
  [[nodiscard]] int losses() const { return losses_; }
  // What has pushed by now: "mouse", "pen", "game pad".
  [[nodiscard]] std::vector<std::string_view> pushed() const;

 private:
  PointerFeed(std::filesystem::path socket, std::unique_ptr<PointerClient> client, DeviceNotice notice);
  void run();
  void command(const PointerInput& input);
  // Finds the tool and its law. What is not there, or does not fit, leaves both as they were, and becomes the trouble.
  void choose(const PointerInput& input);
  void report();

  const std::filesystem::path socket_;
  std::unique_ptr<PointerClient> client_;  // thread
  const DeviceNotice notice_;
  PointerExchange exchange_;
  std::atomic<bool> stop_ = false, ready_ = false;
  std::vector<Tool> tools_;              // fixed once ready_
  std::uint64_t number_ = 0;             // thread
  int tool_ = 0;                         // thread; as commanded last
  const ForceLaw* law_ = nullptr;        // thread; of that tool, as commanded last; null: its own
  std::string trouble_;                  // thread
  std::optional<PointerSource> pushes_;  // thread; at the last push
  std::atomic<unsigned> pushed_ = 0;     // a bit for each source
  std::atomic<int> losses_ = 0;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace osteon::haptic
