#include "haptic_client/app/record.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "common/runtime/files.hpp"

namespace osteon::haptic {

const char* name(CuttingPhase phase) {
  switch (phase) {
    case CuttingPhase::idle:
      return "idle";
    case CuttingPhase::free:
      return "free";
    case CuttingPhase::cutting:
      return "cutting";
    case CuttingPhase::rubbing:
      return "rubbing";
  }
  return "unknown";
}

std::string law_name(const ToolModel& model) { return std::string(model.law->name); }

std::vector<std::string> event_names() {
  constexpr std::array kNames{"uncovered",       "force limited", "slew limited", "cuts waiting", "missed ticks",
                              "heel contact",    "guided",        "stalled",      "breakthrough", "pushed away",
                              "energy limited",  "ramping",       "room held",    "forbidden",    "hand guided",
                              "partner touched", "on metal"};
  static_assert(kNames.size() == kLoopEvents);
  return {kNames.begin(), kNames.end()};
}

std::vector<std::string> range_names() {
  const auto names = out_of_range_names();
  return {names.begin(), names.end()};
}

std::string MetalWatch::note(const ToolModel& model, const LoopReport& report) {
  if (!(report.events & kOnMetal)) return {};
  const bool begins = last_seq_ == 0 || report.state_seq > last_seq_ + kApart_ticks;
  last_seq_ = report.state_seq;
  if (!begins) return {};
  return model.tool.name + " stands on metal, which it does not cut: draw it back and go around the metal";
}

std::string RangeWatch::note(const ToolModel& model, const LoopReport& report) {
  if (report.cutting.out_of_range == 0) return {};
  const ForceLaw* law = report.cutting.law ? report.cutting.law : model.law;
  const auto found = std::ranges::find(uses_, law, &Use::law);
  const auto at = static_cast<std::size_t>(found - uses_.begin());
  if (found == uses_.end()) {
    uses_.push_back({law, 0, 0});
    stays_.push_back({report.state_seq - 1});
  }
  uses_[at].bits |= report.cutting.out_of_range;
  ++uses_[at].ticks;
  Stay& stay = stays_[at];
  const auto since = static_cast<std::int64_t>(report.state_seq - stay.last_seq);
  stay.ticks = std::max<std::int64_t>(0, stay.ticks - (since - 1)) + 1;
  stay.last_seq = report.state_seq;
  if (stay.reported || stay.ticks < kLasting_ticks) return {};
  stay.reported = true;
  return out_of_range_sentence(*law, report.cutting.out_of_range);
}

Result<void> SessionLog::open(const std::filesystem::path& file, const DeviceInfo& device, AuthorId author) {
  path_ = file;
  author_ = author;
  shows_force_ = device.force_axes > 0;
  if (file.empty()) return {};
  file_.open(file, std::ios::trunc);
  if (!file_)
    return failure(ErrorCode::internal, "the session log " + file.string() + " cannot be written; choose another path");
  file_ << "time_s,mono_ns,state_seq,phase,tool,tip_x_mm,tip_y_mm,tip_z_mm,depth_mm,device_depth_mm,force_physical_n,"
           "force_rendered_n,feed_mm_per_s,density_g_cm3,engaged,rpm,torque_nmm,law_out_of_range,author,suction,"
           "cortex_mm,seated,blows,blow_impulse_n_s,axis_x,axis_y,axis_z\n";
  return {};
}

void SessionLog::write(const TickRow& row, const std::string& tool) {
  if (!file_.is_open()) return;
  if (first_mono_ns_ == 0) first_mono_ns_ = row.mono_ns;
  const LoopReport& r = row.report;
  const Vec3& tip = r.pose_bone_proxy.position_mm;
  const Vec3 axis = r.pose_bone_proxy.direction(Vec3::UnitZ());
  const double rendered_n = shows_force_ ? row.force_rendered_n : 0.0;
  char line[512];
  const int size = std::snprintf(
      line, sizeof line,
      "%.3f,%lld,%llu,%s,%s,%.5f,%.5f,%.5f,%.5f,%.5f,%.4f,%.4f,%.5f,%.4f,%.4f,%.2f,%.3f,%u,%llu,%d,%.3f,%.4f,%u,"
      "%.3f,%.6f,%.6f,%.6f\n",
      1e-9 * static_cast<double>(row.mono_ns - first_mono_ns_), static_cast<long long>(row.mono_ns),
      static_cast<unsigned long long>(r.state_seq), name(r.cutting.phase), tool.c_str(), tip.x(), tip.y(), tip.z(),
      row.depth_mm, row.device_depth_mm, r.coupling.force_n.norm(), rendered_n, r.cutting.feed_mm_per_s,
      r.cutting.density_g_cm3, r.cutting.engaged, r.spindle_rpm, r.cutting.torque_nmm, r.cutting.out_of_range,
      static_cast<unsigned long long>(author_.value), (row.reading.buttons & kSuction) != 0, row.cortex_mm,
      r.cutting.seated, r.cutting.blows, r.cutting.blow_impulse_n_s, axis.x(), axis.y(), axis.z());
  file_.write(line, size);
}

Result<void> SessionLog::finish() {
  if (!file_.is_open()) return {};
  file_.close();
  if (!file_)
    return failure(ErrorCode::internal,
                   "the session log " + path_.string() + " could not be written whole; is the disk full?");
  return {};
}

Result<void> write_cut_log(const std::filesystem::path& file, const std::vector<RecordedCut>& rows) {
  if (file.empty()) return {};
  std::string text = "author_seq,room_seq,closed_mono_ns,confirmed_mono_ns\n";
  for (const RecordedCut& row : rows)
    text += std::to_string(row.author_seq) + ',' + std::to_string(row.room_seq) + ',' +
            std::to_string(row.closed_mono_ns) + ',' + std::to_string(row.confirmed_mono_ns) + '\n';
  return write_file(file, text);
}

}  // namespace osteon::haptic
