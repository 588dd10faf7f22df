// Limits how many calls a person may begin, whatever happens to the calls. HTTP/2 lets a client begin and reset calls
// without waiting (CVE-2023-44487, "rapid reset"). gRPC 1.51 counts none of them.
#pragma once
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>

#include "common/core/mutex.hpp"
#include "server/auth/peer_claims.hpp"

namespace grpc::experimental {
class ServerInterceptorFactoryInterface;
}

namespace osteon {

struct FloodLimit {
  double at_once = 150.0;     // calls; a client that calls GetStatus too often is refused after 100
  double per_second = 200.0;  // calls, in the long run; our busiest client makes 50
};

// Any thread may call it.
class CallFlood {
 public:
  using Time = std::chrono::steady_clock::time_point;
  explicit CallFlood(FloodLimit limit) : limit_(limit) {}
  // Counts a call that begins. `whose`: the certificate, or the connection if no certificate was shown. Returns false
  // when too many calls have begun.
  [[nodiscard]] bool take(const std::string& whose, Time now);

 private:
  static constexpr std::size_t kMost = 4096;  // buckets in memory
  struct Bucket {
    double left = 0.0;
    Time when{};
  };
  const FloodLimit limit_;
  Mutex mutex_{LockRank::leaf};
  std::unordered_map<std::string, Bucket> buckets_ OSTEON_GUARDED_BY(mutex_);  // by `whose`
};

// Called for each call that begins beyond the limit, before its handler runs.
using Flooded = std::function<void(const PeerClaims& peer)>;
// `flood` outlives the server.
[[nodiscard]] std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> flood_watch(CallFlood& flood,
                                                                                                 Flooded flooded);

}  // namespace osteon
