#include "tests/support/authentication/people.hpp"

#include <algorithm>
#include <fstream>
#include <list>
#include <stdexcept>

#include "tests/support/content.hpp"
#include "tests/support/process.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;

void make_certificates(const fs::path& into, const std::vector<std::string>& arguments) {
  std::vector<std::string> all{"--into", into};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const RunResult made = run(OSTEON_CERTS, all);
  if (made.exit_code != 0) throw std::runtime_error("deploy/certs failed: " + made.err);
}

}  // namespace

// An authority, its server and its people, as deploy/certs made them, and as no test has changed them.
struct People::Made {
  Made() {
    make_certificates(folder(), {"authority"});
    make_certificates(folder(), {"server", "127.0.0.1", "localhost"});
  }
  [[nodiscard]] fs::path folder() const { return dir / "certs"; }
  TempDir dir;
  bool taken = false;
};

// The first that no living People has, so that two of them at once have different authorities.
People::Made& People::take_made() {
  static std::list<Made> all;
  const auto free = std::ranges::find(all, false, &Made::taken);
  Made& made = free != all.end() ? *free : all.emplace_back();
  made.taken = true;
  return made;
}

People::People() : made_(take_made()) {
  fs::create_directories(certificates());
  fs::copy(made_.folder() / "authority", authority(), fs::copy_options::recursive);
  fs::copy(made_.folder() / "server", server(), fs::copy_options::recursive);
  // Nobody has a certificate of this authority yet.
  for (const auto& file : fs::directory_iterator(made_.folder() / "authority"))
    if (file.path().filename().string().starts_with("serials-")) fs::remove(authority() / file.path().filename());
}

People::~People() { made_.taken = false; }

void People::certs(const std::vector<std::string>& arguments) { make_certificates(certificates(), arguments); }

fs::path People::person(const std::string& name) {
  const fs::path part = fs::path("people") / name, serials = fs::path("serials-" + name);
  const fs::path folder = certificates() / part;
  if (fs::exists(folder)) return folder;
  if (!fs::exists(made_.folder() / part)) make_certificates(made_.folder(), {"person", name});
  fs::create_directories(folder.parent_path());
  fs::copy(made_.folder() / part, folder, fs::copy_options::recursive);
  fs::copy(made_.folder() / "authority" / serials, authority() / serials);
  return folder;
}

TicketKey People::key() const { return parse_ticket_key(content(ticket_key())).value(); }

std::filesystem::path People::ticket_file(const std::string& text) {
  const std::filesystem::path file = dir_ / ("ticket-" + std::to_string(++tickets_));
  std::ofstream(file) << text << "\n";
  return file;
}

std::filesystem::path People::ticket(const std::string& user, const std::string& room, Role role,
                                     std::chrono::seconds good_for) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  return ticket_file(sign_ticket(make_ticket(room, user, role, now + good_for).value(), key()));
}

wire::ClientCredentials People::credentials(const std::string& name, Role role, const std::string& room) {
  return {.certificates = person(name), .ticket = ticket(name, room, role)};
}

void People::append_access(const std::string& line) {
  const std::filesystem::path file = server() / "access.txt";
  const std::string before = content(file);
  std::ofstream(dir_ / "access.new") << before << line << "\n";
  std::filesystem::rename(dir_ / "access.new", file);
}

}  // namespace osteon::test
