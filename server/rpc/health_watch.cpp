#include "server/rpc/health_watch.hpp"

#include <grpcpp/health_check_service_interface.h>

#include <chrono>

#include "server/rooms/rooms.hpp"

namespace osteon {
namespace {

constexpr std::chrono::milliseconds kLookEvery{200};

}  // namespace

HealthWatch::HealthWatch(const Rooms& rooms, grpc::HealthCheckServiceInterface& service, Of of)
    : rooms_(rooms), service_(service), of_(of) {
  look();
  thread_ = std::thread([this] {
    MutexLock lock(mutex_);
    while (!wake_.wait_for(lock, kLookEvery, [this]() OSTEON_REQUIRES(mutex_) { return end_; })) {
      lock.unlock();
      look();
      lock.lock();
    }
  });
}

HealthWatch::~HealthWatch() {
  {
    const MutexLock lock(mutex_);
    end_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

void HealthWatch::look() {
  const MutexLock lock(mutex_);
  const bool open = !rooms_.draining();
  std::map<std::string, bool> now;
  // A removed name is reported as not serving. The service does not know names that never existed.
  for (const auto& [name, serving] : published_) now[name] = false;
  now[""] = open;
  if (of_ == Of::server_and_rooms)
    for (const std::shared_ptr<OpenRoom>& room : rooms_.open_rooms())
      now[room->name] = open && !room->runtime().stopped();
  for (const auto& [name, serving] : now)
    if (const auto before = published_.find(name); before == published_.end() || before->second != serving)
      service_.SetServingStatus(name, serving);
  published_ = std::move(now);
}

}  // namespace osteon
