// Reports the state of the server and of each room to grpc.health.v1. The name "" is the server; the other names are
// those of the rooms.
#pragma once
#include <map>
#include <string>
#include <thread>

#include "common/core/mutex.hpp"

namespace grpc {
class HealthCheckServiceInterface;
}

namespace osteon {

class Rooms;

// SERVING while a room takes cuts and the server admits clients. NOT_SERVING after a room was closed, its journal
// failed, or the server drains. Checks several times a second, and at once on request.
class HealthWatch {
 public:
  // Anybody with a certificate may ask grpc.health.v1 without a ticket. So a server with certificates does not name its
  // rooms there.
  enum class Of { server, server_and_rooms };
  // Both outlive this object.
  HealthWatch(const Rooms& rooms, grpc::HealthCheckServiceInterface& service, Of of = Of::server_and_rooms);
  ~HealthWatch();
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;

  void look();

 private:
  const Rooms& rooms_;
  grpc::HealthCheckServiceInterface& service_;
  const Of of_;
  Mutex mutex_{LockRank::health};
  CondVar wake_;
  std::map<std::string, bool> published_ OSTEON_GUARDED_BY(mutex_);  // whether serving, by name
  bool end_ OSTEON_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace osteon
