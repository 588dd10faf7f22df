// Targets for labels: a PNG slice, names that a person gives, and names in the headers of label maps.
#include <png.h>

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <string>

#include "common/core/check.hpp"
#include "common/core/digest.hpp"
#include "server/import/label_import.hpp"
#include "server/import/nifti_names.hpp"
#include "server/import/slicer_segments.hpp"
#include "server/import/structure_names.hpp"
#include "tests/fuzz/import_files.hpp"
#include "tests/fuzz/import_targets.hpp"

namespace osteon::fuzz {
namespace {

constexpr int kWidth = 6, kHeight = 5;
constexpr std::size_t kSmall = 4096;  // voxels: larger volumes are read, but no case is made of them

Bytes label_slice(png_uint_32 format) {
  constexpr std::array<png_byte, 4> kBone{255, 249, 219, 255};
  const std::size_t channels = PNG_IMAGE_SAMPLE_CHANNELS(format);
  std::vector<png_byte> pixels;
  for (int i = 0; i < kWidth * kHeight; ++i)
    for (std::size_t channel = 0; channel < channels; ++channel)
      pixels.push_back(i % 7 == 0 ? png_byte{0} : kBone[channel]);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = kWidth;
  image.height = kHeight;
  image.format = format;
  const InputFile file("slice1.png");
  const auto path = file.write({});
  OSTEON_CHECK(png_image_write_to_file(&image, path.c_str(), 0, pixels.data(), 0, nullptr) != 0);
  return bytes_of_file(path);
}

// True if these labels come for the first time. Making a case of them takes a hundred times as long as reading them.
bool is_new(const imaging::LabelVolume& volume) {
  static std::set<Digest> seen;
  Hasher hasher;
  for (const int count : volume.dims) hasher.integer(static_cast<std::uint64_t>(count));
  hasher.bytes(std::as_bytes(std::span(volume.labels.values)));
  return seen.insert(hasher.finish()).second;
}

void read_label_slice(std::span<const std::uint8_t> data) {
  static const InputFile file("slice1.png");
  static const import::LabelLegend legend;
  file.write(data);
  const auto going = [](double) { return true; };
  auto stack = import::read_label_stack(file.folder(), legend, Vec3(0.5, 0.75, 1.0), going);
  if (!stack) return expect_bounded(stack.error());
  if (stack->volume.labels.values.size() > kSmall || !is_new(stack->volume)) return;
  const auto made =
      import::import_labels(std::move(*stack), legend, {.pitch_mm = {}, .title = "Labels", .smoothing = {}}, going);
  if (!made) return expect_bounded(made.error());
  OSTEON_CHECK(made->labelled_mm3 > 0.0 && made->bone.volume_mm3() > 0.0);
}

void read_names(std::span<const std::uint8_t> data) {
  const auto names = import::parse_label_names({std::string(data.begin(), data.end())});
  if (!names) return expect_bounded(names.error());
  for (const auto& [from, structure] : names->given)
    OSTEON_CHECK(!from.empty() && structure.name.size() <= 100 && (!structure.kind || !structure.name.empty()));
}

// Bytes as the header of a NIfTI file, and their lines as fields of NRRD.
void read_headers(std::span<const std::uint8_t> data) {
  const std::string text(data.begin(), data.end());
  for (const auto& [number, name] : import::nifti_label_names(text)) OSTEON_CHECK(number > 0);
  import::HeaderFields fields;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    if (const std::size_t at = line.find(":="); at != std::string::npos)
      fields.emplace_back(line.substr(0, at), line.substr(at + 2));
    begin = end + 1;
  }
  const auto segments = import::slicer_segments(fields);
  if (!segments) return expect_bounded(segments.error());
  for (const import::SlicerSegment& segment : *segments) OSTEON_CHECK(segment.layer >= 0 && segment.value > 0);
}

std::string nifti_with_names() {
  std::string header(352, '\0');
  header[348] = 1;
  const std::string xml =
      "<CaretExtension><VolumeInformation><LabelTable><Label Key=\"75\">femur_left</Label>"
      "<Label Key=\"52\">aorta</Label></LabelTable></VolumeInformation></CaretExtension>";
  return header + std::string{static_cast<char>(xml.size() + 8), 0, 0, 0, 0, 0, 0, 0} + xml;
}

}  // namespace

Target label_names_target() {
  return {"label_names",
          read_names,
          {bytes_of_text("totalsegmentator,3=my guide:metal,Segment_4=:none"),
           bytes_of_text("1=femur_left, 2=sciatic nerve,7=Left common carotid artery")}};
}

Target label_header_target() {
  return {"label_header",
          read_headers,
          {bytes_of_text(nifti_with_names()),
           bytes_of_text("Segment0_Name:=femur\nSegment0_LabelValue:=3\nSegment0_Layer:=0\n"
                         "Segment1_Name:=vein\nSegment1_Tags:=TerminologyEntry:a~SCT^1^b~SCT^2^Vein~^^~|\n")}};
}

Target label_slice_target() {
  Target target{"label_slice",
                read_label_slice,
                {label_slice(PNG_FORMAT_RGBA), label_slice(PNG_FORMAT_RGB), label_slice(PNG_FORMAT_GRAY)}};
  target.mutations = 50;
  return target;
}

}  // namespace osteon::fuzz
