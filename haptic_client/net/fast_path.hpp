// The client's end of the fast path on a real socket: a thread that sends and receives sealed datagrams beside the
// stream.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/result.hpp"
#include "common/link/sealed.hpp"
#include "common/link/udp_port.hpp"
#include "common/wire/client_link.hpp"
#include "haptic_client/net/room_session.hpp"

namespace osteon {

// What a fast path calls, on its own thread.
struct FastPathEvents {
  std::function<void(wire::IndexedEntry)> entry;  // of the session, in order
  // Datagrams do not get through any more, so that what went only in them has to go over the stream.
  std::function<void()> dead;
  std::function<void(const CuttingState&)> partner{};  // a newer state of another's tool
  std::function<void(const MountPose&)> bone{};        // a newer place of the bone on its mount
  // Whether the newest datagram says that the hand may not cut, where that has changed or the lease's epoch has.
  std::function<void(std::uint64_t lease_epoch, bool frozen)> stop_flag{};
};

// One for each stream: keys and numbers begin anew with it. Any thread, except from within what it calls.
class FastPath {
 public:
  // Error: not_found (the server's name), unavailable (no socket).
  [[nodiscard]] static Result<std::unique_ptr<FastPath>> open(const std::string& host, std::uint16_t port,
                                                              const SessionKeys& keys, std::uint64_t first_author_seq,
                                                              FastPathEvents events);
  ~FastPath();  // stops
  // Nothing is called any more once it returns; not from within what is called.
  void stop();
  FastPath(const FastPath&) = delete;
  FastPath& operator=(const FastPath&) = delete;

  // Every cut in order, and again where it was not decided. False: it has to go over the stream.
  [[nodiscard]] bool send(const Cut& cut);
  [[nodiscard]] bool send(const CuttingState& state);
  [[nodiscard]] bool send(const MountLoad& push);
  // What came over the stream: an entry, and the newest own cut that is decided.
  void heard(std::uint64_t index);
  void decided(std::uint64_t author_seq);
  void know_tool(std::uint32_t number, const Digest& tool);
  [[nodiscard]] FastPathHealth health() const;

 private:
  FastPath(std::unique_ptr<UdpPort> port, const Endpoint& server, const SessionKeys& keys,
           std::uint64_t first_author_seq, FastPathEvents events);
  void run();
  // What of others' tools is newer than what was told of them.
  void take_partners(wire::ClientLink::Time now, std::vector<CuttingState>& newer);

  const std::unique_ptr<UdpPort> port_;
  const Endpoint server_;
  const FastPathEvents events_;
  mutable std::mutex mutex_;
  wire::ClientLink link_;
  std::uint64_t pushed_;                        // newest cut that the link was given
  std::map<AuthorId, std::uint64_t> partners_;  // state_seq of what was told of each; of its thread
  bool end_ = false;
  std::thread thread_;
};

}  // namespace osteon
