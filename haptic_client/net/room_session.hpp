// The haptic client's connection to its room. It joins and fetches the case once. Then it sends cuts and states, and
// receives the field, everyone's committed cuts, and rejections.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/field_hash.hpp"
#include "common/tools/tool_box.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_cache.hpp"
#include "common/wire/room_client.hpp"
#include "haptic_client/net/room_messages.hpp"
#include "haptic_client/net/room_port.hpp"

namespace osteon {

struct RoomSessionOptions {
  std::string address;  // HOST:PORT
  std::string room{};   // name of the server's room; empty: the only one that is open
  wire::ClientCredentials credentials{};
  std::string name{};  // shown to others, and the identity over plain text; empty: a new identity each time
  std::chrono::milliseconds patience{5000};
  std::filesystem::path cache = default_case_cache();  // one folder per case, named by its hash
  // Sealed datagrams beside the stream: to the port that the server names, to this HOST:PORT instead, or "off".
  std::string fast_path{};
};

class RoomSession final : public RoomPort {
 public:
  // Number of undecided cuts from which send() refuses more.
  static constexpr std::size_t kMaxWaitingCuts = 1024;

  // Joins, and fetches the case unless it is cached. Also fetches the tools that the room knows and this program does
  // not. Errors: those of wire::join_room; those of Case::load for a fetched case; internal (the cache cannot be
  // written).
  [[nodiscard]] static Result<RoomSession> join(const RoomSessionOptions& options, const std::function<bool()>& stop);
  ~RoomSession() override;  // closes
  RoomSession(RoomSession&&) noexcept;
  RoomSession& operator=(RoomSession&&) noexcept;

  // As first joined: the author of all cuts and states, epochs, bounds.
  [[nodiscard]] const wire::JoinedRoom& room() const;
  [[nodiscard]] const Case& bone() const;
  [[nodiscard]] const std::shared_ptr<ToolBox>& tools() const;  // known to the room; grows with its events
  [[nodiscard]] Result<std::uint32_t> set_item(const SceneItem& item) override;

  // Opens the stream; call it once. From now on `callbacks` are called.
  void open(RoomCallbacks callbacks);
  // Refuses a cut when kMaxWaitingCuts are undecided or the session is lost.
  [[nodiscard]] bool send(const Cut& cut) override;
  void send(const CuttingState& state) override;
  // Where datagrams do not get through, 30 a second are sent.
  void send(const MountLoad& push) override;
  [[nodiscard]] FastPathHealth fast_path() const override;
  // Sends what is waiting, for at most a second, ends the stream, and joins the thread. A second call does nothing.
  void close();

 private:
  struct Impl;
  explicit RoomSession(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
