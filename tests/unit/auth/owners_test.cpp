// Rooms and backups count for the person who made them. That person may delete them, also after a restart.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "server/cli/room_admin_client.hpp"
#include "server/rpc/room_server.hpp"
#include "server/storage/room_owners.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;

class Owners : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(test::test_block().save(dir_ / "case"));
    fs::create_directories(folder());
    serve();
    ASSERT_TRUE(server_->rooms().create("ward", nullptr));
  }
  [[nodiscard]] fs::path folder() const { return dir_ / "rooms"; }
  void serve() {
    server_.reset();
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{test::test_block(), dir_ / "case"}},
                                                      .folder = folder(),
                                                      .most_rooms_per_person = 2,
                                                      .most_backups_per_person = 1});
    rooms->resume_all([](double) {});
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0", {.certificates = people_.server()});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
  }
  RoomAdminClient as(const std::string& name, Role role, const std::string& room) {
    return RoomAdminClient::reach(server_->address(), 5s, {}, people_.credentials(name, role, room)).value();
  }
  static std::set<std::string> names(RoomAdminClient client) {
    std::set<std::string> names;
    const auto listed = client.list();
    for (const RoomLine& room : listed.value()) names.insert(room.name);
    return names;
  }
  // The message of a failure.
  template <class T>
  static std::string refusal(const Result<T>& done, ErrorCode code) {
    EXPECT_FALSE(done.has_value());
    if (done) return {};
    EXPECT_EQ(done.error().code, code) << done.error().message;
    return done.error().message;
  }

  test::TempDir dir_;
  test::People people_;
  std::unique_ptr<RoomServer> server_;
};

TEST_F(Owners, HaveNoMoreRoomsThanOnePersonMay) {
  RoomAdminClient ina = as("ina", Role::instructor, "ward");
  ASSERT_TRUE(ina.branch("ward", "first", RoomSeq{}));
  ASSERT_TRUE(ina.branch("ward", "second", RoomSeq{}));
  const std::string third = refusal(ina.branch("ward", "third", RoomSeq{}), ErrorCode::exhausted);
  EXPECT_THAT(third, HasSubstr("you have made 2 rooms (first, second)"));
  EXPECT_THAT(third, HasSubstr("--most-rooms-per-person"));
  EXPECT_THAT(refusal(ina.replay("ward", "film", RoomSeq{}, RoomSeq{}, 1), ErrorCode::exhausted), HasSubstr("2 rooms"));
  EXPECT_FALSE(fs::exists(folder() / "third.journal"));
  // Nobody else is affected.
  EXPECT_TRUE(as("ian", Role::instructor, "ward").branch("ward", "ians", RoomSeq{}));
  for (const char* name : {"one", "two", "three"})
    EXPECT_TRUE(as("otto", Role::operator_, "*").create(name, "")) << "an operator may have any number of rooms";
  serve();
  EXPECT_THAT(refusal(as("ina", Role::instructor, "ward").branch("ward", "third", RoomSeq{}), ErrorCode::exhausted),
              HasSubstr("you have made 2 rooms (first, second)"))
      << "also after a restart";
}

TEST_F(Owners, OfPlaybacksAreCountedToo) {
  RoomAdminClient ina = as("ina", Role::instructor, "ward");
  ASSERT_TRUE(ina.replay("ward", "film", RoomSeq{}, RoomSeq{}, 1));
  ASSERT_TRUE(ina.branch("ward", "branch", RoomSeq{}));
  EXPECT_THAT(refusal(ina.branch("ward", "third", RoomSeq{}), ErrorCode::exhausted), HasSubstr("(branch, film)"));
  EXPECT_TRUE(ina.remove("film", false));
  EXPECT_TRUE(ina.branch("ward", "third", RoomSeq{}));
}

TEST_F(Owners, DeleteTheirRoomsAndNobodyElseBelowAnOperatorDoes) {
  ASSERT_TRUE(as("ina", Role::instructor, "ward").branch("ward", "first", RoomSeq{}));
  ASSERT_TRUE(as("ina", Role::instructor, "ward").branch("ward", "second", RoomSeq{}));
  for (const bool restarted : {false, true}) {
    if (restarted) serve();
    EXPECT_THAT(refusal(as("ian", Role::instructor, "*").remove("first", false), ErrorCode::denied),
                HasSubstr("first is not yours; only who made it, or an operator, may delete it"));
    EXPECT_THAT(refusal(as("ian", Role::instructor, "ward").remove("first", false), ErrorCode::denied),
                HasSubstr("the ticket is for room ward"));
    EXPECT_THAT(refusal(as("ina", Role::trainee, "first").remove("first", false), ErrorCode::denied),
                HasSubstr("a trainee may not call"));
    // This room has no owner, as rooms have none that were made before owners were stored.
    EXPECT_THAT(refusal(as("ina", Role::instructor, "*").remove("ward", true), ErrorCode::denied),
                HasSubstr("ward is not yours"));
  }
  // The branch is not in the ticket of the person who made it, but it is their room.
  EXPECT_EQ(names(as("ina", Role::instructor, "ward")), (std::set<std::string>{"ward", "first", "second"}));
  EXPECT_EQ(names(as("ian", Role::instructor, "ward")), (std::set<std::string>{"ward"}));
  EXPECT_TRUE(as("ina", Role::instructor, "ward").remove("first", false));
  EXPECT_FALSE(fs::exists(folder() / "first.journal"));
  EXPECT_FALSE(fs::exists(folder() / "first.journal-owner"));
  EXPECT_TRUE(as("ina", Role::instructor, "ward").branch("ward", "third", RoomSeq{}))
      << "there is space for one room again";
  EXPECT_TRUE(as("otto", Role::operator_, "*").remove("third", false));
  // A role that the access list lowers for that room is lower there.
  people_.append_access("role ina observer second");
  server_->rooms().authorizer->look();
  EXPECT_FALSE(as("ina", Role::instructor, "ward").remove("second", false));
  EXPECT_TRUE(server_->rooms().find("second"));
}

TEST_F(Owners, HaveNoMoreBackupsThanOnePersonMayAndDeleteTheirs) {
  ASSERT_TRUE(as("otto", Role::operator_, "ward").back_up("ward", "w1.backup"));
  EXPECT_EQ(refusal(as("olga", Role::operator_, "ward").back_up("ward", "w1.backup"), ErrorCode::exists),
            "there is a backup w1.backup; choose another name, or delete it");
  for (const bool restarted : {false, true}) {
    if (restarted) serve();
    const std::string second =
        refusal(as("otto", Role::operator_, "ward").back_up("ward", "w2.backup"), ErrorCode::exhausted);
    EXPECT_THAT(second, HasSubstr("you have made 1 backups (w1)"));
    EXPECT_THAT(second, HasSubstr("--most-backups-per-person"));
  }
  EXPECT_TRUE(as("olga", Role::operator_, "ward").back_up("ward", "olgas.backup")) << "another person made that backup";
  EXPECT_THAT(refusal(as("olga", Role::operator_, "ward").remove("w1.backup", false), ErrorCode::denied),
              HasSubstr("the ticket is for room ward"));
  EXPECT_TRUE(as("otto", Role::operator_, "ward").remove("w1.backup", false));
  EXPECT_FALSE(fs::exists(folder() / "w1.backup"));
  EXPECT_FALSE(fs::exists(folder() / "w1.backup-owner"));
  EXPECT_THAT(refusal(as("otto", Role::operator_, "*").remove("w1.backup", false), ErrorCode::not_found),
              HasSubstr("there is no backup w1.backup"));
  EXPECT_TRUE(as("otto", Role::operator_, "*").remove("olgas.backup", false))
      << "an operator of every room may delete it";
  EXPECT_TRUE(server_->rooms().find("ward"));
}

TEST_F(Owners, AreThoseOfTheRoomAndNotOfItsName) {
  Rooms& rooms = server_->rooms();
  ASSERT_TRUE(rooms.create("annex", nullptr, {.user = "ina"}));
  EXPECT_EQ(rooms.owner("annex"), "ina");
  struct stat about {};
  ASSERT_EQ(::stat((folder() / "annex.journal-owner").c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777u, 0600u);
  // A room that is deleted without the server leaves no owner. If a file of the owner is left nevertheless, it does not
  // count for a later room.
  ASSERT_TRUE(rooms.close("annex"));
  ASSERT_TRUE(delete_room(folder() / "annex.journal", false));
  EXPECT_FALSE(fs::exists(folder() / "annex.journal-owner"));
  ASSERT_TRUE(note_owner(folder() / "annex.journal", "ina"));
  ASSERT_TRUE(rooms.create("annex", nullptr));
  EXPECT_EQ(rooms.owner("annex"), "");
}

TEST_F(Owners, AreErasedWithTime) {
  ASSERT_TRUE(note_owner(folder() / "ward.journal", "ina"));
  ASSERT_TRUE(note_owner(folder() / "w.backup", "otto"));
  const fs::path older = folder() / "ward.journal-owner";
  fs::last_write_time(older, fs::file_time_type::clock::now() - std::chrono::days(366));
  EXPECT_EQ(forget_owners(folder(), std::chrono::days(365)), 1u);
  EXPECT_EQ(owner_of(folder() / "ward.journal"), "");
  EXPECT_EQ(owner_of(folder() / "w.backup"), "otto");
  // The server does so by itself.
  fs::last_write_time(folder() / "w.backup-owner", fs::file_time_type::clock::now() - std::chrono::days(366));
  server_.reset();
  const Rooms rooms({.cases = {{test::test_block(), dir_ / "case"}}, .folder = folder(), .retention_days = 365});
  EXPECT_TRUE(test::wait_until([&] { return rooms.owner("w.backup").empty(); }, 20s));
}

}  // namespace
}  // namespace osteon
