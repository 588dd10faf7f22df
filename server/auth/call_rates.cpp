#include "server/auth/call_rates.hpp"

#include <algorithm>
#include <array>

namespace osteon {
namespace {

// Programs connect again by themselves, over a bad line a few times a second. Each join stays in the room's memory and
// journal.
constexpr CallRate kComing{4.0, 60.0};
// Each is an entry of the journal that everybody in the room is sent.
constexpr CallRate kSaying{5.0, 40.0};
// The same, for calls in quick succession, as when a tool is dragged or a script runs.
constexpr CallRate kChanging{20.0, 100.0};
// Each goes to everybody in the room, and to no journal. A window sends four a second.
constexpr CallRate kShooting{8.0, 40.0};
// Each copies all leaves of the bone.
constexpr CallRate kCopying{1.0, 10.0};
// Needs the bone, and is what programs ask again and again while they wait.
constexpr CallRate kLookingUp{100.0, 100.0};

struct Row {
  std::string_view method;
  CallRate rate;
};
constexpr std::array kRates{
    Row{"/osteon.v1.RoomService/Join", kComing},           Row{"/osteon.v1.CuttingService/Session", kComing},
    Row{"/osteon.v1.WatchService/WatchMesh", kComing},     Row{"/osteon.v1.WatchService/WatchCutting", kComing},
    Row{"/osteon.v1.PeopleService/WatchPeople", kComing},  Row{"/osteon.v1.RoomService/Mark", kSaying},
    Row{"/osteon.v1.PeopleService/Say", kSaying},          Row{"/osteon.v1.PeopleService/Annotate", kChanging},
    Row{"/osteon.v1.PeopleService/Supervise", kChanging},  Row{"/osteon.v1.PeopleService/Demonstrate", kSaying},
    Row{"/osteon.v1.RoomService/AddTool", kChanging},      Row{"/osteon.v1.RoomService/Undo", kChanging},
    Row{"/osteon.v1.RoomService/Redo", kChanging},         Row{"/osteon.v1.RoomService/RemoveBody", kChanging},
    Row{"/osteon.v1.RoomService/SetSceneItem", kChanging}, Row{"/osteon.v1.RoomService/RemoveSceneItem", kChanging},
    Row{"/osteon.v1.RoomService/SaveFields", kSaying},     Row{"/osteon.v1.RoomService/GetStatus", kLookingUp},
    Row{"/osteon.v1.RoomService/GetCase", kComing},        Row{"/osteon.v1.RoomsService/BranchRoom", kSaying},
    Row{"/osteon.v1.RoomsService/ReplayRoom", kSaying},    Row{"/osteon.v1.PlanService/GetPlan", kComing},
    Row{"/osteon.v1.PlanService/GetDensity", kComing},     Row{"/osteon.v1.FieldService/WatchField", kCopying},
    Row{"/osteon.v1.PeopleService/ShareShots", kShooting},
};

}  // namespace

const CallRate* find_call_rate(std::string_view method) {
  const auto row = std::ranges::find(kRates, method, &Row::method);
  return row == kRates.end() ? nullptr : &row->rate;
}

double CallRates::Bucket::left_at(Time now) const {
  if (now <= when) return left;
  return std::min(rate->at_once, left + rate->per_second * std::chrono::duration<double>(now - when).count());
}

void CallRates::make_space(Time now) {
  if (buckets_.size() < kMost) return;
  std::erase_if(buckets_, [now](const auto& entry) { return entry.second.left_at(now) >= entry.second.rate->at_once; });
  if (buckets_.size() >= kMost) buckets_.clear();
}

bool CallRates::take(std::string_view user, std::string_view method, Time now) {
  const CallRate* rate = find_call_rate(method);
  if (rate == nullptr) return true;
  std::pair<std::string, std::string> key(user, method);
  auto found = buckets_.find(key);
  if (found == buckets_.end()) {
    make_space(now);
    found = buckets_.emplace(std::move(key), Bucket{rate->at_once, now, rate}).first;
  }
  Bucket& bucket = found->second;
  bucket.left = bucket.left_at(now);
  bucket.when = std::max(bucket.when, now);
  if (bucket.left < 1.0) return false;
  bucket.left -= 1.0;
  return true;
}

}  // namespace osteon
