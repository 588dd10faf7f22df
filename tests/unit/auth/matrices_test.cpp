// What each role may send and is sent by a server with certificates: by datagram, and by each stream. The expectations
// are listed here for each kind, as the roles are described to people.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "common/field/kernel.hpp"
#include "common/link/udp_port.hpp"
#include "common/wire/client_link.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/field.grpc.pb.h"
#include "osteon/v1/people.grpc.pb.h"
#include "server/rpc/room_server.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using grpc::StatusCode;
using testing::HasSubstr;

using Seen = std::set<std::string>;

// A stream from the server, read until it ends.
template <class Message>
class Reader {
 public:
  using Note = std::function<void(const Message&)>;
  Reader(std::unique_ptr<grpc::ClientContext> context, std::unique_ptr<grpc::ClientReader<Message>> stream, Note note)
      : context_(std::move(context)), stream_(std::move(stream)), thread_([this, note = std::move(note)] {
          Message message;
          while (stream_->Read(&message)) note(message);
          end_ = stream_->Finish();
        }) {}
  ~Reader() { (void)end(); }
  grpc::Status end() {
    if (thread_.joinable()) {
      context_->TryCancel();
      thread_.join();
    }
    return end_;
  }
  // Waits until it ends by itself.
  grpc::Status wait() {
    thread_.join();
    return end_;
  }

 private:
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReader<Message>> stream_;
  grpc::Status end_;
  std::thread thread_;
};

// A person with a ticket, and everything that they are sent: stream and content.
class Member {
 public:
  explicit Member(wire::JoinedRoom joined) : room(std::move(joined)) {}
  ~Member() { leave(); }

  void watch() {
    const auto context = [] { return std::make_unique<grpc::ClientContext>(); };
    auto watch = v1::WatchService::NewStub(room.channel);
    auto people = v1::PeopleService::NewStub(room.channel);
    v1::WatchMeshRequest mesh;
    mesh.set_author(room.author.value);
    auto of_mesh = context();
    auto mesh_stream = watch->WatchMesh(of_mesh.get(), mesh);
    mesh_ = std::make_unique<Reader<v1::WatchMeshResponse>>(
        std::move(of_mesh), std::move(mesh_stream),
        [this](const v1::WatchMeshResponse& said) { note(said.blocks_size() > 0, "mesh surface"); });
    v1::WatchCuttingRequest cutting;
    cutting.set_author(room.author.value);
    auto of_cutting = context();
    auto cutting_stream = watch->WatchCutting(of_cutting.get(), cutting);
    cutting_ = std::make_unique<Reader<v1::WatchCuttingResponse>>(std::move(of_cutting), std::move(cutting_stream),
                                                                  [this](const v1::WatchCuttingResponse& said) {
                                                                    note(said.states_size() > 0, "cutting tool_states");
                                                                    note(said.items_size() > 0, "cutting scene");
                                                                    for (const auto& state : said.states())
                                                                      note_tool(state.author());
                                                                  });
    v1::WatchFieldRequest inside;
    inside.set_author(room.author.value);
    inside.set_kernel_version(kKernelVersion);
    auto of_field = context();
    auto field_stream = v1::FieldService::NewStub(room.channel)->WatchField(of_field.get(), inside);
    field_ = std::make_unique<Reader<v1::WatchFieldResponse>>(
        std::move(of_field), std::move(field_stream), [this](const v1::WatchFieldResponse& said) {
          note(said.has_leaf() || said.has_committed() || said.has_change(), "field field");
          // Nothing of what was said or decided.
          for (const char* secret : {"to sue", "to the reader", "gently"})
            note(said.SerializeAsString().find(secret) != std::string::npos, std::string("field ") + secret);
        });
    v1::WatchPeopleRequest asked;
    asked.set_author(room.author.value);
    auto of_people = context();
    auto people_stream = people->WatchPeople(of_people.get(), asked);
    people_ = std::make_unique<Reader<v1::WatchPeopleResponse>>(
        std::move(of_people), std::move(people_stream),
        [this](const v1::WatchPeopleResponse& said) { note_people(said); });
  }

  // Opens the stream of the session. Nothing of it goes by datagram, except what `link` receives.
  void open(std::function<void(const v1::LinkOffer&)> link = {}) {
    session_context_ = std::make_unique<grpc::ClientContext>();
    session_ = v1::CuttingService::NewStub(room.channel)->Session(session_context_.get());
    v1::SessionRequest request;
    request.mutable_open()->set_author(room.author.value);
    request.mutable_open()->set_server_epoch(room.server_epoch);
    request.mutable_open()->set_secret(room.secret);
    EXPECT_TRUE(session_->Write(request));
    session_thread_ = std::thread([this, link = std::move(link)] {
      v1::SessionResponse said;
      while (session_->Read(&said)) {
        if (said.has_link() && link) link(said.link());
        note(said.has_leaf() || said.has_committed() || said.has_change(), "session field");
        note(said.has_scene() && said.scene().items_size() > 0, "session scene");
        note(said.has_partner(), "session tool_states");
        note(said.has_supervised(), "session own_supervision");
        note(said.has_chat(), "session own_words");
        note(said.has_complete(), "session complete");
        note(said.has_committed() && said.committed().cut().author() == room.author.value, "own cut");
      }
      const grpc::Status end = session_->Finish();
      const std::lock_guard lock(mutex_);
      session_end_ = end;
    });
  }
  [[nodiscard]] std::optional<grpc::Status> session_end() {
    const std::lock_guard lock(mutex_);
    return session_end_;
  }

  void leave() {
    mesh_.reset(), cutting_.reset(), field_.reset(), people_.reset();
    if (session_thread_.joinable()) {
      session_context_->TryCancel();
      session_thread_.join();
    }
  }
  bool saw(const std::string& what) {
    const std::lock_guard lock(mutex_);
    return seen_.contains(what);
  }
  Seen seen() {
    const std::lock_guard lock(mutex_);
    return seen_;
  }
  bool saw_tool(AuthorId author) { return saw("tool of " + std::to_string(author.value)); }

  wire::JoinedRoom room;

 private:
  void note(bool there, const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (there) seen_.insert(what);
  }
  void note_tool(std::uint64_t author) { note(true, "tool of " + std::to_string(author)); }
  void note_people(const v1::WatchPeopleResponse& said) {
    note(said.people_size() > 0, "people people");
    note(said.annotations_size() > 0, "people scene");
    note(said.shots_size() > 0, "people shots");
    const std::uint64_t me = room.author.value;
    for (const v1::Person& person : said.people()) {
      const bool decided = person.decided_room_seq() != 0 || person.has_supervision();
      note(decided, person.author() == me ? "people own_supervision" : "people others_supervision");
    }
    for (const v1::Words& words : said.words()) {
      const bool own = words.to() == 0 || words.to() == me || words.from() == me;
      note(true, own ? "people own_words" : "people others_words");
      note(words.words() == "the end", "the end");
    }
  }

  std::mutex mutex_;
  Seen seen_;
  std::optional<grpc::Status> session_end_;
  std::unique_ptr<Reader<v1::WatchMeshResponse>> mesh_;
  std::unique_ptr<Reader<v1::WatchCuttingResponse>> cutting_;
  std::unique_ptr<Reader<v1::WatchFieldResponse>> field_;
  std::unique_ptr<Reader<v1::WatchPeopleResponse>> people_;
  std::unique_ptr<grpc::ClientContext> session_context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::SessionRequest, v1::SessionResponse>> session_;
  std::thread session_thread_;
};

// The client's end of a session's datagrams, which also records the content of each datagram received.
class Line {
 public:
  Line(const v1::LinkOffer& offer, const std::string& address)
      : Line(SessionKeys{offer.session(), key(offer.key_up()), key(offer.key_down())},
             static_cast<std::uint16_t>(offer.udp_port()), address) {}
  Line(const SessionKeys& keys, std::uint16_t port, const std::string& address)
      : server_(find_endpoint(address.substr(0, address.rfind(':')), port).value()),
        port_(UdpPort::open({.address = "0.0.0.0"}).value()),
        link_(keys),
        opener_(keys.session, keys.down) {}

  // Sends and receives until `holds` is true.
  bool drive(const std::function<bool()>& holds, std::chrono::milliseconds patience = test::kPatience) {
    const auto until = std::chrono::steady_clock::now() + patience;
    DatagramBuffer buffer, plain;
    while (!holds()) {
      if (std::chrono::steady_clock::now() > until) return false;
      while (const std::optional<Datagram> datagram = port_->receive(buffer)) {
        ++datagrams;
        if (const auto opened = opener_.open(datagram->bytes, now(), plain)) look_at(opened->plain);
        link_.receive(datagram->bytes, now());
      }
      if (const auto bytes = link_.send(now(), buffer); !bytes.empty()) port_->send(server_, bytes);
      port_->wait(1ms);
    }
    return true;
  }
  wire::ClientLink& link() { return link_; }

  Seen seen;
  std::size_t datagrams = 0;
  std::uint64_t me = 0;

 private:
  static SealKey key(const std::string& bytes) {
    return key_of({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}).value();
  }
  std::chrono::nanoseconds now() const { return std::chrono::steady_clock::now() - start_; }
  void look_at(std::span<const std::uint8_t> plain) {
    v1::DownPacket packet;
    ASSERT_TRUE(packet.ParseFromArray(plain.data(), static_cast<int>(plain.size())));
    if (packet.acknowledged() > 0) seen.insert("acknowledgements");
    for (const v1::EntryRun& entries : packet.entries())
      seen.insert(entries.author() == me ? "own entry" : "committed_cuts");
    if (packet.partners_size() > 0) seen.insert("partners");
    if (packet.supervised_size() > 0) seen.insert("supervision");
    if (packet.has_bone()) seen.insert("bone_seen");
    if (packet.bone().push_seq() > 0) seen.insert("bone_push");
  }

  const Endpoint server_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::unique_ptr<UdpPort> port_;
  wire::ClientLink link_;
  Opener opener_;
};

class Matrices : public ::testing::Test {
 protected:
  void SetUp() override {
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir_ / "case"}}, .rates = {.mount = true}});
    ASSERT_TRUE(rooms->create("ward", nullptr));
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0", {.certificates = people_.server()});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
    sue_ = std::make_unique<test::Surgeon>(address(), dir_ / "cache", "", "ward",
                                           people_.credentials("sue", Role::trainee, "ward"));
    ina_ = join(people_.credentials("ina", Role::instructor, "ward"), wire::ClientKind::viewer).author;
    ASSERT_TRUE(test::wait_until([&] { return sue_->complete(); }, test::kPatience));
  }
  const std::string& address() { return server_->address(); }
  wire::JoinedRoom join(const wire::ClientCredentials& credentials, wire::ClientKind kind) {
    auto joined = wire::join_room(address(), kind, "whatever", 5s, {}, "ward", credentials);
    EXPECT_TRUE(joined.has_value()) << joined.error().message;
    return joined.value_or(wire::JoinedRoom{});
  }
  RoomRuntime& host() { return server_->rooms().find("ward").value()->runtime(); }
  void happen(std::function<Result<RoomEvent>(Room&)> event) {
    std::promise<std::string> done;
    host().queue_event(std::move(event), [&](const Result<RoomEvent>& decided) {
      done.set_value(decided ? "" : decided.error().message);
    });
    EXPECT_EQ(done.get_future().get(), "");
  }
  void sue_cuts() {
    const std::uint64_t before = sue_->own();
    Cut cut = test::strokes(sue_->author(), static_cast<int>(before) + 1, 7).back();
    cut.lease_epoch = sue_->lease();
    ASSERT_TRUE(sue_->session().send(cut));
    ASSERT_TRUE(test::wait_until([&] { return sue_->own() == before + 1; }, test::kPatience)) << sue_->rejected();
  }
  void sue_moves() {
    CuttingState state;
    state.author = sue_->author();
    state.state_seq = ++moves_;
    state.pose_bone_tool.position_mm = {0.1 * static_cast<double>(moves_), 0, 5};
    state.pose_bone_device = state.pose_bone_tool;
    sue_->session().send(state);
  }
  void decide_about(AuthorId subject) {
    happen([&](Room& room) { return room.supervise(ina_, subject, {.words = "gently " + std::to_string(++moves_)}); });
  }
  void say(AuthorId to, const std::string& words) {
    happen([&](Room& room) { return room.say(ina_, to, words); });
  }
  // Makes something of every kind happen, also about `reader`, and at last sends "the end" to all.
  void let_everything_happen(AuthorId reader, bool hand) {
    sue_cuts();
    sue_moves();
    happen([&](Room& room) {
      SceneItem item;
      item.tool = test::tool_named("guide-1").hash();
      item.pose_bone_item.position_mm = {0, 0, 0};
      return room.set_item(ina_, item);
    });
    happen([&](Room& room) {
      return room.annotate(ina_, {.kind = AnnotationKind::pointer, .points = {{0, 0, 0}}, .words = "here"});
    });
    host().people().shot(sue_->author(), {.first_number = 1, .last = {.number = 1}}, {.shots = 1});
    decide_about(sue_->author());
    if (hand) decide_about(reader);
    say(sue_->author(), "to sue");
    say(reader, "to the reader");
    say({}, "the end");
  }

  test::TempDir dir_;
  test::People people_;
  std::unique_ptr<RoomServer> server_;
  std::unique_ptr<test::Surgeon> sue_;
  AuthorId ina_;
  std::uint64_t moves_ = 0;
};

constexpr Role kHands[] = {Role::trainee, Role::collaborator, Role::instructor};

TEST_F(Matrices, EveryStreamSendsEveryRoleWhatIsForIt) {
  const Seen of_watchers{"mesh surface",  "cutting tool_states", "cutting scene",    "field field",
                         "people people", "people scene",        "people own_words", "people shots"};
  const Seen of_hands{"people own_supervision", "session field",           "session scene",
                      "session tool_states",    "session own_supervision", "session own_words"};
  const Seen of_instructors{"people others_supervision", "people others_words"};
  for (const Role role : {Role::observer, Role::trainee, Role::collaborator, Role::instructor}) {
    SCOPED_TRACE(to_string(role));
    const bool hand = role != Role::observer;
    Member reader(join(people_.credentials("reader-" + std::string(to_string(role)), role, "ward"),
                       hand ? wire::ClientKind::haptic : wire::ClientKind::viewer));
    reader.watch();
    if (hand) {
      reader.open();
      ASSERT_TRUE(test::wait_until([&] { return reader.saw("session complete"); }, test::kPatience));
    }
    let_everything_happen(reader.room.author, hand);
    Seen expected = of_watchers;
    if (hand) expected.insert(of_hands.begin(), of_hands.end());
    if (role == Role::instructor) expected.insert(of_instructors.begin(), of_instructors.end());
    for (const std::string& what : expected)
      EXPECT_TRUE(test::wait_until([&] { return sue_moves(), reader.saw(what); }, 10s)) << "is not sent: " << what;
    // The streams keep the order, so everything else that was to be sent has been sent before.
    ASSERT_TRUE(test::wait_until([&] { return reader.saw("the end"); }, test::kPatience));
    Seen seen = reader.seen();
    for (const char* what : {"session complete", "own cut", "the end"}) seen.erase(what);
    std::erase_if(seen, [](const std::string& what) { return what.starts_with("tool of "); });
    EXPECT_EQ(seen, expected);
  }
}

TEST_F(Matrices, NoStreamSendsAnOperatorAnythingOfARoom) {
  const wire::ClientCredentials credentials = people_.credentials("otto", Role::operator_, "ward");
  const auto joined = wire::join_room(address(), wire::ClientKind::viewer, "whatever", 5s, {}, "ward", credentials);
  ASSERT_FALSE(joined);
  EXPECT_THAT(joined.error().message, HasSubstr("an operator may not call"));
}

TEST_F(Matrices, TheInsideOfTheBoneIsForWhoIsInTheRoomAndNoLonger) {
  const auto end_of = [&](const wire::JoinedRoom& room, std::promise<void>* begun = nullptr) {
    v1::WatchFieldRequest request;
    request.set_author(room.author.value);
    request.set_kernel_version(kKernelVersion);
    grpc::ClientContext context;
    const auto stream = v1::FieldService::NewStub(room.channel)->WatchField(&context, request);
    v1::WatchFieldResponse said;
    while (stream->Read(&said))
      if (begun) std::exchange(begun, nullptr)->set_value();
    return stream->Finish();
  };
  // An operator's ticket, over the connection of somebody who is in the room.
  auto channel = wire::reach_server(address(), wire::ClientKind::viewer, 5s, {},
                                    people_.credentials("otto", Role::operator_, "ward"));
  ASSERT_TRUE(channel) << channel.error().message;
  wire::JoinedRoom otto;
  otto.channel = *channel;
  otto.author = ina_;
  const grpc::Status refused = end_of(otto);
  EXPECT_EQ(refused.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(refused.error_message(), HasSubstr("an operator may not call WatchField"));
  // Somebody else's author.
  wire::JoinedRoom olga = join(people_.credentials("olga", Role::observer, "ward"), wire::ClientKind::viewer);
  olga.author = ina_;
  EXPECT_EQ(end_of(olga).error_code(), StatusCode::PERMISSION_DENIED);
  // An observer who loses the role while the stream is open.
  const wire::JoinedRoom ned = join(people_.credentials("ned", Role::observer, "ward"), wire::ClientKind::viewer);
  std::promise<void> begun;
  std::promise<grpc::Status> end;
  std::thread reader([&] { end.set_value(end_of(ned, &begun)); });
  begun.get_future().wait();
  people_.append_access("role ned operator ward");
  EXPECT_EQ(end.get_future().get().error_code(), StatusCode::PERMISSION_DENIED);
  reader.join();
}

TEST_F(Matrices, DatagramsBringEveryHapticClientAllThatIsForIt) {
  for (const Role role : kHands) {
    SCOPED_TRACE(to_string(role));
    const std::string name = "hand-" + std::string(to_string(role));
    Member hand(join(people_.credentials(name, role, "ward"), wire::ClientKind::haptic));
    Member observer(join(people_.credentials("observer", Role::observer, "ward"), wire::ClientKind::viewer));
    observer.watch();
    std::promise<v1::LinkOffer> offered;
    hand.open([&](const v1::LinkOffer& offer) { offered.set_value(offer); });
    Line line(offered.get_future().get(), address());
    line.me = hand.room.author.value;
    ASSERT_TRUE(line.drive([&] { return hand.saw("session complete") && line.seen.contains("bone_seen"); }));

    // To the server: nothing is sent over the stream.
    CuttingState state;
    state.pose_bone_tool.position_mm = {3, 0, 5};
    EXPECT_TRUE(line.drive([&] {
      ++state.state_seq;
      state.pose_bone_tool.position_mm.x() += 0.01;
      line.link().set_state(state, 0);
      return observer.saw_tool(hand.room.author);
    })) << "tool_state";
    Cut cut = test::strokes(hand.room.author, 1, 11).back();
    cut.lease_epoch = hand.room.lease_epoch;
    EXPECT_TRUE(line.link().push(cut));
    EXPECT_TRUE(line.drive([&] { return hand.saw("own cut"); })) << "cuts";
    std::uint64_t pushes = 0;
    EXPECT_TRUE(line.drive([&] {
      line.link().set_push({++pushes, {{1, 0, 0}, Vec3::Zero()}, 0.0, 0});
      return line.seen.contains("bone_push");
    })) << "bone_push";

    // From the server.
    sue_cuts();
    decide_about(hand.room.author);
    for (const char* what : {"acknowledgements", "own entry", "committed_cuts", "partners", "supervision", "bone_seen"})
      EXPECT_TRUE(line.drive([&] { return sue_moves(), line.seen.contains(what); }, 10s))
          << "is not received: " << what;

    // From the change of the role on, none of it is received any more, although the haptic client goes on sending and
    // receiving.
    people_.append_access("role " + name + " observer ward");
    ASSERT_TRUE(line.drive([&] { return hand.session_end().has_value(); }));
    EXPECT_EQ(hand.session_end()->error_code(), StatusCode::PERMISSION_DENIED);
    EXPECT_THAT(hand.session_end()->error_message(), HasSubstr("an observer may not call Session"));
    const auto nothing = [&] { return false; };
    (void)line.drive(nothing, 100ms);  // Receives what was under way.
    const std::size_t before = line.datagrams;
    const RoomSeq place = host().room_seq();
    Cut late = test::strokes(hand.room.author, 2, 11).back();
    late.lease_epoch = hand.room.lease_epoch;
    EXPECT_TRUE(line.link().push(late));
    sue_cuts();
    (void)line.drive(nothing, 500ms);
    EXPECT_EQ(line.datagrams, before);
    EXPECT_EQ(host().room_seq().value, place.value + 1) << "only Sue's cut";
  }
}

TEST_F(Matrices, DatagramsBringNothingToWhoHoldsNoTool) {
  for (const Role role : {Role::observer, Role::operator_}) {
    SCOPED_TRACE(to_string(role));
    const wire::ClientCredentials credentials =
        people_.credentials("eve-" + std::string(to_string(role)), role, "ward");
    const auto as_hand = wire::join_room(address(), wire::ClientKind::haptic, "whatever", 5s, {}, "ward", credentials);
    ASSERT_FALSE(as_hand);
    EXPECT_EQ(as_hand.error().code, ErrorCode::denied);
    EXPECT_THAT(as_hand.error().message, HasSubstr(role == Role::observer ? "holds no tool" : "may not call Join"));
    // A session of an observer, or of another person's haptic client, does not receive the keys either.
    std::uint64_t author = sue_->author().value;
    if (role == Role::observer) author = join(credentials, wire::ClientKind::viewer).author.value;
    grpc::ClientContext context;
    context.AddMetadata("osteon-room-bin", "ward");
    context.AddMetadata("osteon-ticket", wire::ticket_text(credentials));
    const auto channel = grpc::CreateChannel(address(), wire::channel_credentials(credentials, address()).value());
    const auto session = v1::CuttingService::NewStub(channel)->Session(&context);
    v1::SessionRequest open;
    open.mutable_open()->set_author(author);
    (void)session->Write(open);
    v1::SessionResponse said;
    EXPECT_FALSE(session->Read(&said)) << said.ShortDebugString();
    const grpc::Status end = session->Finish();
    EXPECT_EQ(end.error_code(), StatusCode::PERMISSION_DENIED);
    EXPECT_THAT(end.error_message(), HasSubstr("may not call Session"));
    // With keys of its own making: counted, and not answered.
    const std::uint64_t unauthenticated = server_->link_health().unauthenticated;
    Line line(make_session_keys(0x01020304, system_random()), server_->link_port(), address());
    CuttingState state;
    EXPECT_TRUE(line.drive([&] {
      ++state.state_seq;
      line.link().set_state(state, 0);
      return server_->link_health().unauthenticated > unauthenticated;
    }));
    (void)line.drive([] { return false; }, 200ms);
    EXPECT_EQ(line.datagrams, 0u);
  }
}

}  // namespace
}  // namespace osteon
