#include "tests/support/content.hpp"
#include "tests/support/doors/people.hpp"

#include <fstream>
#include <stdexcept>

#include "tests/support/process.hpp"

namespace osteon::test {
People::People() {
  certs({"authority"});
  certs({"server", "127.0.0.1", "localhost"});
}

void People::certs(const std::vector<std::string>& arguments) {
  std::vector<std::string> all{"--into", dir_ / "certs"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const RunResult made = run(OSTEON_CERTS, all);
  if (made.exit_code != 0) throw std::runtime_error("deploy/certs failed: " + made.err);
}

std::filesystem::path People::person(const std::string& name) {
  const std::filesystem::path folder = dir_ / "certs" / "people" / name;
  if (!std::filesystem::exists(folder)) certs({"person", name});
  return folder;
}

TicketKey People::key() const { return parse_ticket_key(content(ticket_key())).value(); }

std::filesystem::path People::ticket_file(const std::string& text) {
  const std::filesystem::path file = dir_ / ("ticket-" + std::to_string(++tickets_));
  std::ofstream(file) << text << "\n";
  return file;
}

std::filesystem::path People::ticket(const std::string& user, const std::string& room, Role role, std::chrono::seconds good_for) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  return ticket_file(sign_ticket(make_ticket(room, user, role, now + good_for).value(), key()));
}

wire::Door People::door(const std::string& name, Role role, const std::string& room) {
  return {.certificates = person(name), .ticket = ticket(name, room, role)};
}

void People::append_access(const std::string& line) {
  const std::filesystem::path file = server() / "access.txt";
  const std::string before = content(file);
  std::ofstream(dir_ / "access.new") << before << line << "\n";
  std::filesystem::rename(dir_ / "access.new", file);
}

}  // namespace osteon::test
