// Tests a server as its operator sees it: a checked configuration, health, metrics, and an orderly end.
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <regex>
#include <set>

#include "common/field/kernel.hpp"
#include "server/journal/journal.hpp"
#include "server/storage/journal_entries.hpp"
#include "tests/integration/hand.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/content.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

void write(const std::filesystem::path& file, const std::string& text) { std::ofstream(file) << text; }

TEST(Operators, AWrongConfigurationIsNamedWithFileFieldAndRemedy) {
  Stage stage(12.0);
  const auto check = [&](const std::string& text, std::vector<std::string> more = {}) {
    write(stage / "server.yaml", text);
    more.insert(more.begin(), {"--config", (stage / "server.yaml").string()});
    return run(program("osteon-server"), more, 30s);
  };
  const RunResult sound = check("cases: case\nmetrics: 0\nplain: true\n", {"--check"});
  EXPECT_EQ(sound.exit_code, 0) << sound.err;
  EXPECT_NE(sound.out.find("server.yaml: sound"), std::string::npos) << sound.out;
  const std::map<std::string, std::vector<std::string>> wrong{
      {"cases: case\nlisten: here\nplain: true\n", {"server.yaml:2", "\"listen\"", "HOST:PORT"}},
      {"cases: case\nlistn: 127.0.0.1:0\nplain: true\n", {"server.yaml:2", "\"listn\"", "did you mean \"listen\""}},
      {"cases: case\nlimits:\n  power_w: none\nplain: true\n",
       {"server.yaml:3", "\"limits.power_w\"", "write a number"}},
      {"cases: nowhere\nplain: true\n", {"server.yaml", "nowhere", "osteon-import"}},
      {"listen: 127.0.0.1:0\nplain: true\n", {"server.yaml", "--case is required"}},
      {"cases: case\njournal: a.journal\nrooms: rooms\nplain: true\n", {"server.yaml", "--rooms excludes --journal"}},
      {"cases: case\nmetrics: 0.0.0.0:1\nplain: true\n", {"server.yaml:2", "\"metrics\"", "this machine alone"}},
      {"cases: [case\n", {"server.yaml:", "not YAML"}}};
  for (const auto& [text, words] : wrong)
    for (const std::vector<std::string>& how : {std::vector<std::string>{"--check"}, {}}) {
      const RunResult said = check(text, how);
      EXPECT_NE(said.exit_code, 0) << text;
      EXPECT_FALSE(said.timed_out) << text;
      // Without --check, an error that belongs to no line of the file does not name the file.
      for (const std::string& word : words) {
        if (how.empty() && word == "server.yaml") continue;
        EXPECT_NE(said.err.find(word), std::string::npos) << word << " in " << said.err;
      }
    }
  EXPECT_NE(check("", {"--check"}).exit_code, 0);
  EXPECT_NE(run(program("osteon-server"), {"--check"}, 30s).err.find("--config"), std::string::npos);
}

TEST(Operators, TheCommandLineWinsOverTheFile) {
  Stage stage(12.0);
  ASSERT_EQ(stage.server().terminate(), 0);
  write(stage / "server.yaml", "cases: nowhere\nsummary: of-the-file.json\naddress_file: here\nretention_days: 3\n");
  std::filesystem::remove(stage / "server.json");
  // The stage gives --case, --summary and --address-file too.
  stage.start_server({"--plain", "--config", (stage / "server.yaml").string()});
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();
  EXPECT_TRUE(std::filesystem::exists(stage / "server.json"));
  EXPECT_FALSE(std::filesystem::exists(stage / "of-the-file.json"));
}

// A second server would open the rooms that the first has closed, and overwrite its list of open rooms.
TEST(Operators, AFolderOfRoomsIsOneServersAndTheNextOnesOnceThatHasEnded) {
  TempDir temp;
  const std::string folder = (temp / "rooms").string();
  Stage stage(12.0, {"--plain", "--rooms", folder});
  ASSERT_EQ(
      run(program("osteon-server"), {"rooms", "create", "anna", "--server", stage.address(), "--plain"}, 60s).exit_code,
      0);
  const std::vector<std::string> second{"--case",         (stage / "case").string(),   "--plain", "--rooms", folder,
                                        "--address-file", (stage / "address").string()};
  const RunResult refused = run(program("osteon-server"), second, 60s);
  EXPECT_FALSE(refused.timed_out);
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.err.find("--rooms " + folder + " is another osteon-server's"), std::string::npos) << refused.err;
  EXPECT_EQ(std::ranges::count(refused.err, '\n'), 1) << refused.err;
  EXPECT_TRUE(std::filesystem::exists(stage / "address")) << "the first server's file stays";
  // Commands on journals depend only on each journal, as before.
  const auto verify = [&] { return run(program("osteon-server"), {"verify", folder + "/anna.journal"}, 60s); };
  EXPECT_NE(verify().err.find("is in use by another process"), std::string::npos);
  ASSERT_EQ(
      run(program("osteon-server"), {"rooms", "close", "anna", "--server", stage.address(), "--plain"}, 60s).exit_code,
      0);
  EXPECT_EQ(verify().exit_code, 0);
  // This also works after a server that could not report its end.
  stage.server().signal(SIGKILL);
  ASSERT_TRUE(stage.server().wait(60s).has_value());
  stage.start_server({"--plain", "--rooms", folder});
  EXPECT_EQ(stage.server().terminate(), 0);
}

// Calls grpc.health.v1.Health/Check without generated code: 1 SERVING, 2 NOT_SERVING; 0 if the call itself fails.
int health_of(const std::shared_ptr<grpc::Channel>& channel, const std::string& name) {
  std::string request;
  if (!name.empty()) request = std::string("\x0a") + static_cast<char>(name.size()) + name;
  const grpc::Slice slice(request);
  const grpc::ByteBuffer bytes(&slice, 1);
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 10s);
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", bytes, &queue);
  grpc::ByteBuffer answer;
  grpc::Status status;
  call->StartCall();
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  (void)queue.Next(&tag, &ok);
  std::vector<grpc::Slice> slices;
  if (!status.ok() || !answer.Dump(&slices).ok()) return 0;
  std::string text;
  for (const grpc::Slice& one : slices) text.append(reinterpret_cast<const char*>(one.begin()), one.size());
  return text.size() == 2 && text[0] == '\x08' ? text[1] : 0;
}

// The answer of an address of this machine to GET /metrics.
std::string get_metrics(const std::string& address) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string text;
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
    const std::string request = "GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    (void)::send(socket, request.data(), request.size(), MSG_NOSIGNAL);
    char piece[4096];
    for (ssize_t got = 0; (got = ::recv(socket, piece, sizeof piece, 0)) > 0;)
      text.append(piece, static_cast<std::size_t>(got));
  }
  ::close(socket);
  const std::size_t body = text.find("\r\n\r\n");
  return body == std::string::npos ? "" : text.substr(body + 4);
}

// The value after `field=` in the program's log.
std::string logged(Process& server, const std::string& event, const std::string& field) {
  std::smatch found;
  const std::string log = server.err();
  return std::regex_search(log, found, std::regex(event + " .*" + field + "=(\\S+)")) ? found[1].str() : "";
}

double value_of(const std::string& text, const std::string& line) {
  const std::size_t at = text.find("\n" + line + " ");
  return at == std::string::npos ? -1.0 : std::stod(text.substr(at + line.size() + 2));
}

TEST(Operators, TheFiguresOfARoomAreThereForPrometheus) {
  TempDir folder;
  Stage stage(12.0, {"--plain", "--journal", (folder / "anna.journal").string(), "--metrics", "0"});
  ASSERT_TRUE(wait_until([&] { return !logged(stage.server(), "metrics", "address").empty(); }, kPatience));
  const std::string address = logged(stage.server(), "metrics", "address");
  EXPECT_EQ(address.find("127.0.0.1:"), 0u);
  Surgeon hand(stage.address(), folder / "cache");
  ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
  for (std::uint64_t i = 1; i <= 6; ++i) {
    const Vec3 at{-4.0 + static_cast<double>(i), 0, 0};
    Cut cut = straight_cut(find_tool("burr-round-5").value(), at, at, {0, 0, -1}, i);
    cut.author = hand.author();
    if (i == 6) cut.spindle_rpm = 1'000'000;
    ASSERT_TRUE(hand.session().send(cut));
  }
  ASSERT_TRUE(wait_until([&] { return hand.own() == 5 && !hand.rejected().empty(); }, kPatience));
  std::string text;
  // The room's tick updates its metrics a moment later.
  ASSERT_TRUE(wait_until(
      [&] {
        text = get_metrics(address);
        return value_of(text, R"(osteon_cuts_total{room="anna",outcome="committed"})") == 5 &&
               value_of(text, R"(osteon_rejections_total{room="anna",reason="spindle"})") == 1;
      },
      kPatience))
      << text;
  // Comments, and lines of NAME{LABELS} VALUE.
  const std::regex line(R"(# (HELP|TYPE) [a-z_]+ ?.*|[a-z_]+(\{([a-z]+="[^"]*",?)+\})? [-+0-9.eInf]+)");
  std::istringstream lines(text);
  for (std::string one; std::getline(lines, one);) {
    if (!one.empty() && one.back() == '\r') one.pop_back();
    EXPECT_TRUE(one.empty() || std::regex_match(one, line)) << one;
  }
  for (const char* family : {"osteon_cut_stage_seconds",
                             "osteon_tick_late_seconds",
                             "osteon_tick_work_seconds",
                             "osteon_ticks_missed_total",
                             "osteon_journal_commit_seconds",
                             "osteon_journal_bytes",
                             "osteon_queue_length",
                             "osteon_sessions",
                             "osteon_streams",
                             "osteon_cuts_total",
                             "osteon_rejections_total",
                             "osteon_refusals_total",
                             "osteon_rooms",
                             "osteon_room_serving",
                             "osteon_room_event",
                             "osteon_draining",
                             "osteon_links",
                             "osteon_connections",
                             "osteon_connections_refused_total",
                             "osteon_streams_ended_total"})
    EXPECT_NE(text.find("# TYPE " + std::string(family) + " "), std::string::npos) << family;
  for (const char* stage_name : {"wait", "decide", "commit", "publish"}) {
    const std::string labels = R"(room="anna",stage=")" + std::string(stage_name) + "\"";
    EXPECT_EQ(value_of(text, "osteon_cut_stage_seconds_count{" + labels + "}"), 5) << stage_name;
    EXPECT_EQ(value_of(text, "osteon_cut_stage_seconds_bucket{" + labels + ",le=\"+Inf\"}"), 5) << stage_name;
    EXPECT_GT(value_of(text, "osteon_cut_stage_seconds_sum{" + labels + "}"), 0) << stage_name;
  }
  EXPECT_EQ(value_of(text, R"(osteon_sessions{room="anna"})"), 1);
  EXPECT_EQ(value_of(text, R"(osteon_room_serving{room="anna"})"), 1);
  EXPECT_GE(value_of(text, R"(osteon_journal_bytes{room="anna"})"), 4096) << "an empty database is not smaller";
  EXPECT_EQ(value_of(text, "osteon_rooms"), 1);
}

// A session of the previous version. It does not receive the drain message, and stays.
class OlderSession {
 public:
  explicit OlderSession(const std::string& address)
      : channel_(grpc::CreateChannel(address, grpc::InsecureChannelCredentials())) {
    v1::JoinRequest request;
    request.set_protocol_version(3);
    request.set_kernel_version(kKernelVersion);
    request.set_kind(v1::CLIENT_KIND_HAPTIC);
    v1::JoinResponse joined;
    grpc::ClientContext joining;
    const grpc::Status status = v1::RoomService::NewStub(channel_)->Join(&joining, request, &joined);
    EXPECT_TRUE(status.ok()) << status.error_message();
    stream_ = v1::CuttingService::NewStub(channel_)->Session(&context_);
    v1::SessionRequest open;
    open.mutable_open()->set_author(joined.author());
    open.mutable_open()->set_server_epoch(joined.server_epoch());
    open.mutable_open()->set_secret(joined.secret());
    EXPECT_TRUE(stream_->Write(open));
    thread_ = std::thread([this] {
      v1::SessionResponse response;
      while (stream_->Read(&response)) {
        newest_kind_ = std::max<int>(newest_kind_, response.message_case());
        if (response.has_complete()) complete_ = true;
      }
      status_ = stream_->Finish();
    });
  }
  ~OlderSession() {
    context_.TryCancel();
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] bool complete() const { return complete_; }
  [[nodiscard]] int newest_kind() const { return newest_kind_; }
  grpc::Status end() {
    thread_.join();
    return status_;
  }

 private:
  std::shared_ptr<grpc::Channel> channel_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::SessionRequest, v1::SessionResponse>> stream_;
  std::thread thread_;
  std::atomic<bool> complete_{false};
  std::atomic<int> newest_kind_{0};
  grpc::Status status_;
};

TEST(Operators, HealthSaysWhatServesAndADrainLetsNobodyIn) {
  TempDir folder;
  Stage stage(12.0, {"--plain", "--rooms", (folder / "rooms").string(), "--drain-seconds", "300"});
  for (const char* name : {"anna", "berta"})
    ASSERT_EQ(
        run(program("osteon-server"), {"rooms", "create", name, "--server", stage.address(), "--plain"}, 60s).exit_code,
        0);
  const auto channel = grpc::CreateChannel(stage.address(), grpc::InsecureChannelCredentials());
  EXPECT_EQ(health_of(channel, ""), 1);
  for (const char* name : {"anna", "berta"})
    EXPECT_TRUE(wait_until([&] { return health_of(channel, name) == 1; }, kPatience)) << name;
  EXPECT_EQ(health_of(channel, "nobody"), 0) << "a name that does not exist";
  ASSERT_EQ(
      run(program("osteon-server"), {"rooms", "close", "berta", "--server", stage.address(), "--plain"}, 60s).exit_code,
      0);
  EXPECT_TRUE(wait_until([&] { return health_of(channel, "berta") == 2; }, kPatience));
  EXPECT_EQ(health_of(channel, "anna"), 1);

  OlderSession stays(stage.address());
  ASSERT_TRUE(wait_until([&] { return stays.complete(); }, kPatience));
  stage.server().signal(SIGTERM);
  EXPECT_TRUE(wait_until([&] { return health_of(channel, "") == 2; }, kPatience));
  EXPECT_EQ(health_of(channel, "anna"), 2);
  const auto late = wire::join_room(stage.address(), wire::ClientKind::haptic, "late", 5s, {}, "anna");
  ASSERT_FALSE(late.has_value());
  EXPECT_NE(late.error().message.find("the server is stopping; connect again"), std::string::npos)
      << late.error().message;
  EXPECT_TRUE(stage.server().running()) << "a client is still there";
  // A second signal ends the server at once.
  stage.server().signal(SIGTERM);
  EXPECT_EQ(stage.server().wait(60s), 0) << stage.server().err();
  const grpc::Status end = stays.end();
  EXPECT_EQ(end.error_code(), grpc::StatusCode::UNAVAILABLE) << end.error_message();
  EXPECT_LE(stays.newest_kind(), 10) << "a kind of message that version 3 does not know";
}

// The sequence numbers of one author's cuts in a journal.
std::map<std::uint64_t, RoomSeq> kept_cuts(const std::filesystem::path& file, AuthorId author) {
  std::map<std::uint64_t, RoomSeq> seqs;
  Result<Journal> journal = Journal::open(file);
  EXPECT_TRUE(journal.has_value()) << journal.error().message;
  if (!journal) return seqs;
  const Result<void> read = journal->read(RoomSeq{1}, [&](const JournalEntry& one) {
    const Result<LogEntry> entry = entry_from_bytes(one.seq, std::chrono::nanoseconds(one.at_ns), one.bytes);
    EXPECT_TRUE(entry.has_value());
    const CutEntry* cut = entry ? std::get_if<CutEntry>(&entry->what) : nullptr;
    const bool is_own = cut && cut->cut.author == author;
    EXPECT_TRUE(!is_own || seqs.emplace(cut->cut.author_seq, one.seq).second) << "twice";
    return entry.has_value();
  });
  EXPECT_TRUE(read.has_value());
  return seqs;
}

TEST(Operators, AServerThatIsStoppedLosesNothingAndItsHandsComeBack) {
  TempDir folder;
  const std::string file = (folder / "room.journal").string();
  Stage stage(12.0, {"--plain", "--journal", file});
  Hand hand(stage.address(), folder / "cache", 5);
  Surgeon& surgeon = hand.surgeon();
  ASSERT_TRUE(wait_until([&] { return surgeon.own() >= 30; }, kPatience));
  // The server is stopped during work, before any time limit: the hand leaves by itself.
  ASSERT_EQ(stage.server().terminate(60s), 0) << stage.server().err();
  EXPECT_NE(stage.server().err().find("drained sessions_left=0"), std::string::npos) << stage.server().err();
  const RunResult verified = run(program("osteon-server"), {"verify", file}, 60s);
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  EXPECT_NE(verified.out.find("cleanly"), std::string::npos) << verified.out;
  EXPECT_EQ(verified.out.find("not cleanly"), std::string::npos) << verified.out;
  const auto acknowledged = surgeon.acknowledged();
  const auto kept = kept_cuts(file, surgeon.author());
  EXPECT_GE(acknowledged.size(), 30u);
  for (const auto& [number, seq] : acknowledged) {
    const auto entry = kept.find(number);
    ASSERT_NE(entry, kept.end()) << "cut " << number << " was acknowledged and is not in the journal";
    EXPECT_EQ(entry->second, seq);
  }

  stage.start_server({"--plain", "--journal", file, "--listen", stage.address()});
  ASSERT_TRUE(wait_until([&] { return surgeon.stands(); }, 60s)) << surgeon.lost();
  hand.rest();
  EXPECT_TRUE(wait_until([&] { return surgeon.own() >= hand.sent(); }, 60s));
  EXPECT_EQ(surgeon.interruptions(), 1);
  EXPECT_EQ(surgeon.lost(), "");
  // The log must say who did what.
  ASSERT_EQ(stage.server().terminate(60s), 0);
  for (const char* event :
       {"listening", "room open", "joined", "session over", "draining", "drained", "stopping", "room closed"})
    EXPECT_NE(stage.server().err().find(event), std::string::npos) << event;
}

TEST(Operators, AClientOfAnotherVersionGetsBothVersionsAndTheRemedy) {
  Stage stage(12.0);
  const auto channel = grpc::CreateChannel(stage.address(), grpc::InsecureChannelCredentials());
  v1::JoinRequest request;
  request.set_protocol_version(2);
  request.set_kernel_version(kKernelVersion);
  request.set_kind(v1::CLIENT_KIND_HAPTIC);
  v1::JoinResponse response;
  grpc::ClientContext context;
  const grpc::Status refused = v1::RoomService::NewStub(channel)->Join(&context, request, &response);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_NE(refused.error_message().find("version 2 and the server protocol version 4, or 3; install a newer Osteon"),
            std::string::npos)
      << refused.error_message();
  // The operator gets the same message.
  EXPECT_TRUE(
      wait_until([&] { return stage.server().err().find(refused.error_message()) != std::string::npos; }, kPatience))
      << stage.server().err();
}

// A server of the previous version, as it answers a client of this version.
class OlderServer final : public v1::RoomService::Service {
 public:
  OlderServer() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  grpc::Status Join(grpc::ServerContext*, const v1::JoinRequest* request, v1::JoinResponse*) override {
    return {grpc::StatusCode::FAILED_PRECONDITION,
            "the client speaks protocol version " + std::to_string(request->protocol_version()) +
                " and the server protocol version 3; install the same Osteon release on both"};
  }
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

TEST(Operators, AnOlderServersRefusalEndsTheClientWithBothVersions) {
  TempDir folder;
  OlderServer server;
  std::ofstream(folder / "plan.json")
      << nlohmann::json{{"steps", nlohmann::json::array({drill_at(0, 0, "rig")})}}.dump();
  const RunResult client =
      run(program("osteon-haptic"), {"--server", server.address(), "--plain", "--plan", folder / "plan.json"}, 60s);
  EXPECT_EQ(client.exit_code, 1);
  EXPECT_NE(client.err.find("the client speaks protocol version 4 and the server protocol version 3; install"),
            std::string::npos)
      << client.err;
}

// Asks systemd's own checker, if it is installed. This build's program replaces the installed one.
TEST(Operators, TheServiceIsAsSystemdWantsIt) {
  const std::string unit = content(std::filesystem::path(OSTEON_DEPLOY) / "systemd" / "osteon-server.service");
  for (const char* line :
       {"\nDynamicUser=yes\n", "\nProtectSystem=strict\n", "\nKillSignal=SIGTERM\n", "\nRestart=on-failure\n",
        "\nStartLimitIntervalSec=0\n", "\nRestartSec=5\n", "\nMemoryMax=80%\n", "\nOOMPolicy=continue\n",
        "\nNoNewPrivileges=yes\n", "\nCapabilityBoundingSet=\n"})
    EXPECT_NE(unit.find(line), std::string::npos) << line;
  if (!std::filesystem::exists("/usr/bin/systemd-analyze")) return;
  TempDir folder;
  const std::filesystem::path file = folder / "osteon-server.service";
  write(file, std::regex_replace(unit, std::regex("/usr/local/bin/osteon-server"), program("osteon-server").string()));
  const RunResult verified = run("systemd-analyze", {"verify", file}, 60s);
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  // The checker warns of unknown settings but still succeeds.
  EXPECT_EQ(verified.err, "");
  const RunResult exposed = run("systemd-analyze", {"security", "--offline=true", "--threshold=20", file}, 60s);
  EXPECT_EQ(exposed.exit_code, 0) << exposed.out << exposed.err;
}

TEST(Operators, TheContainerRunsItUnprivileged) {
  const std::string text = content(std::filesystem::path(OSTEON_DEPLOY) / "container" / "Containerfile");
  ASSERT_NE(text.rfind("\nUSER "), std::string::npos);
  EXPECT_EQ(text.find("\nUSER root"), std::string::npos);
  EXPECT_GT(text.rfind("\nUSER "), text.rfind("\nRUN ")) << "the last line that decides who runs it";
  for (const char* word : {"FROM debian:12", "deploy/package", "osteon-server_*.deb", "ENTRYPOINT [\"osteon-server\"]",
                           "STOPSIGNAL SIGTERM"})
    EXPECT_NE(text.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace osteon::test
