#include "viewer_client/scene/gauges.hpp"

#include <cmath>
#include <cstdio>
#include <string_view>

namespace osteon {

namespace {

std::string_view word(CuttingPhase phase) {
  switch (phase) {
    case CuttingPhase::idle:
      return "idle";
    case CuttingPhase::free:
      return "running free";
    case CuttingPhase::cutting:
      return "cutting";
    case CuttingPhase::rubbing:
      return "rubbing";
  }
  return "";
}

template <class... Values>
std::string line(const char* format, Values... values) {
  char text[96];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// Rounded so that no gauge ever shows a negative zero.
double rounded(double value, double step) { return std::round(value / step) * step + 0.0; }

}  // namespace

std::string gauge_text(const CuttingState& state) {
  std::string text = (state.tool_name.empty() ? "empty hand" : state.tool_name) + ", " + std::string(word(state.phase));
  text += line("\n%.0f rpm", rounded(state.spindle_rpm, 1.0));
  text += line("\nforce %.1f N", rounded(state.force_physical_N.norm(), 0.1));
  text += line("\ndepth %.1f mm", rounded(state.depth_mm, 0.1));
  if (state.on_metal) text += "\non metal: it does not cut";
  if (state.flutes_full >= 0.005) text += line("\nflutes %.0f %% full", rounded(100.0 * state.flutes_full, 1.0));
  if (state.irrigation) text += "\nirrigation";
  if (state.suction) text += "\nsuction";
  // Without contact there is no density to show.
  if (state.engaged_fraction > 0.0) text += line("\ndensity %.2f g/cm\xC2\xB3", rounded(state.density_g_cm3, 0.01));
  return text;
}

}  // namespace osteon
