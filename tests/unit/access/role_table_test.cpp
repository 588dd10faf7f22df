#include "common/access/role_table.hpp"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/architecture/proto_rules.hpp"

namespace osteon {
namespace {

using Names = std::set<std::string>;
constexpr Role kAll[] = {Role::none,         Role::observer,   Role::trainee,
                         Role::collaborator, Role::instructor, Role::operator_};

Names compiled_calls() {
  Names names;
  std::ifstream in(OSTEON_DESCRIPTOR, std::ios::binary);
  const test::Protocol protocol = test::load_protocol(std::string(std::istreambuf_iterator<char>(in), {}));
  for (const auto* file : protocol.files)
    for (int s = 0; s < file->service_count(); ++s)
      for (int m = 0; m < file->service(s)->method_count(); ++m)
        names.insert("/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name());
  return names;
}

// The calls that each role may make beyond the role before it. They follow the description of the roles for people.
Names allowed(Role role) {
  const std::string room = "/osteon.v1.RoomService/", watch = "/osteon.v1.WatchService/",
                    people = "/osteon.v1.PeopleService/", rooms = "/osteon.v1.RoomsService/",
                    cases = "/osteon.v1.CaseService/";
  Names names;
  if (role == Role::operator_) {
    for (const char* call : {"ListRooms", "CreateRoom", "CloseRoom", "ResumeRoom", "BranchRoom", "DeleteRoom",
                             "VerifyRoom", "BackUpRoom", "ReplayRoom"})
      names.insert(rooms + call);
    names.insert({cases + "UploadCase", cases + "ListCases"});
    return names;
  }
  if (role >= Role::observer)
    names.insert({room + "Join", room + "GetStatus", room + "GetCase", room + "ListTools", room + "GetTool",
                  watch + "WatchMesh", watch + "WatchCutting", watch + "LookFrom", people + "WatchPeople",
                  "/osteon.v1.PlanService/GetPlan", "/osteon.v1.PlanService/GetDensity",
                  "/osteon.v1.FieldService/WatchField"});
  if (role >= Role::trainee)
    names.insert({"/osteon.v1.CuttingService/Session", room + "AddTool", room + "Undo", room + "Redo", room + "Mark",
                  room + "SetSceneItem", room + "RemoveSceneItem", people + "Say", people + "ShareShots"});
  if (role >= Role::instructor)
    names.insert({people + "Supervise", people + "Annotate", people + "Demonstrate", people + "EndDemonstration",
                  room + "RemoveBody", room + "SaveFields", rooms + "ListRooms", rooms + "DeleteRoom",
                  rooms + "VerifyRoom", rooms + "BranchRoom", rooms + "ReplayRoom", cases + "ListCases"});
  return names;
}

TEST(RoleTable, HasARowForEveryCallOfTheProtocolAndNoOther) {
  const Names compiled = compiled_calls();
  ASSERT_GT(compiled.size(), 30u);
  Names entries;
  for (const CallRow& entry : call_rows())
    EXPECT_TRUE(entries.insert(std::string(entry.method)).second) << entry.method << " has two entries";
  for (const std::string& call : compiled)
    EXPECT_TRUE(entries.contains(call)) << call << " has no entry in common/access/role_table.cpp";
  for (const std::string& entry : entries)
    EXPECT_TRUE(compiled.contains(entry)) << entry << " is no call of the protocol";
}

TEST(RoleTable, LetsEveryRoleCallWhatItIsFor) {
  for (const Role role : kAll) {
    const Names expected = allowed(role);
    for (const std::string& call : compiled_calls())
      EXPECT_EQ(may_call(role, call), expected.contains(call)) << to_string(role) << " " << call;
  }
}

TEST(RoleTable, RefusesWhatItDoesNotKnow) {
  for (const Role role : kAll)
    for (const char* call : {"", "/", "Join", "/osteon.v1.RoomService/join", "/osteon.v1.RoomService/Join ",
                             "/osteon.v1.RoomService/Joi", "/grpc.health.v1.Health/Watch"})
      EXPECT_FALSE(may_call(role, call)) << to_string(role) << " " << call;
}

TEST(RoleTable, CarriesNothingOfAToolForThoseWhoHoldNone) {
  for (int kind = 0; kind < kDatagrams; ++kind)
    for (const Role role : kAll)
      EXPECT_EQ(may_carry(role, static_cast<DatagramContent>(kind)),
                role == Role::trainee || role == Role::collaborator || role == Role::instructor)
          << to_string(role) << " " << kind;
}

TEST(RoleTable, ShowsOthersToTheInstructorAlone) {
  for (const Role role : kAll) {
    const bool in_room = role != Role::none && role != Role::operator_;
    EXPECT_EQ(may_receive(role, StreamContent::surface), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::tool_states), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::scene), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::people), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::own_words), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::own_supervision), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::field), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::shots), in_room);
    EXPECT_EQ(may_receive(role, StreamContent::others_words), role == Role::instructor);
    EXPECT_EQ(may_receive(role, StreamContent::others_supervision), role == Role::instructor);
  }
}

TEST(RoleTable, GivesRightsInSteps) {
  const std::map<Role, std::vector<bool>> expected{
      {Role::none, {false, false, false, false}},   {Role::observer, {false, false, false, false}},
      {Role::trainee, {true, true, false, false}},  {Role::collaborator, {true, true, true, false}},
      {Role::instructor, {true, true, true, true}}, {Role::operator_, {false, false, false, false}}};
  for (const auto& [role, rights] : expected)
    for (int right = 0; right < kRights; ++right)
      EXPECT_EQ(has_right(role, static_cast<Right>(right)), rights[static_cast<std::size_t>(right)])
          << to_string(role) << " " << right;
}

TEST(Role, IsWrittenAndReadBack) {
  for (const Role role : kAll)
    EXPECT_EQ(parse_role(to_string(role)), role == Role::none ? std::optional<Role>() : role);
  EXPECT_EQ(to_string(Role::operator_), "operator");
  for (const char* text : {"", "Observer", "operator_", "observer ", "admin"}) EXPECT_FALSE(parse_role(text)) << text;
}

}  // namespace
}  // namespace osteon
