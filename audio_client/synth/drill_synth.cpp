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
  suction_.reset();
  limiter_.reset();
  block_.fill(0.0F);
  used_ = kBlockFrames;
  tail_blocks_ = 0;
}

const Handpiece& DrillSynth::handpiece_of(const ToolSound& tool) const noexcept {
  const auto known =
      std::ranges::lower_bound(pieces_, tool.tool, {}, [](const Piece& p) { return std::string_view(p.tool); });
  return known != pieces_.end() && known->tool == tool.tool ? known->handpiece
                                                            : unknown_[static_cast<std::size_t>(tool.handpiece)];
}

void DrillSynth::aim(const SoundScene& scene) noexcept {
  std::array<bool, kVoices> aimed{};
  const auto tools = std::span(scene.tools).first(static_cast<std::size_t>(scene.count));
  suction_.aim(std::ranges::any_of(tools, &ToolSound::suction));
  for (int t = 0; t < scene.count; ++t) {
    const ToolSound& tool = scene.tools[static_cast<std::size_t>(t)];
    const Handpiece& handpiece = handpiece_of(tool);
    const auto same = std::find_if(voices_.begin(), voices_.end(), [&](const Voice& v) {
      return (v.sounding() || v.waits()) && v.author() == tool.author && v.handpiece() == &handpiece;
    });
    if (same != voices_.end()) {
      same->aim(tool);
      aimed[static_cast<std::size_t>(same - voices_.begin())] = true;
      continue;
    }
    // At rest there is no sound. But the voice of a tool that is struck must know how many blows there were.
    if (tool.rpm == 0 && handpiece.model.drive != Drive::blows) continue;
    const auto free =
        std::find_if(voices_.begin(), voices_.end(), [](const Voice& v) { return !v.sounding() && !v.waits(); });
    if (free == voices_.end()) continue;
    free->start(handpiece, params_.voice, params_.rate_hz, tool, params_.seed + tool.author);
    aimed[static_cast<std::size_t>(free - voices_.begin())] = true;
  }
  for (std::size_t v = 0; v < voices_.size(); ++v) {
    if ((voices_[v].sounding() || voices_[v].waits()) && !aimed[v]) voices_[v].release();
  }
}

void DrillSynth::process(std::span<float> frames) noexcept {
  while (!frames.empty()) {
    if (used_ == kBlockFrames) render_block();
    const std::size_t count = std::min(frames.size(), static_cast<std::size_t>(kBlockFrames - used_));
    std::copy_n(block_.begin() + used_, count, frames.begin());
    used_ += static_cast<int>(count);
    frames = frames.subspan(count);
  }
}

void DrillSynth::render_block() noexcept {
  block_.fill(0.0F);
  for (Voice& voice : voices_) {
    if (!voice.sounding()) continue;
    voice.add_to(block_);
    tail_blocks_ = 2;
  }
  if (suction_.sounding()) {
    suction_.add_to(block_);
    tail_blocks_ = 2;
  }
  limiter_.process(block_);
  tail_blocks_ = std::max(0, tail_blocks_ - 1);
  used_ = 0;
}

bool DrillSynth::silent() const noexcept {
  return tail_blocks_ == 0 && !suction_.sounding() &&
         std::none_of(voices_.begin(), voices_.end(), [](const Voice& v) { return v.sounding(); });
}

}  // namespace osteon::audio
