#include "audio_client/synth/drill_synth.hpp"

#include <algorithm>
#include <string_view>

#include "audio_client/presets/preset_file.hpp"
#include "common/core/check.hpp"
#include "common/tools/tool.hpp"
#include "common/tools/tool_file.hpp"

namespace osteon::audio {

void DrillSynth::prepare(const SynthParams& params) {
  OSTEON_CHECK(params.rate_hz > 0);
  params_ = params;
  std::vector<ToolModel> presets = params.presets;
  presets.insert(presets.end(), builtin_presets().begin(), builtin_presets().end());
  const auto made = [&](std::string_view name, std::string_view kind, const Tool* tool) {
    const ToolModel* model = preset_for(presets, name, kind);
    return make_handpiece(model ? *model : *preset_for(presets, "", "drill"), tool, params.rate_hz);
  };
  pieces_.clear();
  for (const Tool& tool : builtin_tools())
    if (preset_for(presets, tool.name, kind_name(tool.kind)))
      pieces_.push_back({tool.name, made(tool.name, kind_name(tool.kind), &tool)});
  std::ranges::sort(pieces_, {}, &Piece::tool);
  const Result<Tool> drill = find_tool("drill-3.2"), burr = find_tool("burr-round-5");
  OSTEON_CHECK(drill && burr);
  unknown_ = {made("", "drill", &*drill), made("", "round-burr", &*burr)};
  suction_.prepare(params.suction, *preset_for(presets, "suction", ""), params.rate_hz, params.seed);
  reset();
}

void DrillSynth::reset() noexcept {
  voices_.fill(Voice{});
  for (SoundPath& path : paths_) path.prepare(params_.space, params_.rate_hz);
  suction_path_.prepare(params_.space, params_.rate_hz);
  suction_.reset();
  limiter_.reset();
  block_ = StereoBlock{};
  used_ = kBlockFrames;
  tail_blocks_ = 0;
}

void DrillSynth::listen(const Space& space) noexcept {
  params_.space = space;
  reset();
}

void DrillSynth::aim_suction(std::span<const ToolSound> tools) noexcept {
  const auto first = std::ranges::find_if(tools, &ToolSound::suction);
  const bool on = first != tools.end();
  if (on && !suction_.sounding() && !suction_path_.ringing()) suction_path_.start(first->tip_mm);
  if (on) suction_path_.aim(first->tip_mm);
  suction_.aim(on);
}

const Handpiece& DrillSynth::handpiece_of(const ToolSound& tool) const noexcept {
  const auto known =
      std::ranges::lower_bound(pieces_, tool.tool, {}, [](const Piece& p) { return std::string_view(p.tool); });
  return known != pieces_.end() && known->tool == tool.tool ? known->handpiece
                                                            : unknown_[static_cast<std::size_t>(tool.handpiece)];
}

void DrillSynth::aim(const SoundScene& scene) noexcept {
  std::array<bool, kVoices> aimed{};
  aim_suction(std::span(scene.tools).first(static_cast<std::size_t>(scene.count)));
  for (int t = 0; t < scene.count; ++t) {
    const ToolSound& tool = scene.tools[static_cast<std::size_t>(t)];
    const Handpiece& handpiece = handpiece_of(tool);
    const auto same = std::find_if(voices_.begin(), voices_.end(), [&](const Voice& v) {
      return (v.sounding() || v.waits()) && v.author() == tool.author && v.handpiece() == &handpiece;
    });
    if (same != voices_.end()) {
      const auto at = static_cast<std::size_t>(same - voices_.begin());
      // While nothing sounds, the way does not follow the tool.
      quiet(at) ? paths_[at].start(tool.tip_mm) : paths_[at].aim(tool.tip_mm);
      same->aim(tool);
      aimed[at] = true;
      continue;
    }
    // At rest there is no sound. But the voice of a tool that is struck must know how many blows there were.
    if (tool.rpm == 0 && handpiece.model.drive != Drive::blows) continue;
    std::size_t free = 0;
    while (free < voices_.size() && !vacant(free)) ++free;
    if (free == voices_.size()) continue;
    paths_[free].start(tool.tip_mm);
    voices_[free].start(handpiece, params_.voice, params_.rate_hz, tool, params_.seed + tool.author);
    aimed[free] = true;
  }
  for (std::size_t v = 0; v < voices_.size(); ++v) {
    if ((voices_[v].sounding() || voices_[v].waits()) && !aimed[v]) voices_[v].release();
  }
}

void DrillSynth::process(std::span<float> left, std::span<float> right) noexcept {
  OSTEON_CHECK(left.size() == right.size());
  for (std::size_t done = 0; done < left.size();) {
    if (used_ == kBlockFrames) render_block();
    const std::size_t count = std::min(left.size() - done, static_cast<std::size_t>(kBlockFrames - used_));
    std::copy_n(block_.left.begin() + used_, count, left.subspan(done).begin());
    std::copy_n(block_.right.begin() + used_, count, right.subspan(done).begin());
    used_ += static_cast<int>(count);
    done += count;
  }
}

void DrillSynth::process(std::span<float> mono) noexcept {
  Block other;
  while (!mono.empty()) {
    const std::span<float> part = mono.first(std::min(mono.size(), other.size()));
    process(part, std::span(other).first(part.size()));
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = 0.5F * (part[i] + other[i]);
    mono = mono.subspan(part.size());
  }
}

void DrillSynth::render_block() noexcept {
  block_ = StereoBlock{};
  for (std::size_t v = 0; v < voices_.size(); ++v) {
    if (quiet(v)) continue;
    Block own{};
    if (voices_[v].sounding()) voices_[v].add_to(own);
    paths_[v].add_to(own, block_);
    tail_blocks_ = 2;
  }
  if (suction_.sounding() || suction_path_.ringing()) {
    Block own{};
    if (suction_.sounding()) suction_.add_to(own);
    suction_path_.add_to(own, block_);
    tail_blocks_ = 2;
  }
  limiter_.process(block_);
  tail_blocks_ = std::max(0, tail_blocks_ - 1);
  used_ = 0;
}

bool DrillSynth::silent() const noexcept {
  if (tail_blocks_ != 0 || suction_.sounding() || suction_path_.ringing()) return false;
  for (std::size_t v = 0; v < voices_.size(); ++v)
    if (!quiet(v)) return false;
  return true;
}

}  // namespace osteon::audio
