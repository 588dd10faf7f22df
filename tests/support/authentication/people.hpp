// An authority of a test's own, a server and people with certificates of it, and tickets: made by deploy/certs, as for
// others.
#pragma once
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "common/access/ticket.hpp"
#include "common/wire/credentials.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

class People {
 public:
  People();  // with a server that is reached as 127.0.0.1 and localhost

  [[nodiscard]] std::filesystem::path server() const { return dir_ / "certs" / "server"; }
  [[nodiscard]] std::filesystem::path ticket_key() const { return dir_ / "certs" / "authority" / "tickets.key"; }
  [[nodiscard]] std::filesystem::path folder() const { return dir_.path(); }
  // The folder of that person's certificate, made where it is not there.
  [[nodiscard]] std::filesystem::path person(const std::string& name);
  // A file with a ticket.
  [[nodiscard]] std::filesystem::path ticket(const std::string& user, const std::string& room, Role role,
                                             std::chrono::seconds good_for = std::chrono::hours(1));
  [[nodiscard]] std::filesystem::path ticket_file(const std::string& text);
  // The credentials of somebody with a ticket of their own.
  [[nodiscard]] wire::ClientCredentials credentials(const std::string& name, Role role, const std::string& room);
  // What deploy/certs says; fails the test where it fails.
  void certs(const std::vector<std::string>& arguments);
  // A line more in the server's list of who was revoked and whose role has changed.
  void append_access(const std::string& line);
  [[nodiscard]] TicketKey key() const;

 private:
  TempDir dir_;
  int tickets_ = 0;
};

}  // namespace osteon::test
