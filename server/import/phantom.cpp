#include "server/import/phantom.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "common/imaging/calibration.hpp"
#include "server/import/import_steps.hpp"

namespace osteon::import {
namespace {

constexpr double kDensestLayer_g_cm3 = 3.0;  // enamel
constexpr double kThickest_mm = 500.0;
constexpr int kSubsamples = 16;  // along a voxel's edge, where the tube's circles cross it

// Integral over depth from zero of a value given for each layer. The outer layers continue beyond the ends.
template <class Value>
double integral(const std::vector<Layer>& layers, double depth_mm, Value value) {
  double sum = std::min(depth_mm, 0.0) * value(layers.front());
  double top = 0.0;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const bool last = i + 1 == layers.size();
    const double bottom = last ? std::numeric_limits<double>::infinity() : top + layers[i].thickness_mm;
    sum += std::max(0.0, std::min(depth_mm, bottom) - top) * value(layers[i]);
    top = bottom;
  }
  return sum;
}

double hu_above_air(const Layer& layer) {
  return imaging::hounsfield(imaging::kRho1995, layer.density_g_cm3) - imaging::kAir_hu;
}

// The length of the overlap of two intervals.
double overlap(double a_low, double a_high, double b_low, double b_high) {
  return std::max(0.0, std::min(a_high, b_high) - std::max(a_low, b_low));
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string describe(const Phantom& phantom) {
  std::string text = phantom.kind == PhantomKind::block ? "block phantom, width " : "tube phantom, length ";
  text += number(phantom.width_mm) + " mm, layers ";
  for (std::size_t i = 0; i < phantom.layers.size(); ++i)
    text += (i > 0 ? "," : "") + number(phantom.layers[i].thickness_mm) + ":" + number(phantom.layers[i].density_g_cm3);
  return text + " mm:g/cm3";
}

// Refuses pitches at which layers would lie between the samples, or the samples would fill the memory.
Result<void> check_pitch(const Phantom& phantom, double pitch_mm) {
  const double thinnest = std::ranges::min(phantom.layers, {}, &Layer::thickness_mm).thickness_mm;
  if (pitch_mm > thinnest || pitch_mm > phantom.width_mm)
    return failure(ErrorCode::invalid_input, "a pitch of " + number(pitch_mm) +
                                                 " mm is coarser than the phantom's thinnest layer or its width (" +
                                                 number(std::min(thinnest, phantom.width_mm)) +
                                                 " mm); give a smaller --pitch");
  const Vec3 samples = phantom.bounds().size_mm() / pitch_mm;
  if (samples.prod() > kLargestLattice)
    return failure(ErrorCode::invalid_input, "a pitch of " + number(pitch_mm) + " mm needs " +
                                                 std::to_string(std::llround(samples.prod() * 1e-6)) +
                                                 " million samples; give a larger --pitch");
  return {};
}

}  // namespace

Result<std::vector<Layer>> parse_layers(std::string_view text) {
  const auto wrong = [&](const std::string& what) {
    return failure(ErrorCode::invalid_input, "--layers " + std::string(text) + ": " + what +
                                                 "; write THICKNESS_MM:DENSITY_G_CM3,... such as 5:1.9,20:0.3,5:1.9");
  };
  const auto parse = [](std::string_view part, double& value) {
    const std::string digits(part);
    char* end = nullptr;
    value = std::strtod(digits.c_str(), &end);
    return !digits.empty() && *end == '\0' && std::isfinite(value);
  };
  std::vector<Layer> layers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view part = text.substr(begin, end - begin);
    const std::size_t colon = part.find(':');
    Layer layer;
    if (colon == std::string_view::npos || !parse(part.substr(0, colon), layer.thickness_mm) ||
        !parse(part.substr(colon + 1), layer.density_g_cm3))
      return wrong("\"" + std::string(part) + "\" is not a layer");
    if (layer.thickness_mm <= 0.0 || layer.thickness_mm > kThickest_mm)
      return wrong("a thickness must be above 0 and at most " + number(kThickest_mm) + " mm");
    if (layer.density_g_cm3 <= 0.0 || layer.density_g_cm3 > kDensestLayer_g_cm3)
      return wrong("a density must be above 0 and at most " + number(kDensestLayer_g_cm3) + " g/cm3");
    layers.push_back(layer);
    begin = end + 1;
  }
  return layers;
}

double Phantom::thickness_mm() const {
  double sum = 0.0;
  for (const Layer& layer : layers) sum += layer.thickness_mm;
  return sum;
}

Box Phantom::bounds() const {
  const double half = 0.5 * width_mm;
  const double deep = thickness_mm();
  Box box;
  if (kind == PhantomKind::block) {
    box.min_mm = {-half, -half, -deep};
    box.max_mm = {half, half, 0.0};
  } else {
    box.min_mm = {-deep, -deep, -half};
    box.max_mm = {deep, deep, half};
  }
  return box;
}

double Phantom::volume_mm3() const {
  const double deep = thickness_mm();
  return kind == PhantomKind::block ? width_mm * width_mm * deep : std::numbers::pi * deep * deep * width_mm;
}

double Phantom::surface_mm(const Vec3& point_mm) const {
  // Distance beyond each pair of parallel faces, or beyond the round face. Outside, the nearest edge or corner counts.
  const double half = 0.5 * width_mm;
  Vec3 beyond;
  if (kind == PhantomKind::block) {
    const double middle = 0.5 * thickness_mm();
    beyond = {std::abs(point_mm.x()) - half, std::abs(point_mm.y()) - half, std::abs(point_mm.z() + middle) - middle};
  } else {
    const double radial = std::hypot(point_mm.x(), point_mm.y()) - thickness_mm();
    beyond = {radial, radial > 0.0 ? -1.0 : radial, std::abs(point_mm.z()) - half};
  }
  return beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
}

double Phantom::depth_mm(const Vec3& point_mm) const {
  return kind == PhantomKind::block ? -point_mm.z() : thickness_mm() - std::hypot(point_mm.x(), point_mm.y());
}

double Phantom::density_g_cm3(const Vec3& point_mm, double blur_mm) const {
  const double depth = depth_mm(point_mm);
  const auto density = [](const Layer& layer) { return layer.density_g_cm3; };
  return (integral(layers, depth + 0.5 * blur_mm, density) - integral(layers, depth - 0.5 * blur_mm, density)) /
         blur_mm;
}

Result<Case> build_phantom_case(const Phantom& phantom, double pitch_mm, const std::string& title,
                                const KeepGoing& keep_going) {
  if (auto checked = check_pitch(phantom, pitch_mm); !checked) return tl::unexpected(checked.error());
  const CoordBox box = covering_samples(phantom.bounds().grown(5.0 * pitch_mm), pitch_mm);
  DenseVolume<float> surface(box, 0.0f);
  DenseVolume<float> density(box, 0.0f);
  std::size_t n = 0;
  for (int x = box.min.x; x <= box.max.x; ++x) {
    if (!keep_going(static_cast<double>(x - box.min.x) / box.dims().x)) return stopped_while("building the phantom");
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z, ++n) {
        const Vec3 at = position_mm({x, y, z}, pitch_mm);
        surface.values[n] = static_cast<float>(phantom.surface_mm(at));
        density.values[n] = static_cast<float>(phantom.density_g_cm3(at, pitch_mm));
      }
  }
  CaseInfo info;
  info.title = title;
  info.source = describe(phantom);
  info.pitch_mm = pitch_mm;
  info.calibration = imaging::kRho1995;
  info.threshold_hu = suitable_threshold_hu(phantom);
  return Case::build(std::move(info), surface, density);
}

Result<imaging::HuVolume> scan_phantom(const Phantom& phantom, double spacing_mm, const KeepGoing& keep_going) {
  if (auto checked = check_pitch(phantom, spacing_mm); !checked) return tl::unexpected(checked.error());
  imaging::HuVolume scan;
  const Box field = phantom.bounds().grown(6.0 * spacing_mm);
  const Vec3 size = field.size_mm() / spacing_mm;
  scan.dims = {static_cast<int>(std::ceil(size.x() - 1e-9)), static_cast<int>(std::ceil(size.y() - 1e-9)),
               static_cast<int>(std::ceil(size.z() - 1e-9))};
  scan.spacing_mm = Vec3::Constant(spacing_mm);
  scan.origin_mm = field.min_mm.array() + 0.5 * spacing_mm;
  scan.values.resize(scan.count());

  const double half = 0.5 * spacing_mm;
  const double deep = phantom.thickness_mm();
  const double half_width = 0.5 * phantom.width_mm;
  const double voxel_mm3 = spacing_mm * spacing_mm * spacing_mm;
  const auto inside_integral = [&](double depth) {
    return integral(phantom.layers, std::clamp(depth, 0.0, deep), hu_above_air);
  };

  // The tube looks the same in every slice: mean HU above air over each pixel's square.
  std::vector<double> section;
  if (phantom.kind == PhantomKind::tube) {
    const auto at_depth = [&](double depth) {
      if (depth < 0.0) return 0.0;
      double bottom = 0.0;
      for (const Layer& layer : phantom.layers)
        if (depth <= (bottom += layer.thickness_mm)) return hu_above_air(layer);
      return hu_above_air(phantom.layers.back());
    };
    for (int row = 0; row < scan.dims[1]; ++row) {
      if (!keep_going(0.0)) return stopped_while("scanning the phantom");
      for (int column = 0; column < scan.dims[0]; ++column) {
        const Vec3 centre = scan.position_mm(Vec3(column, row, 0));
        double sum = 0.0;
        for (int v = 0; v < kSubsamples; ++v)
          for (int u = 0; u < kSubsamples; ++u) {
            const Vec3 offset(((u + 0.5) / kSubsamples - 0.5) * spacing_mm,
                              ((v + 0.5) / kSubsamples - 0.5) * spacing_mm, 0.0);
            sum += at_depth(phantom.depth_mm(centre + offset));
          }
        section.push_back(sum / (kSubsamples * kSubsamples));
      }
    }
  }

  std::size_t n = 0;
  for (int slice = 0; slice < scan.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / scan.dims[2])) return stopped_while("scanning the phantom");
    for (int row = 0; row < scan.dims[1]; ++row)
      for (int column = 0; column < scan.dims[0]; ++column) {
        const Vec3 c = scan.position_mm(Vec3(column, row, slice));
        double above_air = 0.0;
        if (phantom.kind == PhantomKind::block) {
          const double area = overlap(c.x() - half, c.x() + half, -half_width, half_width) *
                              overlap(c.y() - half, c.y() + half, -half_width, half_width);
          above_air = area * (inside_integral(-c.z() + half) - inside_integral(-c.z() - half)) / voxel_mm3;
        } else {
          const double length = overlap(c.z() - half, c.z() + half, -half_width, half_width);
          above_air = section[static_cast<std::size_t>(row) * static_cast<std::size_t>(scan.dims[0]) +
                              static_cast<std::size_t>(column)] *
                      length / spacing_mm;
        }
        scan.values[n++] = static_cast<std::int16_t>(std::lround(imaging::kAir_hu + above_air));
      }
  }
  return scan;
}

double suitable_threshold_hu(const Phantom& phantom) {
  const auto [lightest, densest] = std::ranges::minmax(phantom.layers, {}, &Layer::density_g_cm3);
  return std::round(imaging::kAir_hu + 0.25 * (hu_above_air(lightest) + hu_above_air(densest)));
}

}  // namespace osteon::import
