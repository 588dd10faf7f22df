// Tries with real servers every fault that prevents a connection. The client's and the server's sentences must stand in
// deploy/docs/troubleshooting.md, and no two faults may share a sentence.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <future>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/wire/connection_fault.hpp"
#include "common/wire/room_client.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/authentication/altered.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/authentication/proxy.hpp"
#include "tests/support/content.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr auto kDay = 24h;
constexpr auto kRefusalLimit = 10s;

// Makes a pattern of a text in which known words in capitals match anything.
std::regex pattern_of(const std::string& text) {
  static const std::set<std::string> kAnything{"ADDRESS", "DATE",  "DIR",    "FILE", "HOST",
                                               "NAME",    "NAMES", "REASON", "ROOM", "STATUS"};
  static const std::regex kWord("[A-Z]+|[^A-Z]");
  std::string pattern;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), kWord); at != std::sregex_iterator(); ++at) {
    const std::string word = at->str();
    if (kAnything.contains(word))
      pattern += ".+";
    else
      pattern += std::regex_replace(word, std::regex(R"([.\[\](){}*+?^$|\\])"), R"(\$&)");
  }
  return std::regex(pattern);
}

// A row of the page's tables.
struct Listed {
  std::string sentence, log;  // sentence: of the client, whole; log: of the server, empty: nothing
};

std::vector<Listed> listed() {
  std::ifstream in(OSTEON_TROUBLESHOOTING);
  std::vector<Listed> all;
  for (std::string line; std::getline(in, line);) {
    static const std::regex kEntry(R"(\| (.+) \| (.+) \| (.+) \| (.+) \|)");
    std::smatch cells;
    if (!std::regex_match(line, cells, kEntry) || cells[1] == "the client says") continue;
    all.push_back({cells[1].str() + "; " + cells[3].str(), cells[4] == "–" ? "" : cells[4].str()});
  }
  return all;
}

int loopback_socket(sockaddr_in& at, int waiting) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  at = {};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  EXPECT_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size), 0);
  if (waiting >= 0) {
    EXPECT_EQ(::listen(socket, waiting), 0);
  }
  return socket;
}

// A port of this machine on which something other than Osteon runs.
class OtherPort {
 public:
  enum class Kind { nobody, full, silent, answering };
  // `answer`: sent to anybody who connects and sends something, before the connection is closed.
  explicit OtherPort(Kind kind, std::string answer = {}) : answer_(std::move(answer)) {
    socket_ = loopback_socket(at_, kind == Kind::nobody ? -1 : kind == Kind::full ? 0 : 64);
    if (kind == Kind::full) fill();
    if (kind == Kind::answering) thread_ = std::thread([this] { answer_all(); });
  }
  ~OtherPort() {
    end_ = true;
    if (thread_.joinable()) thread_.join();
    for (const int one : filling_) ::close(one);
    ::close(socket_);
  }
  OtherPort(const OtherPort&) = delete;
  OtherPort& operator=(const OtherPort&) = delete;
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(ntohs(at_.sin_port)); }

 private:
  // Fills the queue of connections. As nobody accepts, the system drops what comes, like a machine that is off.
  void fill() {
    for (int i = 0; i < 4; ++i) {
      filling_.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
      (void)::connect(filling_.back(), reinterpret_cast<const sockaddr*>(&at_), sizeof at_);
    }
  }
  void answer_all() {
    while (!end_) {
      pollfd ready{socket_, POLLIN, 0};
      if (::poll(&ready, 1, 20) <= 0) continue;
      const int one = ::accept(socket_, nullptr, nullptr);
      char some[4096];
      if (::recv(one, some, sizeof some, 0) > 0) (void)::send(one, answer_.data(), answer_.size(), MSG_NOSIGNAL);
      ::shutdown(one, SHUT_WR);
      ::close(one);
    }
  }

  const std::string answer_;
  sockaddr_in at_{};
  int socket_ = -1;
  std::vector<int> filling_;
  std::atomic<bool> end_ = false;
  std::thread thread_;
};

class ConnectionFaults : public ::testing::Test {
 protected:
  // One fault: address and credentials of a client, and the server whose log also names the fault.
  struct Mistake {
    std::string what;
    std::string address;
    wire::ClientCredentials credentials;
    Process* server = nullptr;  // null: the server receives nothing of it
    std::string room = "room";
    std::chrono::milliseconds patience = 300ms;  // of the client; a fault of the connection takes all of it
  };
  // For a fault that the server answers to a call. A busy machine must not turn it into "too slowly".
  static constexpr std::chrono::milliseconds kUntilAnswered = 30s;

  // Another server of the same case, with a folder of certificates or with plain text.
  struct Served {
    std::unique_ptr<Process> process;
    std::string address;
  };
  Served serve(const std::string& name, std::vector<std::string> more) {
    const fs::path file = stage_ / (name + ".address");
    std::vector<std::string> arguments{"--case", stage_ / "case", "--address-file",
                                       file,     "--summary",     stage_ / (name + ".json")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Served served{std::make_unique<Process>(stage_.start("osteon-server", arguments)), {}};
    served.address = wait_for_address(file, 60s).value_or("127.0.0.1:1");
    return served;
  }
  // A server's folder for `host` from the other authority. No server uses it.
  fs::path folder_of_server(const std::string& name, const std::string& host) {
    others_.certs({"server", host});
    const fs::path copy = stage_ / (name + "-server");
    fs::copy(others_.server(), copy);
    return copy;
  }
  // A copy of a person's folder that a test can alter.
  fs::path copy_of(const std::string& person, const std::string& name) {
    const fs::path copy = stage_ / name;
    fs::copy(people_.person(person), copy);
    return copy;
  }
  wire::ClientCredentials with(const fs::path& folder, const std::string& user) {
    return {.certificates = folder, .ticket = people_.ticket(user, "room", Role::observer)};
  }
  static fs::path authority_of(const People& people) { return people.folder() / "certs" / "authority"; }
  static void put(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }
  static void openssl(const std::vector<std::string>& arguments) {
    const RunResult done = run("openssl", arguments);
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }

  std::vector<Mistake> without_a_server();
  std::vector<Mistake> of_the_server();
  std::vector<Mistake> of_the_client();
  std::vector<Mistake> of_files();
  std::vector<Mistake> of_tickets();

  // Tries all faults at the same time. Returns each client's sentence by the fault's name.
  static std::map<std::string, std::string> say_all(const std::vector<Mistake>& mistakes) {
    std::map<std::string, std::future<std::string>> saying;
    for (const Mistake& one : mistakes)
      saying[one.what] = std::async(std::launch::async, [&one] {
        const auto joined =
            wire::join_room(one.address, wire::ClientKind::viewer, "who", one.patience, {}, one.room, one.credentials);
        return joined ? std::string("it joined") : joined.error().message;
      });
    std::map<std::string, std::string> said;
    for (auto& [what, sentence] : saying) said[what] = sentence.get();
    return said;
  }

  People people_, others_;
  Stage stage_{12.0, {"--certificates", people_.server()}};
  Served plain_ = serve("plain", {"--plain"});
  Served dated_, early_, named_, of_a_person_, old_authority_;
  // A web server, a server with another kind of TLS, and one that is there but sends nothing.
  OtherPort nobody_{OtherPort::Kind::nobody}, full_{OtherPort::Kind::full}, silent_{OtherPort::Kind::silent},
      closing_{OtherPort::Kind::answering}, web_{OtherPort::Kind::answering, "HTTP/1.1 400 Bad Request\r\n\r\n"},
      tls_{OtherPort::Kind::answering, std::string("\x15\x03\x01\x00\x02\x02\x46", 7)};
};

std::vector<ConnectionFaults::Mistake> ConnectionFaults::without_a_server() {
  const wire::ClientCredentials anna = people_.credentials("anna", Role::observer, "room");
  return {{"no such host", "nowhere.invalid:50000", anna},
          {"not started", nobody_.address(), anna},
          {"machine off", full_.address(), anna},
          {"no route", "255.255.255.255:50000", anna},
          {"closes at once", closing_.address(), anna},
          {"says nothing", silent_.address(), anna},
          {"web server", web_.address(), anna},
          {"other TLS", tls_.address(), anna},
          {"certificate for plain text", plain_.address, anna, plain_.process.get()},
          {"plain text for certificates", stage_.address(), {}, &stage_.server()}};
}

std::vector<ConnectionFaults::Mistake> ConnectionFaults::of_the_server() {
  const wire::ClientCredentials eve = others_.credentials("eve", Role::observer, "room");
  const fs::path dated = folder_of_server("dated", "127.0.0.1"), early = folder_of_server("early", "127.0.0.1"),
                 named = folder_of_server("named", "sim.example"), person = folder_of_server("person", "127.0.0.1");
  resign(dated / "server.pem", authority_of(others_), -2 * kDay, -kDay);
  resign(early / "server.pem", authority_of(others_), kDay, 2 * kDay);
  put(person / "server.pem", content(others_.person("eve") / "person.pem"));
  put(person / "server.key", content(others_.person("eve") / "person.key"));
  dated_ = serve("dated", {"--certificates", dated});
  early_ = serve("early", {"--certificates", early});
  named_ = serve("named", {"--certificates", named});
  of_a_person_ = serve("person", {"--certificates", person});
  // Eve trusts another authority than the first server's. Anna's own copy of the right authority has expired.
  const fs::path old = copy_of("anna", "old-authority");
  resign(old / "ca.pem", authority_of(people_), -2 * kDay, -kDay);
  return {{"server expired", dated_.address, eve, dated_.process.get()},
          {"server not yet", early_.address, eve, early_.process.get()},
          {"server of another authority", stage_.address(), eve, &stage_.server()},
          {"server of another name", named_.address, eve, named_.process.get()},
          {"server of a person", of_a_person_.address, eve, of_a_person_.process.get()},
          {"authority expired", stage_.address(), with(old, "anna"), &stage_.server()}};
}

std::vector<ConnectionFaults::Mistake> ConnectionFaults::of_the_client() {
  const fs::path expired = copy_of("ben", "ben-expired"), early = copy_of("cleo", "cleo-early"),
                 foreign = stage_ / "foreign", server = copy_of("ben", "ben-server");
  resign(expired / "person.pem", authority_of(people_), -2 * kDay, -kDay);
  resign(early / "person.pem", authority_of(people_), kDay, 2 * kDay);
  fs::copy(others_.person("eve"), foreign);
  put(foreign / "ca.pem", content(people_.server() / "ca.pem"));
  put(server / "person.pem", content(people_.server() / "server.pem"));
  put(server / "person.key", content(people_.server() / "server.key"));
  const wire::ClientCredentials gone = people_.credentials("gone", Role::observer, "room");
  people_.certs({"revoke", "gone"});
  return {{"own expired", stage_.address(), with(expired, "ben"), &stage_.server()},
          {"own not yet", stage_.address(), with(early, "cleo"), &stage_.server()},
          {"own of another authority", stage_.address(), with(foreign, "eve"), &stage_.server()},
          {"own revoked", stage_.address(), gone, &stage_.server()},
          {"own of a server", stage_.address(), with(server, "ben"), &stage_.server()}};
}

std::vector<ConnectionFaults::Mistake> ConnectionFaults::of_files() {
  std::vector<Mistake> all;
  const auto altered = [&](const std::string& what) {
    all.push_back({what, stage_.address(), with(copy_of("dora", what), "dora")});
    return all.back().credentials.certificates;
  };
  const auto elsewhere = [&](const std::string& what, const fs::path& folder) {
    all.push_back({what, stage_.address(), with(folder, "dora")});
  };
  elsewhere("no folder", stage_ / "none");
  elsewhere("folder of the server", people_.server());
  elsewhere("folder of the authority", people_.folder() / "certs");
  fs::remove(altered("no certificate") / "person.pem");
  put(altered("empty key") / "person.key", "");
  const fs::path der = altered("binary certificate"), der_key = altered("binary key"), locked = altered("locked key"),
                 chain = altered("chain in the wrong order");
  openssl({"x509", "-in", people_.person("dora") / "person.pem", "-outform", "DER", "-out", der / "person.pem"});
  openssl({"pkey", "-in", people_.person("dora") / "person.key", "-outform", "DER", "-out", der_key / "person.key"});
  openssl({"pkey", "-in", people_.person("dora") / "person.key", "-aes256", "-passout", "pass:word", "-out",
           locked / "person.key"});
  put(altered("no certificate in it") / "person.pem", "anna\n");
  put(altered("no key in it") / "person.key", content(people_.person("dora") / "person.pem"));
  put(altered("another key") / "person.key", content(people_.person("anna") / "person.key"));
  put(chain / "person.pem", content(chain / "ca.pem") + content(chain / "person.pem"));
  put(altered("no authority") / "ca.pem", content(people_.server() / "server.pem"));
  return all;
}

std::vector<ConnectionFaults::Mistake> ConnectionFaults::of_tickets() {
  std::vector<Mistake> all;
  const auto ticket = [&](const std::string& what, const fs::path& file) -> Mistake& {
    // Each fault uses a person of its own, because the log has one line for a person and reason.
    const std::string person = "t" + std::to_string(all.size());
    return all.emplace_back(Mistake{.what = what,
                                    .address = stage_.address(),
                                    .credentials = {.certificates = people_.person(person), .ticket = file},
                                    .server = &stage_.server(),
                                    .patience = kUntilAnswered});
  };
  ticket("ticket expired", people_.ticket("t0", "room", Role::observer, -5s));
  ticket("ticket of somebody else", people_.ticket("anna", "room", Role::observer));
  ticket("ticket for another room", people_.ticket("t2", "theatre", Role::observer));
  ticket("ticket of another server", others_.ticket("t3", "room", Role::observer));
  ticket("half a ticket", people_.ticket_file("osteon1.AAAA.AAAA"));
  return all;
}

std::string lines_of(const std::map<std::string, std::string>& said) {
  std::string all;
  for (const auto& [what, sentence] : said) all += what + ": " + sentence + "\n";
  return all;
}

// True if a server's log refused somebody of this machine for that reason.
bool has_refusal(const std::string& log, const std::string& reason) {
  static const std::regex kRefused("refused who=[^\n]+ from=[^\n]*ipv4:127.0.0.1[^\n]* said=[^\n]*");
  const std::regex said = pattern_of(reason);
  for (auto at = std::sregex_iterator(log.begin(), log.end(), kRefused); at != std::sregex_iterator(); ++at)
    if (std::regex_search(at->str(), said)) return true;
  return false;
}

TEST_F(ConnectionFaults, AreEachASentenceOfItsOwnAtBothEnds) {
  std::vector<Mistake> mistakes;
  for (const auto& some : {without_a_server(), of_the_server(), of_the_client(), of_files(), of_tickets()})
    mistakes.insert(mistakes.end(), some.begin(), some.end());
  std::map<std::string, std::string> said = say_all(mistakes);
  said["slow"] =
      wire::connection_fault(stage_.address(), people_.credentials("anna", Role::observer, "room")).error.message;
  mistakes.push_back({"slow", stage_.address(), {}});
  const fs::path marked = people_.ticket_file(
      "\xef\xbb\xbf"
      "osteon1.AAAA.AAAA");
  EXPECT_EQ(wire::ticket_text({.certificates = {}, .ticket = marked}), "") << "a refusal here would end the client";
  const std::map<std::string, fs::path> tickets{{"no ticket", stage_ / "none"}, {"ticket of another encoding", marked}};
  for (const auto& [what, file] : tickets) {
    said[what] = wire::client_credentials({.plain = false, .certificates = people_.person("anna"), .ticket = file})
                     .error()
                     .message;
    mistakes.push_back({what, stage_.address(), {}});
  }

  const std::vector<Listed> page = listed();
  ASSERT_GT(page.size(), 30u) << OSTEON_TROUBLESHOOTING;
  std::set<std::size_t> met;
  for (const Mistake& one : mistakes) {
    const std::string& sentence = said[one.what];
    std::vector<std::size_t> fitting;
    for (std::size_t i = 0; i < page.size(); ++i)
      if (std::regex_match(sentence, pattern_of(page[i].sentence))) fitting.push_back(i);
    EXPECT_EQ(fitting.size(), 1u) << one.what << ": " << sentence;
    if (fitting.size() != 1) continue;
    EXPECT_TRUE(met.insert(fitting.front()).second) << one.what << " has the sentence of another: " << sentence;
    const std::string& log = page[fitting.front()].log;
    EXPECT_EQ(log.empty(), one.server == nullptr) << one.what;
    if (!one.server || log.empty()) continue;
    EXPECT_TRUE(wait_until([&] { return has_refusal(one.server->err(), log); }, kRefusalLimit))
        << one.what << ": " << log << "\n"
        << one.server->err();
    EXPECT_THAT(sentence, testing::Not(testing::HasSubstr(people_.server().string()))) << "a path of the server";
  }
  // Only a proxy sends the remaining ones.
  for (std::size_t i = 0; i < page.size(); ++i) {
    if (met.contains(i)) continue;
    EXPECT_THAT(page[i].sentence,
                testing::AnyOf(testing::HasSubstr("FILE, was revoked"), testing::HasSubstr("is a proxy")));
  }
  if (HasFailure()) ADD_FAILURE() << lines_of(said);
}

TEST_F(ConnectionFaults, AreTheSameSentencesThroughAProxy) {
  if (const std::string missing = Proxy::missing(); !missing.empty()) GTEST_SKIP() << missing;
  std::vector<Mistake> mistakes = of_the_client();
  const fs::path socket = stage_ / "proxy.sock";
  Served behind = serve("behind", {"--certificates", people_.server(), "--proxy-socket", socket});
  const Proxy proxy(people_.server(), socket), alone(people_.server(), stage_ / "nobody.sock");
  for (Mistake& one : mistakes) one.address = proxy.address();
  mistakes.push_back({"plain text", proxy.address(), {}});
  mistakes.push_back({"no server behind it", alone.address(), people_.credentials("anna", Role::observer, "room")});
  mistakes.push_back({.what = "ticket expired",
                      .address = proxy.address(),
                      .credentials = {.certificates = people_.person("dora"),
                                      .ticket = people_.ticket("dora", "room", Role::observer, -5s)},
                      .patience = kUntilAnswered});
  const std::map<std::string, std::string> said = say_all(mistakes);
  const std::map<std::string, std::string> expected{
      {"own expired", "has expired: it holds until"},
      {"own not yet", "holds only from"},
      {"own of another authority", "does not know the authority of your certificate"},
      {"own revoked", "person.pem, was revoked"},
      {"own of a server", "is not for a person"},
      {"plain text", "asks for a certificate, but you gave --plain"},
      {"no server behind it", "is a proxy that reaches no Osteon server"},
      {"ticket expired", "the ticket expired at"}};
  const std::vector<Listed> page = listed();
  for (const auto& [what, part] : expected) {
    EXPECT_THAT(said.at(what), testing::HasSubstr(part)) << what;
    EXPECT_EQ(
        std::ranges::count_if(
            page, [&](const Listed& entry) { return std::regex_match(said.at(what), pattern_of(entry.sentence)); }),
        1)
        << what << ": " << said.at(what);
  }
  // The proxy's log gives the source, and the fault by openssl verify's number.
  for (const char* fault : {"9", "10", "20", "23", "26"})
    EXPECT_THAT(proxy.log(), testing::ContainsRegex(std::string("127.0.0.1:.* certificate fault ") + fault + ","));
}

}  // namespace
}  // namespace osteon::test
