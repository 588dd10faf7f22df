#include "server/rpc/call_flood.hpp"

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/server_interceptor.h>

#include <algorithm>
#include <utility>

namespace osteon {
namespace {

using grpc::experimental::InterceptionHookPoints;

class FloodWatch final : public grpc::experimental::Interceptor {
 public:
  FloodWatch(CallFlood& flood, const Flooded& flooded, grpc::experimental::ServerRpcInfo& call)
      : flood_(flood), flooded_(flooded), call_(call) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      const PeerClaims peer = peer_claims(*call_.server_context());
      const std::string& whose = peer.certificate_pem.empty() ? peer.peer : peer.certificate_pem;
      if (!flood_.take(whose, std::chrono::steady_clock::now())) flooded_(peer);
    }
    methods->Proceed();
  }

 private:
  CallFlood& flood_;
  const Flooded& flooded_;
  grpc::experimental::ServerRpcInfo& call_;
};

class FloodWatchMaker final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  FloodWatchMaker(CallFlood& flood, Flooded flooded) : flood_(flood), flooded_(std::move(flooded)) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* call) override {
    return new FloodWatch(flood_, flooded_, *call);  // gRPC deletes it
  }

 private:
  CallFlood& flood_;
  const Flooded flooded_;
};

}  // namespace

bool CallFlood::take(const std::string& whose, Time now) {
  const MutexLock lock(mutex_);
  const auto left_at = [&](const Bucket& bucket) {
    const double waited = std::chrono::duration<double>(now - bucket.when).count();
    return std::min(limit_.at_once, bucket.left + limit_.per_second * std::max(waited, 0.0));
  };
  auto found = buckets_.find(whose);
  if (found == buckets_.end()) {
    if (buckets_.size() >= kMost)
      std::erase_if(buckets_, [&](const auto& entry) { return left_at(entry.second) >= limit_.at_once; });
    if (buckets_.size() >= kMost) buckets_.clear();
    found = buckets_.emplace(whose, Bucket{limit_.at_once, now}).first;
  }
  Bucket& bucket = found->second;
  bucket.left = left_at(bucket);
  bucket.when = std::max(bucket.when, now);
  if (bucket.left < 1.0) return false;
  bucket.left -= 1.0;
  return true;
}

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> flood_watch(CallFlood& flood, Flooded flooded) {
  return std::make_unique<FloodWatchMaker>(flood, std::move(flooded));
}

}  // namespace osteon
