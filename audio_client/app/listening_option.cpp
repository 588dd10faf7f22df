#include "audio_client/app/listening_option.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <utility>

#include "audio_client/space/sofa_file.hpp"
#include "common/runtime/number_option.hpp"

namespace osteon::audio {

void add_listening(CLI::App& command, ListeningOption& listening, const std::string& middle) {
  command
      .add_option("--listen", listening.listen,
                  "loudspeakers: from near the tool, by level; headphones: from the surgeon's head, by HRTF; mono")
      ->capture_default_str();
  command.add_option("--hrtf", listening.hrtf,
                     "SOFA file of a head, for headphones; by default, the one that libmysofa comes with");
  command
      .add_option(
          "--listener", listening.listener_mm,
          "X Y Z of the listener, mm from the middle of " + middle +
              " along the axes of its scan. The listener looks at the middle. By default, at the right side of a "
              "patient who lies on the back")
      ->expected(3)
      ->check(number_in(-kFarthest_mm, kFarthest_mm));
  command
      .add_option("--listener-up", listening.up, "X Y Z of a direction that is up for the listener; by default 0 -1 0")
      ->expected(3)
      ->check(number_in(-1e6, 1e6));
}

Result<Space> read(const ListeningOption& option, double rate_hz) {
  const Result<Listening> way = listening(option.listen);
  if (!way) return tl::unexpected(way.error());
  if (!option.hrtf.empty() && *way != Listening::headphones)
    return failure(ErrorCode::invalid_input, "--hrtf is of headphones only; add --listen headphones");
  Space space;
  space.listening = *way;
  if (*way == Listening::mono && !(option.listener_mm.empty() && option.up.empty()))
    return failure(ErrorCode::invalid_input,
                   "--listener and --listener-up are of loudspeakers and headphones only; leave them out, or choose "
                   "another --listen than mono");
  if (*way == Listening::mono) return space;  // from nowhere
  const auto vector = [](const std::vector<double>& given, const Vec3& usual) {
    return given.size() == 3 ? Vec3(given[0], given[1], given[2]) : usual;
  };
  const Vec3 from_mm = vector(option.listener_mm, usual_listener_mm(*way));
  if (from_mm.norm() < 1e-6)
    return failure(ErrorCode::invalid_input, "--listener 0 0 0 is inside the bone, and looks nowhere; move it away");
  const Vec3 up = vector(option.up, -Vec3::UnitY());
  if (up.norm() < 1e-6)
    return failure(ErrorCode::invalid_input, "--listener-up 0 0 0 is no direction; give one, such as 0 -1 0");
  // Otherwise nothing says which side is left.
  if (from_mm.normalized().cross(up.normalized()).norm() < 1e-6)
    return failure(ErrorCode::invalid_input,
                   "the listener looks along the direction that is up, so no side is left; give --listener-up a "
                   "direction across the look, such as " +
                       std::string(std::abs(up.normalized().z()) < 0.7 ? "0 0 1" : "0 -1 0"));
  space.pose_bone_head = looking(from_mm, Vec3::Zero(), up);
  if (*way != Listening::headphones) return space;
  Result<Hrtf> hrtf = read_hrtf(option.hrtf, rate_hz);
  if (!hrtf) return tl::unexpected(hrtf.error());
  space.hrtf = std::make_shared<const Hrtf>(std::move(*hrtf));
  return space;
}

void move_to_middle(Space& space, const Vec3& middle_mm) { space.pose_bone_head.position_mm += middle_mm; }

}  // namespace osteon::audio
