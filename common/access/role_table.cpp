#include "common/access/role_table.hpp"

#include <algorithm>
#include <array>

namespace osteon {
namespace {

constexpr RoleSet kInRoom{Role::observer, Role::trainee, Role::collaborator, Role::instructor};
constexpr RoleSet kCutters{Role::trainee, Role::collaborator, Role::instructor};
constexpr RoleSet kPartners{Role::collaborator, Role::instructor};
constexpr RoleSet kInstructor{Role::instructor};
constexpr RoleSet kOperator{Role::operator_};
constexpr RoleSet kInstructorOrOperator{Role::instructor, Role::operator_};

constexpr std::array kCalls{
    CallRow{"/osteon.v1.RoomService/Join", kInRoom},
    CallRow{"/osteon.v1.RoomService/GetStatus", kInRoom},
    CallRow{"/osteon.v1.RoomService/GetCase", kInRoom},
    CallRow{"/osteon.v1.RoomService/ListTools", kInRoom},
    CallRow{"/osteon.v1.RoomService/GetTool", kInRoom},
    CallRow{"/osteon.v1.RoomService/AddTool", kCutters},
    CallRow{"/osteon.v1.RoomService/Undo", kCutters},
    CallRow{"/osteon.v1.RoomService/Redo", kCutters},
    CallRow{"/osteon.v1.RoomService/Mark", kCutters},
    CallRow{"/osteon.v1.RoomService/RemoveBody", kInstructor},
    CallRow{"/osteon.v1.RoomService/SetSceneItem", kCutters},
    CallRow{"/osteon.v1.RoomService/RemoveSceneItem", kCutters},
    CallRow{"/osteon.v1.RoomService/SaveFields", kInstructor},
    CallRow{"/osteon.v1.CuttingService/Session", kCutters},
    CallRow{"/osteon.v1.WatchService/WatchMesh", kInRoom},
    CallRow{"/osteon.v1.WatchService/LookFrom", kInRoom},
    CallRow{"/osteon.v1.WatchService/WatchCutting", kInRoom},
    CallRow{"/osteon.v1.FieldService/WatchField", kInRoom},
    CallRow{"/osteon.v1.PlanService/GetPlan", kInRoom},
    CallRow{"/osteon.v1.PlanService/GetDensity", kInRoom},
    // Annotations and messages reach everybody. The stream leaves out what a role may not receive.
    CallRow{"/osteon.v1.PeopleService/WatchPeople", kInRoom},
    CallRow{"/osteon.v1.PeopleService/Supervise", kInstructor},
    CallRow{"/osteon.v1.PeopleService/Annotate", kInstructor},
    CallRow{"/osteon.v1.PeopleService/Say", kCutters},
    CallRow{"/osteon.v1.PeopleService/ShareShots", kCutters},
    CallRow{"/osteon.v1.PeopleService/Demonstrate", kInstructor},
    CallRow{"/osteon.v1.PeopleService/EndDemonstration", kInstructor},
    CallRow{"/osteon.v1.RoomsService/ListRooms", kInstructorOrOperator},
    CallRow{"/osteon.v1.RoomsService/CreateRoom", kOperator},
    CallRow{"/osteon.v1.RoomsService/CloseRoom", kOperator},
    CallRow{"/osteon.v1.RoomsService/ResumeRoom", kOperator},
    CallRow{"/osteon.v1.RoomsService/BranchRoom", kInstructorOrOperator},
    CallRow{"/osteon.v1.RoomsService/DeleteRoom", kInstructorOrOperator},  // an instructor: only rooms that they made
    CallRow{"/osteon.v1.RoomsService/VerifyRoom", kInstructorOrOperator},
    CallRow{"/osteon.v1.RoomsService/BackUpRoom", kOperator},
    CallRow{"/osteon.v1.RoomsService/ReplayRoom", kInstructorOrOperator},
    CallRow{"/osteon.v1.CaseService/UploadCase", kOperator},
    CallRow{"/osteon.v1.CaseService/ListCases", kInstructorOrOperator},
};

// In the order of the enumerations.
constexpr std::array<RoleSet, kDatagrams> kCarried{kCutters, kCutters, kCutters, kCutters,
                                                   kCutters, kCutters, kCutters, kCutters};
constexpr std::array<RoleSet, kStreamContents> kContents{kInRoom, kInRoom,     kInRoom, kInRoom,     kInRoom,
                                                         kInRoom, kInstructor, kInRoom, kInstructor, kInRoom};
constexpr std::array<RoleSet, kRights> kGranted{kCutters, kCutters, kPartners, kInstructor};

}  // namespace

std::span<const CallRow> call_rows() { return kCalls; }

const CallRow* find_call(std::string_view method) {
  const auto row = std::ranges::find(kCalls, method, &CallRow::method);
  return row == kCalls.end() ? nullptr : &*row;
}

std::string_view call_name(std::string_view method) {
  if (method.empty()) return "call";
  return method.substr(method.rfind('/') + 1);
}

bool may_call(Role role, std::string_view method) {
  const CallRow* row = find_call(method);
  return row != nullptr && row->roles.has(role);
}

bool may_carry(Role role, DatagramContent kind) { return kCarried.at(static_cast<std::size_t>(kind)).has(role); }
bool may_receive(Role role, StreamContent content) { return kContents.at(static_cast<std::size_t>(content)).has(role); }
bool has_right(Role role, Right right) { return kGranted.at(static_cast<std::size_t>(right)).has(role); }

}  // namespace osteon
