#include "server/import/label_stack.hpp"

#include <png.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>

#include "common/core/check.hpp"
#include "server/import/numbered_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// Slices that are decoded before they are converted to columns of z, so that whole cache lines are written.
constexpr int kBatch = 32;
constexpr std::size_t kMostKinds = 250;
constexpr double kLargestVolume = 1.0e9;  // voxels
constexpr double kLargestSlice = 6.4e7;  // pixels: a small file can claim far more, and all of them are decoded at once
constexpr double kDensest_g_cm3 = 3.0;   // enamel

using Rgba = std::array<std::uint8_t, 4>;

std::string text_of(const Rgba& c) {
  char text[32];
  std::snprintf(text, sizeof text, "%d,%d,%d", c[0], c[1], c[2]);
  return text;
}

// RGBA bytes of one file. libpng's simplified reader converts every kind of PNG and reports errors as text.
Result<std::vector<Rgba>> read_png(const fs::path& file, int& width, int& height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0)
    return failure(ErrorCode::invalid_input,
                   file.string() + " cannot be read as a PNG picture (" + image.message + "); export it again");
  image.format = PNG_FORMAT_RGBA;
  std::vector<Rgba> pixels;
  const double count = static_cast<double>(image.width) * image.height;
  if (count > kLargestSlice) {
    png_image_free(&image);
    return failure(ErrorCode::invalid_input, file.string() + " is " + std::to_string(image.width) + "x" +
                                                 std::to_string(image.height) +
                                                 ", more than the 64 million pixels of a slice; export it smaller");
  }
  pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  width = static_cast<int>(image.width);
  height = static_cast<int>(image.height);
  if (png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) == 0)
    return failure(ErrorCode::invalid_input,
                   file.string() + " is damaged (" + image.message + "); copy or export it again");
  return pixels;
}

int label_of(const Rgba& c, const LabelLegend& legend) {
  if (c[3] == 0) return 0;
  for (std::size_t i = 0; i < legend.bones.size(); ++i) {
    const auto& rgb = legend.bones[i].rgb;
    if (std::abs(c[0] - rgb[0]) <= legend.tolerance && std::abs(c[1] - rgb[1]) <= legend.tolerance &&
        std::abs(c[2] - rgb[2]) <= legend.tolerance)
      return static_cast<int>(i) + 1;
  }
  return 0;
}

// The colours found so far. Neighbouring pixels mostly have the same colour, so the last one is checked first.
class Palette {
 public:
  explicit Palette(const LabelLegend& legend) : legend_(legend) {}
  std::uint8_t count(const Rgba& colour) {
    if (!last_ || last_->rgba != colour) {
      const std::uint32_t key = static_cast<std::uint32_t>(colour[0]) << 24 |
                                static_cast<std::uint32_t>(colour[1]) << 16 |
                                static_cast<std::uint32_t>(colour[2]) << 8 | colour[3];
      const auto [at, fresh] = colours_.try_emplace(key);
      if (fresh) at->second = {colour, 0, label_of(colour, legend_)};
      last_ = &at->second;
    }
    ++last_->voxels;
    return static_cast<std::uint8_t>(last_->label);
  }
  [[nodiscard]] std::vector<ColourCount> sorted() const {
    std::vector<ColourCount> out;
    for (const auto& [key, colour] : colours_) out.push_back(colour);
    std::ranges::stable_sort(out, std::greater{}, &ColourCount::voxels);
    return out;
  }

 private:
  const LabelLegend& legend_;
  std::map<std::uint32_t, ColourCount> colours_;
  ColourCount* last_ = nullptr;
};

Result<void> check_bone(const BoneColour& bone, const std::string& where) {
  if (!(bone.density_g_cm3 > 0.0) || bone.density_g_cm3 > kDensest_g_cm3)
    return failure(ErrorCode::invalid_input, where + ": a density must be above 0 and at most 3 g/cm3");
  return {};
}

}  // namespace

Result<BoneColour> parse_bone_colour(std::string_view text) {
  const auto wrong = [&] {
    return failure(
        ErrorCode::invalid_input,
        "--bone " + std::string(text) + " is not a colour; write R,G,B or R,G,B:DENSITY_G_CM3 such as 255,249,219:1.9");
  };
  BoneColour bone;
  bone.name = text.substr(0, text.find(':'));
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (std::size_t i = 0; i < 3; ++i) {
    int value = -1;
    const auto parsed = std::from_chars(at, end, value);
    if (parsed.ec != std::errc{} || value < 0 || value > 255) return wrong();
    bone.rgb[i] = static_cast<std::uint8_t>(value);
    at = parsed.ptr;
    if (i < 2 && (at == end || *at++ != ',')) return wrong();
  }
  if (at != end) {
    if (*at++ != ':') return wrong();
    const auto parsed = std::from_chars(at, end, bone.density_g_cm3);
    if (parsed.ec != std::errc{} || parsed.ptr != end) return wrong();
  }
  if (auto checked = check_bone(bone, "--bone " + std::string(text)); !checked) return tl::unexpected(checked.error());
  return bone;
}

Result<LabelLegend> read_legend(const fs::path& file) {
  const auto wrong = [&](const std::string& why) {
    return failure(ErrorCode::invalid_input,
                   file.string() + " is not a legend: " + why +
                       "; write bones: [{name: cortical, colour: [255, 249, 219], density_g_cm3: 1.9}]");
  };
  std::error_code error;
  if (!fs::exists(file, error)) return failure(ErrorCode::not_found, "there is no legend " + file.string());
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    if (!root.IsMap()) return wrong("it is not a map");
    for (const auto& entry : root)
      if (const auto key = entry.first.as<std::string>(); key != "bones" && key != "tolerance")
        return wrong("unknown key " + key);
    LabelLegend legend;
    legend.bones.clear();
    if (const YAML::Node tolerance = root["tolerance"]) legend.tolerance = tolerance.as<int>();
    if (legend.tolerance < 0 || legend.tolerance > 255) return wrong("tolerance must be 0 to 255");
    if (!root["bones"].IsSequence() || root["bones"].size() == 0) return wrong("bones must be a list");
    for (const YAML::Node& node : root["bones"]) {
      BoneColour bone;
      const auto rgb = node["colour"].as<std::vector<int>>();
      if (rgb.size() != 3 || !std::ranges::all_of(rgb, [](int v) { return v >= 0 && v <= 255; }))
        return wrong("a colour is three numbers from 0 to 255");
      for (std::size_t i = 0; i < 3; ++i) bone.rgb[i] = static_cast<std::uint8_t>(rgb[i]);
      bone.name = node["name"].as<std::string>("bone");
      bone.density_g_cm3 = node["density_g_cm3"].as<double>(bone.density_g_cm3);
      if (auto checked = check_bone(bone, file.string()); !checked) return tl::unexpected(checked.error());
      legend.bones.push_back(std::move(bone));
    }
    if (legend.bones.size() > kMostKinds) return wrong("it has more than " + std::to_string(kMostKinds) + " bones");
    return legend;
  } catch (const YAML::Exception& e) {
    return wrong(e.what());
  }
}

Result<LabelStack> read_label_stack(const fs::path& folder, const LabelLegend& legend, const Vec3& spacing_mm,
                                    const KeepGoing& keep_going) {
  OSTEON_CHECK(!legend.bones.empty() && legend.bones.size() <= kMostKinds && spacing_mm.minCoeff() > 0.0);
  const auto slices = numbered_files(folder, ".png", "a label volume as PNG slices");
  if (!slices) return tl::unexpected(slices.error());

  LabelStack stack;
  imaging::LabelVolume& volume = stack.volume;
  volume.spacing_mm = spacing_mm;
  Palette palette(legend);
  const int count = static_cast<int>(slices->size());
  std::vector<std::vector<std::uint8_t>> batch;
  for (int first = 0; first < count; first += kBatch) {
    const int depth = std::min(kBatch, count - first);
    batch.assign(static_cast<std::size_t>(depth), {});
    for (int i = 0; i < depth; ++i) {
      if (!keep_going(static_cast<double>(first + i) / count)) return stopped_while("reading the slices");
      const fs::path& file = (*slices)[static_cast<std::size_t>(first + i)];
      int width = 0, height = 0;
      const auto pixels = read_png(file, width, height);
      if (!pixels) return tl::unexpected(pixels.error());
      if (volume.dims[0] == 0) {
        volume.dims = {width, height, count};
        if (static_cast<double>(width) * height * count > kLargestVolume)
          return failure(ErrorCode::invalid_input,
                         folder.string() + " has more than 1000 million voxels; cut it into parts");
        volume.labels = DenseVolume<std::uint8_t>({{0, 0, 0}, {width - 1, height - 1, count - 1}}, 0);
      } else if (width != volume.dims[0] || height != volume.dims[1]) {
        return failure(ErrorCode::invalid_input, file.string() + " is " + std::to_string(width) + "x" +
                                                     std::to_string(height) + " where the slices before are " +
                                                     std::to_string(volume.dims[0]) + "x" +
                                                     std::to_string(volume.dims[1]) + "; export the stack again");
      }
      std::vector<std::uint8_t>& labels = batch[static_cast<std::size_t>(i)];
      labels.resize(pixels->size());
      std::ranges::transform(*pixels, labels.begin(), [&](const Rgba& colour) { return palette.count(colour); });
    }
    const auto [columns, rows, all] = volume.dims;
    for (int x = 0; x < columns; ++x)
      for (int y = 0; y < rows; ++y) {
        std::uint8_t* line = &volume.labels.at({x, y, first});
        for (int i = 0; i < depth; ++i)
          line[i] = batch[static_cast<std::size_t>(i)][static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                                                       static_cast<std::size_t>(x)];
      }
  }
  stack.colours = palette.sorted();
  if (std::ranges::none_of(stack.colours, [](const ColourCount& c) { return c.label != 0; })) {
    std::string most;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, stack.colours.size()); ++i)
      most += (i > 0 ? "; " : "") + text_of(stack.colours[i].rgba);
    return failure(ErrorCode::invalid_input, folder.string() + " has no voxel in a bone colour (most have " + most +
                                                 "); name the bone's with --bone R,G,B");
  }
  return stack;
}

}  // namespace osteon::import
