// The room's end of all fast paths: one UDP socket and one thread for all sessions. Data that gets through here arrives
// sooner; the session's stream carries all of it too.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "common/link/sealed.hpp"
#include "common/link/udp_port.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/wire/server_link.hpp"

namespace osteon {

// One session's link as its owner uses it. Any thread may call it, except from within the receiver. Calls to the
// receiver come on the link server's thread.
class SessionLink {
 public:
  class Receiver {
   public:
    virtual ~Receiver() = default;
    // Cuts in order of their author_seq, whether they came over the link or by insert().
    virtual void take(Cut cut) = 0;
    virtual void take(CuttingState state) = 0;
    virtual void pushed(const MountLoad& /*push*/) {}  // the newest load on the compliant mount
    // The client has received all entries up to this one.
    virtual void arrived(std::uint64_t index) = 0;
  };

  SessionLink(const SessionKeys& keys, AuthorId author, std::uint64_t first_author_seq, Receiver& receiver);
  [[nodiscard]] const SessionKeys& keys() const { return keys_; }

  // A cut that came over the stream. The receiver gets it in order, within this call or later.
  void insert(const Cut& cut);
  // Takes every entry of the session in order, also those that go over the stream alone: see wire::ServerLink::enqueue.
  // Returns false if this entry goes over the stream alone.
  bool enqueue(std::uint64_t index, const wire::SessionEntry& entry);
  void know_tool(std::uint32_t number, const Digest& tool);
  // The newest states of others' tools. Returns false if nothing gets through now, so that the stream must carry them.
  bool set_partners(std::span<const CuttingState> partners);
  // The pose of the bone on its mount. Returns false as above.
  bool set_bone(const MountPose& seen);
  // The receiver is not called any more once this has returned.
  void close();

 private:
  friend class LinkServer;
  // What has arrived for the receiver, to be delivered without the lock.
  struct News {
    std::vector<Cut> cuts;
    std::optional<CuttingState> state;
    std::optional<MountLoad> push;
    std::uint64_t arrived = 0;
  };
  [[nodiscard]] News news() OSTEON_REQUIRES(mutex_);
  void say(News news) OSTEON_REQUIRES(delivery_mutex_);

  const SessionKeys keys_;
  const AuthorId author_;
  // Held while the receiver is called, so that its calls keep their order.
  Mutex delivery_mutex_{LockRank::link_delivery};
  Receiver* receiver_ OSTEON_GUARDED_BY(delivery_mutex_);
  Mutex mutex_{LockRank::leaf};
  wire::ServerLink link_ OSTEON_GUARDED_BY(mutex_);
  std::uint64_t arrived_ OSTEON_GUARDED_BY(mutex_) = 0;
  class LinkServer* server_ = nullptr;  // to wake its thread
};

struct LinkServerHealth {
  std::size_t links = 0, alive = 0;
  UdpPortCounts port;
  std::uint64_t unauthenticated = 0;  // datagrams that belong to no open session
};

class LinkServer {
 public:
  // `address`: numeric, as in UdpPortOptions. `port` 0: the system chooses. Errors: those of UdpPort::open.
  [[nodiscard]] static Result<std::unique_ptr<LinkServer>> open(const std::string& address, std::uint16_t port = 0);
  ~LinkServer();
  LinkServer(const LinkServer&) = delete;
  LinkServer& operator=(const LinkServer&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_->local().port; }
  // Adds a link with its own keys. It receives datagrams until it is removed.
  [[nodiscard]] std::shared_ptr<SessionLink> add(AuthorId author, std::uint64_t first_author_seq,
                                                 SessionLink::Receiver& receiver);
  void remove(const std::shared_ptr<SessionLink>& link);
  void wake() { port_->wake(); }
  [[nodiscard]] LinkServerHealth health() const;

 private:
  explicit LinkServer(std::unique_ptr<UdpPort> port);
  void run();
  void receive_some(std::chrono::nanoseconds now);
  // Sends what is due. Returns when the next datagram is due.
  [[nodiscard]] std::chrono::nanoseconds send_due(std::chrono::nanoseconds now);
  [[nodiscard]] std::vector<std::shared_ptr<SessionLink>> links() const;

  const std::unique_ptr<UdpPort> port_;
  const FillRandom random_ = system_random();
  mutable Mutex mutex_{LockRank::leaf};
  std::map<std::uint32_t, std::shared_ptr<SessionLink>> links_ OSTEON_GUARDED_BY(mutex_);
  std::uint64_t unauthenticated_ OSTEON_GUARDED_BY(mutex_) = 0;
  bool end_ OSTEON_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace osteon
