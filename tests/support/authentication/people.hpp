// A certificate authority for one test, with a server, people and tickets. deploy/certs makes them, as for users. That
// takes a second, so a process makes them once, and each test gets a copy.
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
  // [test's thread, as all] The server's names are 127.0.0.1 and localhost. Two at once have different authorities.
  People();
  ~People();
  People(const People&) = delete;
  People& operator=(const People&) = delete;

  [[nodiscard]] std::filesystem::path server() const { return certificates() / "server"; }
  [[nodiscard]] std::filesystem::path ticket_key() const { return authority() / "tickets.key"; }
  [[nodiscard]] std::filesystem::path folder() const { return dir_.path(); }
  // The folder of that person's certificate. It is made if it does not exist.
  [[nodiscard]] std::filesystem::path person(const std::string& name);
  // A file with a ticket.
  [[nodiscard]] std::filesystem::path ticket(const std::string& user, const std::string& room, Role role,
                                             std::chrono::seconds good_for = std::chrono::hours(1));
  [[nodiscard]] std::filesystem::path ticket_file(const std::string& text);
  // The credentials of a person, with a new ticket.
  [[nodiscard]] wire::ClientCredentials credentials(const std::string& name, Role role, const std::string& room);
  // Runs deploy/certs and returns its output. Fails the test if it fails.
  void certs(const std::vector<std::string>& arguments);
  // Appends a line to the server's list of revocations and changed roles.
  void append_access(const std::string& line);
  [[nodiscard]] TicketKey key() const;

 private:
  struct Made;
  [[nodiscard]] static Made& take_made();
  [[nodiscard]] std::filesystem::path certificates() const { return dir_ / "certs"; }
  [[nodiscard]] std::filesystem::path authority() const { return certificates() / "authority"; }

  Made& made_;
  TempDir dir_;
  int tickets_ = 0;
};

}  // namespace osteon::test
