// The requests of a client that wait for an answer. Whoever ends the client cancels them here. Any thread.
#pragma once
#include <set>

#include "common/core/mutex.hpp"

namespace grpc {
class ClientContext;
}

namespace osteon {

class OpenRequests {
 public:
  // Before the call. False: cancel_all() was called, and the request must not begin.
  [[nodiscard]] bool add(grpc::ClientContext& context);
  void remove(grpc::ClientContext& context);
  // For good: no request begins from then on.
  void cancel_all();

 private:
  Mutex mutex_{LockRank::leaf};
  bool over_ OSTEON_GUARDED_BY(mutex_) = false;
  std::set<grpc::ClientContext*> all_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon
