// Tells grpc.health.v1 how the server and each of its rooms fare: "" is the server, the others are named as their
// rooms.
#pragma once
#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>

namespace grpc {
class HealthCheckServiceInterface;
}

namespace osteon {

class Rooms;

// SERVING while a room takes cuts, and the server lets people in; NOT_SERVING once a room was closed, its journal
// failed, or all is being drained. Looks several times a second, and at once when asked.
class HealthWatch {
 public:
  // Whoever has a certificate may ask grpc.health.v1, without a ticket. So a server with certificates names no room
  // there.
  enum class Of { server, server_and_rooms };
  // Both outlive it.
  HealthWatch(const Rooms& rooms, grpc::HealthCheckServiceInterface& service, Of of = Of::server_and_rooms);
  ~HealthWatch();
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;

  void look();

 private:
  const Rooms& rooms_;
  grpc::HealthCheckServiceInterface& service_;
  const Of of_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<std::string, bool> told_;  // serving or not, by name
  bool end_ = false;
  std::thread thread_;
};

}  // namespace osteon
