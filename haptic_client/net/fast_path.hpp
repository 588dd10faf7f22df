// The client's end of the fast path, with a real socket. A thread sends and receives sealed datagrams beside the
// stream.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "common/link/sealed.hpp"
#include "common/link/udp_port.hpp"
#include "common/wire/client_link.hpp"
#include "haptic_client/net/room_session.hpp"

namespace osteon {

// Functions that a fast path calls, on its own thread.
struct FastPathEvents {
  std::function<void(wire::IndexedEntry)> entry;  // a log entry of the session, in the order of arrival
  // Datagrams no longer get through. What was sent only in them has to be sent over the stream.
  std::function<void()> dead;
  std::function<void(const CuttingState&)> partner{};  // a newer state of a partner's tool
  std::function<void(const MountPose&)> bone{};        // a newer pose of the bone on its mount
  // Whether the newest datagram says that the hand may not cut. Called when that or the lease's epoch has changed.
  std::function<void(std::uint64_t lease_epoch, bool frozen)> stop_flag{};
};

// One for each stream, which has its own keys and numbers. Any thread may call it, but not from its own callbacks.
class FastPath {
 public:
  // Error: not_found (the server's name), unavailable (no socket).
  [[nodiscard]] static Result<std::unique_ptr<FastPath>> open(const std::string& host, std::uint16_t port,
                                                              const SessionKeys& keys, std::uint64_t first_author_seq,
                                                              FastPathEvents events);
  ~FastPath();  // stops
  // After it returns nothing is called any more. Do not call it from within a called function.
  void stop();
  FastPath(const FastPath&) = delete;
  FastPath& operator=(const FastPath&) = delete;

  // Sends every cut in order, and again while it is undecided. False: it has to be sent over the stream.
  [[nodiscard]] bool send(const Cut& cut);
  [[nodiscard]] bool send(const CuttingState& state);
  [[nodiscard]] bool send(const MountLoad& push);
  // What was received over the stream: a log entry, and the newest own cut that is decided.
  void received(std::uint64_t index);
  void decided(std::uint64_t author_seq);
  void know_tool(std::uint32_t number, const Digest& tool);
  [[nodiscard]] FastPathHealth health() const;

 private:
  FastPath(std::unique_ptr<UdpPort> port, const Endpoint& server, const SessionKeys& keys,
           std::uint64_t first_author_seq, FastPathEvents events);
  void run();
  // Collects states of partners' tools that are newer than those already passed on.
  void take_partners(wire::ClientLink::Time now, std::vector<CuttingState>& newer) OSTEON_REQUIRES(mutex_);

  const std::unique_ptr<UdpPort> port_;
  const Endpoint server_;
  const FastPathEvents events_;
  mutable Mutex mutex_{LockRank::leaf};
  wire::ClientLink link_ OSTEON_GUARDED_BY(mutex_);
  std::uint64_t pushed_ OSTEON_GUARDED_BY(mutex_);  // newest cut that the link was given
  // state_seq of each partner's last state passed on; used by the thread only.
  std::map<AuthorId, std::uint64_t> partners_;
  bool end_ OSTEON_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace osteon
