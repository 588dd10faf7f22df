#include "viewer_client/net/open_requests.hpp"

#include <grpcpp/client_context.h>

namespace osteon {

bool OpenRequests::add(grpc::ClientContext& context) {
  const MutexLock lock(mutex_);
  if (!over_) all_.insert(&context);
  return !over_;
}

void OpenRequests::remove(grpc::ClientContext& context) {
  const MutexLock lock(mutex_);
  all_.erase(&context);
}

void OpenRequests::cancel_all() {
  const MutexLock lock(mutex_);
  over_ = true;
  for (grpc::ClientContext* context : all_) context->TryCancel();
}

}  // namespace osteon
