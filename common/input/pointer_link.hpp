// A local socket between a window and the haptic client of the same user. The window sends where the pointer is, the
// client what the tool does. Each message is one packet of JSON text. The newest message counts, so neither side waits.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"
#include "common/input/local_link.hpp"

namespace osteon {

// A window that sends nothing for so long counts as hung. The hand then stops, and pushes only after a new press.
inline constexpr std::chrono::milliseconds kPointerSilence{1000};
inline constexpr double kLeastPush_n = 1.0, kMostPush_n = 40.0;
inline constexpr double kSharp = 1.0, kBluntest = 5.0;  // of wear

// What leads the pointer.
enum class PointerSource : std::uint8_t { mouse, pen, game_pad };
inline constexpr std::array<std::string_view, 3> kPointerSources{"mouse", "pen", "game pad"};
[[nodiscard]] constexpr std::string_view name_of(PointerSource source) {
  return kPointerSources[static_cast<std::size_t>(source)];
}

// From the window. Frame: bone.
struct PointerInput {
  Vec3 target_mm = Vec3::Zero();  // where the tool's tip rests: the point of the surface under the pointer
  Eigen::Quaterniond rotation_bone_tool = Eigen::Quaterniond::Identity();  // the hand pushes along the tool's +z
  bool on_bone = false;      // false: the pointer is not over bone; the tool is lifted off and waits
  bool push = false;         // the button is held
  bool irrigation = false;   // of the other hand; off in a message without this field
  bool suction = false;      // of the other hand; off in a message without this field
  double push_n = 10.0;      // kLeastPush_n to kMostPush_n
  bool fine = false;         // motions across the axis at a tenth, while the hand pushes
  double spindle = 0.0;      // share of the spindle's speed, 0 to 1
  double spindle_rpm = 0.0;  // its full speed; 0: the tool's own
  std::string tool{};        // that the hand is to hold; empty: no change
  bool empty_hand = false;   // the hand holds no tool, and nobody sees one; off in a message without this field
  // The wear that the tool gets, kSharp to kBluntest. It acts only when it changes. Cutting then blunts the tool
  // further. None, as in a message without this field: the tool keeps its wear.
  std::optional<double> wear{};
  std::string law{};  // the force law of that tool; empty, or without this field: the one it began with
  PointerSource source = PointerSource::mouse;
  friend bool operator==(const PointerInput&, const PointerInput&) = default;
};

// From the haptic client. Frame: bone.
struct PointerOutput {
  Pose pose_bone_tool;
  Vec3 force_hand_n = Vec3::Zero(), force_bone_n = Vec3::Zero();  // what the hand gets, what the bone gives
  double device_holds_n = 0;     // the largest force that the device holds for long; 0: not known
  double push_n = 0;             // with which the hand pushes now
  double depth_mm = 0;           // of the tip along its axis since the push began
  bool pushing = false;          // false while the button is held: the hand has reacted to a breakthrough
  bool on_metal = false;         // metal is in the way of the turning tool
  bool saturated = false;        // the device cannot hold what it should show
  std::string tool{};            // in the hand
  std::optional<double> wear{};  // of that tool, kSharp to kBluntest; none: an older client does not say
  std::string law{};             // by which that tool resists; empty: an older client does not say
  std::string trouble{};         // one sentence, such as why a tool cannot be held; empty: none
};

// As text, and back. A text of more than 512 bytes is shortened. Errors of reading, invalid_input: another version; a
// field that is missing, of another type, not finite, out of its range, or too long.
[[nodiscard]] std::string encode(const PointerInput& input);
[[nodiscard]] std::string encode(const PointerOutput& output);
[[nodiscard]] Result<PointerInput> read_pointer_input(std::string_view text);
[[nodiscard]] Result<PointerOutput> read_pointer_output(std::string_view text);

[[nodiscard]] LocalLinkNames pointer_link_names();

// The window's end, and the haptic client's.
using PointerServer = LocalMessageServer<PointerInput, PointerOutput, read_pointer_output, pointer_link_names>;
using PointerClient = LocalMessageClient<PointerOutput, PointerInput, read_pointer_input, pointer_link_names>;

}  // namespace osteon
